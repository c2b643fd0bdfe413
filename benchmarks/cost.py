"""The cost of a shape from file to descriptor: seconds of one processor, step by step, and memory.

``python -m benchmarks.cost`` refines creatures until they have the wanted number of vertices, and
reads them as binary PLY. ``--data FOLDER`` takes the meshes of a folder as well, as they are. Each
file is measured in a process of its own, so that its peak of memory is known. Beside it stands what
a user would write instead: trimesh reads the file, and LaPy solves it at full resolution for as
many eigenpairs as our views have. The exponent tells how the cost grows with the vertices.
"""

import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import lapy
import trimesh
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.cost_plot import draw_costs
from workers.creatures import make_creature
from workers.geometry.cleaning import clean
from workers.geometry.components import described_components
from workers.geometry.formats import parse, write
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import Preparation
from workers.geometry.refinement import refine
from workers.geometry.solution import Solution, Solver
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.views import View, named_view
from workers.retrieval.model import describe
from workers.retrieval.windows.rows import ROW_BYTES, write_row
from workers.retrieval.windows.signature import stored_signature, window_surface
from workers.storage.blobs import BlobStore
from workers.storage.shipped_models import shipped_model
from workers.storage.solutions import store_solution

SIZES = (5_000, 10_000, 50_000, 200_000, 1_500_000)
SPECIES = ("human", "cow", "octopus")
LARGEST_FOR_PEERS = 60_000  # vertices: LaPy takes minutes and gigabytes above
EIGENPAIRS = 200
PROGRESS = Console(stderr=True)
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


def describe_file(path: Path) -> dict[str, Any]:
    """Seconds by step from a file to its descriptor, bytes by what is stored, peak of memory."""
    clock, model = Clock(), shipped_model()
    describe({view.name: _small_solution(view.name) for view in model.views}, model)  # warm
    data = path.read_bytes()
    parsed: TriangleMesh = clock.time("read", lambda: parse(data, filename=path.name).mesh)
    cleaned = clock.time("clean", lambda: clean(parsed).mesh)
    preparation, solver = Preparation(cleaned), Solver(cleaned)
    if _has_parts(cleaned):
        solutions = {
            view.name: clock.time("parts", lambda v=view: solver.under(v))  # type: ignore[misc]
            for view in model.views
        }
    else:
        solutions = {}
        for view in model.views:
            mesh = clock.time(
                f"prepare {view.name}",
                lambda v=view: preparation.under(v).mesh,  # type: ignore[misc]
            )
            spectrum = clock.time(
                f"spectrum {view.name}",
                lambda v=view, m=mesh: compute_spectrum(m, n_eigenpairs=v.eigenpairs),  # type: ignore[misc]
            )
            solutions[view.name] = Solution(mesh, spectrum)
    clock.time("describe", lambda: describe(solutions, model))
    if model.windows is not None:
        view = model.windows.view
        prepared = solver.prepared if _has_parts(cleaned) else _alone(preparation)
        clock.time("windows", lambda: _windows(prepared(view), cleaned.n_vertices))
    peak = peak_megabytes()
    stored = {"file": len(data), "descriptor": 4 * model.dimension, "signature": ROW_BYTES}
    with tempfile.TemporaryDirectory() as folder:
        blobs = BlobStore(f"file://{folder}")
        for view in model.views:
            store_solution(blobs, "0" * 64, view, solutions[view.name], cleaned=cleaned)
        stored["solutions"] = sum(p.stat().st_size for p in Path(folder).rglob("*") if p.is_file())
    return {
        "vertices": parsed.n_vertices,
        "seconds": clock.seconds,
        "stored": stored,
        "megabytes": peak,
    }


def _alone(preparation: Preparation) -> Callable[[View], TriangleMesh]:
    """Working meshes of a surface of one component."""
    return lambda view: preparation.under(view).mesh


def _windows(mesh: TriangleMesh, n_vertices: int) -> bytes:
    """Row of the signature of a working mesh."""
    surface = window_surface(mesh, n_vertices=n_vertices, for_query=False)
    return write_row(stored_signature(surface))


def peak_megabytes() -> float:
    """Most memory that this process has had since its program began."""
    status = Path("/proc/self/status")
    if status.exists():  # the other measure counts what the parent had when it started this one
        lines = status.read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def solve_plainly(path: Path, *, eigenpairs: int = EIGENPAIRS) -> dict[str, Any]:
    """Seconds and memory of reading a file with trimesh and solving it with LaPy as it is."""
    clock = Clock()
    mesh: Any = clock.time("read", lambda: trimesh.load(path, process=True, force="mesh"))

    def solve() -> Any:
        surface = lapy.TriaMesh(mesh.vertices, mesh.faces)
        return lapy.Solver(surface, lump=True, use_cholmod=False).eigs(eigenpairs + 1)

    clock.time("spectrum", solve)
    return {
        "vertices": len(mesh.vertices),
        "seconds": clock.seconds,
        "megabytes": peak_megabytes(),
    }


