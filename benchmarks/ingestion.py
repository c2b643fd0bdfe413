"""Meshes a minute: uploaded over HTTP, solved by two processes, until all can be found.

``python -m benchmarks.ingestion --data FOLDER`` starts a service of its own for each row. It takes
the folder's meshes as they are, the same with 50,000 vertices, and tiny ones in a zip. Beside it
stands a plain loop in as many processes: trimesh reads the file, and LaPy solves it at full
resolution for 100 eigenpairs. The share of each step is that of one process which does the same
work on some of the files, in seconds of the processor.
"""

import argparse
import io
import json
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest import mock

import httpx
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.activation import COLLECTION, store
from benchmarks.cost import solve_plainly
from benchmarks.survival import running_service
from workers.creatures import SPECIES, make_creature
from workers.errors import ProteusError
from workers.geometry.arrays import IntArray
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse, write
from workers.geometry.mesh import TriangleMesh
from workers.geometry.refinement import refine
from workers.geometry.simplification import simplify
from workers.logs import configure_logs
from workers.pipeline.work import run_pending
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.collections import create_collection
from workers.storage.database import Database
from workers.storage.migrate import migrate

PROGRESS = Console(stderr=True)
FINE = 50_000  # vertices of the second row
REQUEST_BYTES, REQUEST_FILES = 32 << 20, 50  # of one upload
PLAIN_EIGENPAIRS = 100
TINY = (100, 1000)  # vertices, of the last row
BENDS = 50  # tiny meshes made of one creature: simplifying costs more than bending
STEPS: dict[str, tuple[str, ...]] = {
    "reading": ("workers.pipeline.ingest.read_mesh", "workers.pipeline.ingest._facts"),
    "thumbnail": ("workers.pipeline.ingest.render", "workers.pipeline.ingest.encode_png"),
    "preparing": ("workers.geometry.preparation.Preparation.under",),
    "spectrum": ("workers.geometry.solution.compute_spectrum",),
    "points": ("workers.geometry.solution.sample_surface",),
    "describing": ("workers.pipeline.solve.describe",),
    "storing": (
        "workers.storage.blobs.BlobStore.put",
        "workers.storage.solutions.pack",
        "workers.pipeline.work.commit",
        "workers.pipeline.work.commit_together",
    ),
}
"""Functions of each step; what a function calls of another step counts for that one."""


@dataclass(frozen=True)
class PlainLoop:
    """What one mesh takes in the plain loop.

    Attributes
    ----------
    seconds : float
        By the clock, of the slowest process, over the meshes of all processes.
    processor_seconds : float
        Of all processes.
    """

    seconds: float
    processor_seconds: float


@dataclass(frozen=True)
class Measured:
    """What a row of the table says.

    Attributes
    ----------
    meshes, failed : int
        Uploaded, and those of them that could not be described.
    seconds : float
        From the first request until the last shape could be found.
    processor_seconds : float
        Of all processes of the service meanwhile.
    shares : dict of str to float
        Of each step in the processor time of the work, and of all that is in no step.
    plain : PlainLoop or None
        What the plain loop took.
    """

    name: str
    meshes: int
    failed: int
    seconds: float
    processor_seconds: float
    shares: dict[str, float]
    plain: PlainLoop | None

    @property
    def a_minute(self) -> float:
        """Meshes a minute."""
        return 60.0 * self.meshes / self.seconds

    @property
    def ratio(self) -> float | None:
        """How many times as fast as the plain loop, by the clock."""
        return None if self.plain is None else self.plain.seconds * self.meshes / self.seconds


class Clock:
    """Seconds of this processor by step; of steps within each other, the inner one's count."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._open: list[str] = []
        self._since = time.process_time()

    def _charge(self) -> None:
        now = time.process_time()
        step = self._open[-1] if self._open else "other"
        self.seconds[step] = self.seconds.get(step, 0.0) + now - self._since
        self._since = now

    def timed(self, step: str, work: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, with its time counted for a step."""

        def counted(*arguments: Any, **named: Any) -> Any:
            self._charge()
            self._open.append(step)
            try:
                return work(*arguments, **named)
            finally:
                self._charge()
                self._open.pop()

        return counted

    def shares(self) -> dict[str, float]:
        """Share of each step until now."""
        self._charge()
        together = sum(self.seconds.values())
        return {step: seconds / together for step, seconds in self.seconds.items()}


