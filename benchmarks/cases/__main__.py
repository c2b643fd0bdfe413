"""Files with what is expected of each, sent to a service of their own, as a table.

``python -m benchmarks.cases FOLDER`` takes a folder with ``base.ply``, the clean mesh that most of
the files are made of, and ``index.json``: a list of objects with ``id``, ``file`` and
``expected``. It starts a service with its data in a temporary folder, uploads 24 creatures and the
clean mesh to one collection and each file to one of its own, and queries with what became of it.
A line has the outcome, the distance to the clean mesh and its rank among the creatures, and whether
that is what was expected. Where that takes a reader, it says so.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.cases.judging import Case, Outcome, Surface, Verdict, judge
from benchmarks.survival import running_service
from proteus.client import Client, Document, ServiceError, json_object
from proteus.jobs import JobWatch
from proteus.uploads import ensure_collection
from workers.creatures import SPECIES, make_creature
from workers.geometry.formats import parse, write

CREATURES = 24
CREATURE_VERTICES = 2000
COLLECTION = "creatures"
CLEAN = "base.ply"
STYLES = {Verdict.OK: "green", Verdict.WRONG: "bold red", Verdict.BY_EYE: "yellow"}
MESSAGES = Console(stderr=True)


def upload(client: Client, collection: str, files: Sequence[tuple[str, bytes]]) -> Document:
    """Upload files in one request and return their job when it has ended."""
    ensure_collection(client, collection)
    parts = [("files", file) for file in files]
    path = f"/v1/collections/{collection}/shapes"
    watch = JobWatch(client, json_object(client.request("POST", path, files=parts))["job"])
    for job in watch.changes():
        last = job
    return last


def shapes_of(client: Client, collection: str) -> list[Document]:
    """Return the shapes of a collection."""
    return list(client.pages(f"/v1/collections/{collection}/shapes"))


def surface_of(client: Client, shape: Document) -> Surface:
    """Return what is compared of a shape that is ready."""
    data = client.request("GET", f"/v1/shapes/{shape['id']}/mesh", params={"format": "ply"}).content
    vertices = parse(data).mesh.vertices
    diagonal = np.linalg.norm(vertices.max(axis=0) - vertices.min(axis=0))
    return Surface.of(shape, float(diagonal))


def creature_files(count: int) -> list[tuple[str, bytes]]:
    """Return small creatures of as many species, posed; names and files."""
    files = []
    for species in track(SPECIES[:count], "creatures", console=MESSAGES):
        creature = make_creature(species, seed=1, vertices=CREATURE_VERTICES)
        files.append((f"{species}.ply", write(creature.posed(1), "ply")))
    return files


def outcome_of(client: Client, collection: str, path: Path) -> Outcome:
    """Upload a file to a collection of its own and query the creatures with it."""
    try:
        job = upload(client, collection, [(path.name, path.read_bytes())])
    except ServiceError as error:
        return Outcome(failed=((path.name, str(error)),))
    shapes = shapes_of(client, collection)
    ready = [shape for shape in shapes if shape["state"] == "ready"]
    failed = [shape for shape in shapes if shape["state"] == "failed"]
    reasons = {shape["name"]: shape["error"]["detail"] for shape in failed}
    reasons = {error["item"]: error["detail"] for error in job["errors"]} | reasons
    outcome = Outcome(
        ready=tuple(shape["name"] for shape in ready),
        failed=tuple(reasons.items()),
        stored_failures=len(failed),
    )
    if not ready:
        return outcome
    body = {"shape_id": ready[0]["id"], "limit": CREATURES + 1}
    surface = surface_of(client, ready[0])
    try:
        answer = client.post(f"/v1/collections/{COLLECTION}/query", body)
    except ServiceError as error:
        reason = path.name, f"the query failed: {error}"
        return replace(outcome, failed=(*outcome.failed, reason), surface=surface)
    (match,) = (match for match in answer["matches"] if match["shape"]["name"] == CLEAN)
    return replace(outcome, surface=surface, distance=match["distance"], rank=match["rank"])


def described(outcome: Outcome) -> str:
    """Return an outcome in a line."""
    others = [f"{name}: {reason}" for name, reason in outcome.failed]
    if outcome.surface is None:
        return f"refused: {outcome.reason}" if len(others) == 1 else "; ".join(others) or "nothing"
    found = outcome.surface
    words = f"{found.vertices:,} vertices, area {found.area:.6g}"
    words += f", {found.components} components" if found.components > 1 else ""
    words += f", {found.loops} loops" if found.loops else ""
    words += f"; {len(outcome.ready)} shapes" if len(outcome.ready) > 1 else ""
    return words + (f"; failed: {len(others)}" if others else "")


def measure(folder: Path, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Return one record a case, judged."""
    files = creature_files(CREATURES)
    records = []
    with (
        tempfile.TemporaryDirectory(prefix="proteus-cases-") as data,
        running_service(Path(data)) as (url, _),
        Client(url, patience_seconds=60.0) as client,
    ):
        with MESSAGES.status(f"uploading {CREATURES} creatures"):
            upload(client, COLLECTION, [*files, (CLEAN, (folder / CLEAN).read_bytes())])
        (clean,) = (shape for shape in shapes_of(client, COLLECTION) if shape["name"] == CLEAN)
        expected = surface_of(client, clean)
        for number, case in enumerate(track(cases, "cases", console=MESSAGES)):
            outcome = outcome_of(client, f"case-{number}", folder / case["file"])
            verdict, words = judge(case, outcome, expected)
            records.append(
                {"id": case["id"], "expected": case["expected"], "got": described(outcome)}
                | {"outcome": asdict(outcome), "verdict": verdict, "words": words}
            )
    return records


def table(records: Sequence[dict[str, Any]]) -> Table:
    """Return one row a case."""
    rows = Table(show_lines=True)
    for column in ("id", "expected", "got", "distance", "rank", "verdict"):
        rows.add_column(column, overflow="fold")
    for one in records:
        outcome, verdict = one["outcome"], Verdict(one["verdict"])
        found = outcome["rank"] > 0
        rows.add_row(
            *(one["id"], one["expected"], one["got"]),
            f"{outcome['distance']:.3f}" if found else "",
            str(outcome["rank"]) if found else "",
            f"[{STYLES[verdict]}]{verdict}[/] {one['words']}",
        )
    return rows


def main() -> None:
    """Measure, save, print; the exit code is 1 where a case is wrong."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.cases",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", help="cases with this in their id")
    parser.add_argument("--out", type=Path, default=Path("cases.json"), help="raw results")
    asked = parser.parse_args()
    cases = json.loads((asked.folder / "index.json").read_text())
    cases = [case for case in cases if asked.only in case["id"]]
    records = measure(asked.folder, cases)
    asked.out.write_text(json.dumps(records, indent=1, default=str) + "\n")
    console = Console(width=180)
    console.print(table(records))
    for verdict in Verdict:
        names = [one["id"] for one in records if one["verdict"] == verdict]
        console.print(f"{verdict}: {len(names)}  {' '.join(names) if verdict != 'ok' else ''}")
    sys.exit(any(one["verdict"] == Verdict.WRONG for one in records))


if __name__ == "__main__":
    main()