def _small_solution(view: str) -> Solution:
    """A solution that costs little: whatever is imported or made once is there afterwards."""
    ball: Any = trimesh.creation.icosphere(subdivisions=3)
    mesh = TriangleMesh(ball.vertices * [1.0, 0.8, 0.6], ball.faces)
    return Solver(clean(mesh).mesh).under(named_view(view, working_vertices=500))


def _has_parts(mesh: TriangleMesh) -> bool:
    """Whether it is described by several components."""
    return len(described_components(mesh)) > 1


WAYS: dict[str, Callable[[Path], dict[str, Any]]] = {
    "proteus": describe_file,
    "plain": solve_plainly,
}


def in_its_own_process(way: str, path: Path) -> dict[str, Any] | None:
    """Measure a file in a new process; None where that fails."""
    command = [sys.executable, "-m", "benchmarks.cost", "--one", way, str(path)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, env=environment, text=True, check=False)
    if done.returncode:
        return None
    measured: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return measured


def main() -> None:
    """Measure, print, and save what was measured where ``--out`` says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, help="of vertices")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--data", type=Path, help="folder of meshes, measured as they are")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    parser.add_argument("--plot", type=Path, help="folder that gets the picture")
    parser.add_argument("--one", nargs=2, metavar=("WAY", "FILE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        sys.stdout.write(json.dumps(WAYS[options.one[0]](Path(options.one[1]))))
        return
    with tempfile.TemporaryDirectory() as folder:
        files = creature_files(Path(folder), options.sizes)
        if options.data is not None:
            files += [("data", path) for path in sorted(options.data.rglob("*.*"))]
        found = measure(files, options.repeats, peers=not options.no_peers)
    show(found)
    if options.out is not None:
        options.out.write_text(json.dumps(found, indent=1) + "\n")
    if options.plot is not None:
        draw_costs(found, options.plot)


def creature_files(folder: Path, sizes: Sequence[int]) -> list[tuple[str, Path]]:
    """Files of creatures by size, each with the size as its group."""
    files = []
    for size in sizes:
        for species in SPECIES:
            path = folder / f"{species}-{size}.ply"
            path.write_bytes(creature_file(species, size))
            files.append((f"{size:,}", path))
    return files


def measure(
    files: Sequence[tuple[str, Path]], repeats: int, *, peers: bool
) -> list[dict[str, Any]]:
    """What each file costs, in turns with what the plain way costs."""
    found = []
    for group, path in track(files, "measuring", console=PROGRESS):
        for _ in range(repeats):
            own = in_its_own_process("proteus", path)
            if own is None:
                PROGRESS.print(f"{path.name} was not described")
                continue
            plain = None
            if peers and own["vertices"] <= LARGEST_FOR_PEERS:
                plain = in_its_own_process("plain", path)
            found.append({"group": group, "file": path.name, "proteus": own, "plain": plain})
    return found


def show(found: Sequence[dict[str, Any]]) -> None:
    """Print medians by group, the slowest file of each, and the exponent of growth."""
    steps = list(dict.fromkeys(s for one in found for s in one["proteus"]["seconds"]))
    groups = list(dict.fromkeys(one["group"] for one in found))
    table = Table(
        *("vertices", "files", *steps, "together", "slowest", "MB", "exponent", "plain", "ratio"),
        title="seconds of one processor",
    )
    before: tuple[float, float] | None = None
    for group in groups:
        ones = [one for one in found if one["group"] == group]
        totals = [total(one["proteus"]) for one in ones]
        middle = statistics.median(totals)
        vertices = statistics.median(one["proteus"]["vertices"] for one in ones)
        by_step = [
            statistics.median(one["proteus"]["seconds"].get(step, 0.0) for one in ones)
            for step in steps
        ]
        exponent = ""
        if before is not None and group != "data":
            exponent = f"{math.log(middle / before[1]) / math.log(vertices / before[0]):.2f}"
        before = vertices, middle
        plain = [total(one["plain"]) for one in ones if one["plain"]]
        table.add_row(
            *(group, str(len(ones)), *(f"{seconds:.2f}" for seconds in by_step)),
            *(f"{middle:.2f}", f"{max(totals):.2f}"),
            f"{statistics.median(one['proteus']['megabytes'] for one in ones):,.0f}",
            *(exponent, f"{statistics.median(plain):.2f}" if plain else ""),
            f"{statistics.median(plain) / middle:.1f}" if plain else "",
        )
    Console(width=200).print(table)


def total(one: dict[str, Any]) -> float:
    """All seconds of a file."""
    return float(sum(one["seconds"].values()))


if __name__ == "__main__":
    main()