def shares_of_steps(files: Sequence[Path]) -> dict[str, float]:
    """Ingest files in this process with the code that workers run; the share of each step."""
    configure_logs(level="error")
    with tempfile.TemporaryDirectory() as folder, ExitStack() as patches:
        settings = Settings(data_dir=Path(folder))
        migrate(settings)
        database, blobs = Database(settings.resolved_database_url), _blobs(settings)
        with database.begin() as session:
            create_collection(session, name=COLLECTION, description="", model="proteus")
        store(database, blobs, iter([(files[0].name, files[0].read_bytes())]))
        run_pending(database, blobs, settings)  # whatever is loaded or made once
        store(database, blobs, ((path.name, path.read_bytes()) for path in files[1:]))
        clock = Clock()
        for step, functions in STEPS.items():
            for function in functions:
                owner, name = _owner(function)
                counted = clock.timed(step, getattr(owner, name))
                patches.enter_context(mock.patch.object(owner, name, counted))
        run_pending(database, blobs, settings)
        shares = clock.shares()
        database.dispose()
    return shares


def _owner(function: str) -> tuple[Any, str]:
    """The module or class that a function stands in, and its name there."""
    path, name = function.rsplit(".", 1)
    try:
        return import_module(path), name
    except ModuleNotFoundError:
        module, owner = path.rsplit(".", 1)
        return getattr(import_module(module), owner), name


def _blobs(settings: Settings) -> BlobStore:
    return BlobStore(settings.resolved_blob_url)


