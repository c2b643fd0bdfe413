"""The cost of a shape from file to descriptor, step by step, and its size in storage.

``python -m benchmarks.cost`` subdivides creatures until they have the wanted number of vertices,
and reads them as binary PLY. Seconds are medians on one processor. ``--model FILE`` measures
another model than the shipped one, a ``proteus.json``.
"""

import argparse
import hashlib
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from rich.console import Console
from rich.progress import track
from rich.table import Table

from workers.creatures import make_creature
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse, write
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import prepare
from workers.geometry.refinement import refine
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.retrieval.model import Model, describe
from workers.storage.blobs import BlobStore
from workers.storage.shipped_models import shipped_model
from workers.storage.solutions import store_solution

SIZES = (5_000, 30_000, 100_000)
SPECIES = ("human", "cow", "octopus")
T = TypeVar("T")


class Clock:
    """Seconds of this processor by the name of a step."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def time(self, step: str, work: Callable[[], T]) -> T:
        """Do the work and add what it took to a step."""
        before = time.process_time()
        result = work()
        taken = time.process_time() - before
        self.seconds[step] = self.seconds.get(step, 0.0) + taken
        return result


def creature_file(species: str, vertices: int) -> bytes:
    """PLY of a creature with about so many vertices."""
    coarse = vertices
    while coarse > 10_000:
        coarse //= 4
    mesh = make_creature(species, seed=0, vertices=coarse).rest
    return write(refine(mesh, vertices=round(0.9 * vertices)), "ply")


def measure(data: bytes, model: Model, folder: Path) -> tuple[dict[str, float], dict[str, int]]:
    """Seconds by step, and bytes by what is stored."""
    clock, blobs = Clock(), BlobStore(f"file://{folder}")
    parsed: TriangleMesh = clock.time("parse", lambda: parse(data, filename="a.ply").mesh)
    cleaned = clock.time("clean", lambda: clean(parsed).mesh)
    solutions, stored = {}, {"file": len(data), "descriptor": 4 * model.dimension}
    digest = hashlib.sha256(data).hexdigest()
    for view in model.views:
        mesh = clock.time(f"prepare {view.name}", lambda v=view: prepare(cleaned, v).mesh)  # type: ignore[misc]
        spectrum = clock.time(
            f"spectrum {view.name}",
            lambda v=view, m=mesh: compute_spectrum(m, n_eigenpairs=v.eigenpairs),  # type: ignore[misc]
        )
        before = _stored(folder)
        solutions[view.name] = store_solution(
            blobs, digest, view, Solution(mesh, spectrum), cleaned=cleaned
        )
        stored[f"solution {view.name}"] = _stored(folder) - before
    clock.time("describe", lambda: describe(solutions, model))
    return clock.seconds, stored


def _stored(folder: Path) -> int:
    """Bytes of all files below it."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def main() -> None:
    """Measure, print, and save what was measured where ``--out`` says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--model", type=Path, help="instead of the shipped one")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    model = shipped_model()
    if options.model is not None:
        model = Model.from_json(json.loads(options.model.read_text()))
    found: dict[int, list[tuple[dict[str, float], dict[str, int]]]] = {}
    work = [(size, name) for size in SIZES for name in SPECIES]
    for size, name in track(work, "measuring", console=Console(stderr=True)):
        data = creature_file(name, size)
        for _ in range(options.repeats):
            with tempfile.TemporaryDirectory() as folder:
                found.setdefault(size, []).append(measure(data, model, Path(folder)))
    _print(found)
    if options.out is not None:
        options.out.write_text(json.dumps(found, indent=1) + "\n")


def _print(found: dict[int, list[tuple[dict[str, float], dict[str, int]]]]) -> None:
    """Show medians over species and repeats."""
    console = Console()
    for place, title in enumerate(("seconds of one processor", "kilobytes stored")):
        table = Table("", *(f"{size:,} vertices" for size in found), title=title)
        rows = list(next(iter(found.values()))[0][place])
        for row in rows:
            table.add_row(
                row, *(_median([one[place][row] for one in f], place) for f in found.values())
            )
        table.add_section()
        totals = ([sum(one[place].values()) for one in f] for f in found.values())
        table.add_row("together", *(_median(total, place) for total in totals))
        console.print(table)


def _median(values: list[float], place: int) -> str:
    median = statistics.median(values)
    return f"{median / 1000:,.0f}" if place else f"{median:.2f}"


if __name__ == "__main__":
    main()