def plain_loop(files: Sequence[Path], processes: int) -> PlainLoop:
    """The plain way through some files, which so many processes share."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "benchmarks.ingestion", "--plain-loop"]
    running = [
        subprocess.Popen(
            [*command, *map(str, files[i::processes])],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        for i in range(processes)
    ]
    taken = [json.loads(process.communicate()[0].splitlines()[-1]) for process in running]
    clock, processor = zip(*taken, strict=True)
    return PlainLoop(max(clock) / len(files), sum(processor) / len(files))


def run_plain_loop(files: Sequence[Path]) -> tuple[float, float]:
    """Seconds by the clock and of the processor for some files; a warm-up is not counted."""
    with tempfile.TemporaryDirectory() as folder:
        warm = Path(folder) / "warm.ply"
        warm.write_bytes(_small_mesh(1.0))
        solve_plainly(warm, eigenpairs=PLAIN_EIGENPAIRS)
    started, worked = time.perf_counter(), time.process_time()
    for path in files:
        try:
            solve_plainly(path, eigenpairs=PLAIN_EIGENPAIRS)
        except Exception as error:  # whatever the peers raise at a mesh that they cannot solve
            PROGRESS.print(f"{path.name}: {type(error).__name__} in the plain loop")
    return time.perf_counter() - started, time.process_time() - worked


def _small_mesh(height: float) -> bytes:
    """PLY of a tetrahedron with 514 vertices."""
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * [1.0, 1.0, height]
    mesh = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]))
    return write(refine(mesh, vertices=500), "ply")


def ingest(
    name: str, files: Sequence[Path], *, processes: int, sampled: int, archive: bool = False
) -> Measured:
    """Upload files to a new service and wait for them.

    Parameters
    ----------
    name : str
        Of the row.
    files : sequence of Path
        Meshes, no two alike.
    processes : int
        Of the worker, and of the plain loop.
    sampled : int
        Of how many files the shares and the plain loop are measured; 0 for neither.
    archive : bool
        Whether all are in one zip.
    """
    chosen = files[:: max(1, -(-len(files) // sampled))] if sampled else []
    shares = shares_of_steps(chosen) if len(chosen) > 1 else {}
    plain = plain_loop(chosen, processes) if chosen else None
    with (
        tempfile.TemporaryDirectory(prefix="proteus-ingestion-") as folder,
        running_service(Path(folder), processes=processes) as (url, parent),
        httpx.Client(base_url=url, timeout=600) as client,
    ):
        client.post("/v1/collections", json={"name": COLLECTION}).raise_for_status()
        warm = [(f"{i}.ply", _small_mesh(1.0 + i)) for i in range(4 * processes)]
        _upload(client, warm)  # whatever each process loads or makes once
        _wait(client, len(warm))
        before, started = processor_seconds(parent), time.perf_counter()
        for request in _requests(files, archive=archive):
            _upload(client, request)
        _, failed = _wait(client, len(files) + len(warm))
        seconds = time.perf_counter() - started
        spent = processor_seconds(parent) - before
    if failed:
        PROGRESS.print(f"{name}: {failed} of {len(files)} meshes failed")
    return Measured(name, len(files), failed, seconds, spent, shares, plain)


def _requests(files: Sequence[Path], *, archive: bool) -> Iterator[list[tuple[str, bytes]]]:
    """Names and contents of the files of each upload."""
    if archive:
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as packed:
            for path in files:
                packed.write(path, path.name)
        yield [("meshes.zip", buffer.getvalue())]
        return
    request: list[tuple[str, bytes]] = []
    held = 0
    for path in files:
        request.append((path.name, path.read_bytes()))
        held += len(request[-1][1])
        if held >= REQUEST_BYTES or len(request) == REQUEST_FILES:
            yield request
            request, held = [], 0
    if request:
        yield request


def _upload(client: httpx.Client, files: Sequence[tuple[str, bytes]]) -> None:
    sent = client.post(
        f"/v1/collections/{COLLECTION}/shapes", files=[("files", file) for file in files]
    )
    sent.raise_for_status()


def _wait(client: httpx.Client, count: int) -> tuple[int, int]:
    """Shapes that can be found and that failed, once they are so many."""
    while True:
        found = client.get(f"/v1/collections/{COLLECTION}").raise_for_status().json()
        ready, failed = found["ready_count"], found["failed_count"]
        if ready + failed >= count:
            return ready, failed
        time.sleep(0.5)  # counting shapes costs the service a little, too


def processor_seconds(parent: int) -> float:
    """What a process, those below it, and those of them that have ended took of the processors."""
    ticks: dict[int, tuple[int, int]] = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        ticks[int(entry.name)] = int(fields[1]), sum(map(int, fields[11:15]))
    family = {parent}
    while grown := {pid for pid, (above, _) in ticks.items() if above in family} - family:
        family |= grown
    return sum(ticks[pid][1] for pid in family if pid in ticks) / os.sysconf("SC_CLK_TCK")


def real_files(data: Path, folder: Path, count: int, vertices: int | None) -> list[Path]:
    """So many meshes of a folder, as they are or subdivided to so many vertices.

    Where the folder has fewer, a second round has nine tenths of the vertices of the first, and so
    on. Meshes as they are have one round.
    """
    sources = [path for path in sorted(data.rglob("*.*")) if path.suffix.lower() != ".md"]
    if vertices is None:
        return sources[:count]
    found: list[Path] = []
    for number in track(range(count), f"making {vertices:,} vertices", console=PROGRESS):
        again, place = divmod(number, len(sources))
        source = sources[place]
        try:
            mesh = clean(parse(source.read_bytes(), filename=source.name).mesh).mesh
        except ProteusError:
            continue
        path = folder / f"{again}-{place}-{source.stem}.ply"
        path.write_bytes(write(subdivided(mesh, round(vertices * 0.9**again)), "ply"))
        found.append(path)
    return found


def subdivided(mesh: TriangleMesh, vertices: int) -> TriangleMesh:
    """The same surface with so many vertices: whole rounds first, then the longest edges alone.

    Parameters
    ----------
    mesh : TriangleMesh
        One that has more vertices is returned as it is.
    vertices : int
        How many the result has.
    """
    missing = vertices - mesh.n_vertices
    if missing <= 0:
        return mesh
    faces = mesh.faces
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2)  # (m, 3, 2)
    edges, inverse = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)  # (e, 2)
    lengths = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1)
    cut = np.argsort(-lengths, kind="stable")[:missing]
    middle = np.full(len(edges), -1)
    middle[cut] = mesh.n_vertices + np.arange(len(cut))
    points = np.concatenate([mesh.vertices, mesh.vertices[edges[cut]].mean(axis=1)])
    pieces = _cut(faces, middle[inverse].reshape(-1, 3))
    return subdivided(TriangleMesh(points, pieces), vertices)


def _cut(faces: IntArray, middles: IntArray) -> IntArray:
    """Faces (m, 3) cut at the middles (m, 3) of their sides ab, bc, ca; -1 where there is none."""
    there = middles >= 0
    count = there.sum(axis=1)
    # Turned so that a lonely middle is that of ab, and of two the missing one is that of ca.
    turn = np.where(count == 1, there.argmax(axis=1), (there.argmin(axis=1) + 1) % 3)
    order = (turn[:, None] + np.arange(3)) % 3
    (a, b, c), (ab, bc, ca) = (np.take_along_axis(of, order, axis=1).T for of in (faces, middles))
    patterns: list[list[list[IntArray]]] = [
        [[a, b, c]],
        [[a, ab, c], [ab, b, c]],
        [[ab, b, bc], [a, ab, bc], [a, bc, c]],
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]],
    ]
    pieces = [
        np.stack(piece, axis=1)[count == number]
        for number, pattern in enumerate(patterns)
        for piece in pattern
    ]
    return np.concatenate(pieces)


def tiny_files(folder: Path, count: int) -> list[Path]:
    """So many tiny creatures, each bent in a way of its own."""
    rng = np.random.default_rng(0)
    found = []
    for number in track(range(count), "making tiny meshes", console=PROGRESS):
        individual, bend = divmod(number, BENDS)
        species = SPECIES[individual % len(SPECIES)]
        if bend == 0:
            creature = make_creature(species, seed=individual, vertices=2000).rest
            coarse = simplify(creature, vertices=int(rng.integers(*TINY))).mesh
        waves = rng.normal(size=(3, 3))
        bent = coarse.vertices + 0.05 * np.sin(3.0 * coarse.vertices @ waves)
        path = folder / f"{species}-{individual}-{bend}.ply"
        path.write_bytes(write(TriangleMesh(bent, coarse.faces), "ply"))
        found.append(path)
    return found


def show(rows: Sequence[Measured]) -> None:
    """Print a line for each row."""
    steps = [*STEPS, "other"]
    table = Table(
        *("meshes", "count", "a minute", "CPU s each", *steps),
        *("plain: a minute", "CPU s each", "ratio"),
        title="from upload until all can be found",
    )
    for row in rows:
        plain = ("", "", "")
        if row.plain is not None:
            a_minute, each = 60.0 / row.plain.seconds, row.plain.processor_seconds
            plain = (f"{a_minute:,.1f}", f"{each:.2f}", f"{row.ratio:.1f}")
        table.add_row(
            *(row.name, str(row.meshes), f"{row.a_minute:,.1f}"),
            f"{row.processor_seconds / row.meshes:.2f}",
            *(f"{100.0 * row.shares[step]:.0f} %" if step in row.shares else "" for step in steps),
            *plain,
        )
    Console(width=200).print(table)


def main() -> None:
    """Measure each row, print, and save the figures where ``--out`` says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, help="folder of meshes; without it only tiny ones")
    parser.add_argument("--meshes", type=int, default=200, help="of the folder; 0 for none")
    parser.add_argument("--vertices", type=int, default=FINE, help="of the finer row; 0 for none")
    parser.add_argument("--tiny", type=int, default=2000, help="tiny meshes in a zip; 0 for none")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--sample", type=int, default=20, help="files of the shares and the peers")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    parser.add_argument("--plain-loop", type=Path, nargs="*", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.plain_loop is not None:
        sys.stdout.write(json.dumps(run_plain_loop(options.plain_loop)) + "\n")
        return
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, files, archive in _row_files(options, Path(folder)):
            PROGRESS.print(f"{name}: {len(files)} meshes")
            rows.append(
                ingest(
                    name,
                    files,
                    processes=options.processes,
                    sampled=options.sample,
                    archive=archive,
                )
            )
    show(rows)
    if options.out is not None:
        options.out.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")


def _row_files(options: argparse.Namespace, folder: Path) -> Iterator[tuple[str, list[Path], bool]]:
    """Name and files of each row, and whether they come in a zip."""
    if options.data is not None and options.meshes:
        yield "as they are", real_files(options.data, folder, options.meshes, None), False
        if options.vertices:
            fine = real_files(options.data, folder, options.meshes, options.vertices)
            yield f"{options.vertices:,} vertices", fine, False
    if options.tiny:
        yield "tiny, in a zip", tiny_files(folder, options.tiny), True


if __name__ == "__main__":
    main()
