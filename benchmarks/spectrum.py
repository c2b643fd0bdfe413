"""CPU time of the spectrum beside the peers a user would take instead, in one process.

Measuring saves raw seconds as JSON; scoring reads them and prints ratios of medians. One BLAS
thread, k = 100, every solver on the same operator and the same mesh in turn.
"""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lapy
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import sparse
from scipy.sparse.linalg import eigsh

from workers.creatures import make_creature
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import compute_spectrum

RESULTS = Path(__file__).parent / "results" / "spectrum.json"
SIZES = (2000, 5000, 20_000)
REPEATS = 5
EIGENPAIRS = 100
OURS = "proteus"


def _proteus(mesh: TriangleMesh) -> Any:
    return compute_spectrum(mesh, n_eigenpairs=EIGENPAIRS).eigenvalues


def _lapy(mesh: TriangleMesh) -> Any:
    surface = lapy.TriaMesh(mesh.vertices, mesh.faces)
    solver = lapy.Solver(surface, lump=True, use_cholmod=False)
    return solver.eigs(k=EIGENPAIRS + 1)[0][1:] * 1.0


def _scipy(mesh: TriangleMesh) -> Any:
    """ARPACK with a shift a little below zero, as pyFM does."""
    laplacian = mesh_laplacian(mesh)
    masses = sparse.diags_array(laplacian.areas, format="csc")
    values = eigsh(laplacian.stiffness, EIGENPAIRS + 1, masses, sigma=-0.01)[0]
    return values[1:]


SOLVERS: dict[str, Callable[[TriangleMesh], Any]] = {
    OURS: _proteus,
    "lapy": _lapy,
    "scipy eigsh": _scipy,
}


def measure() -> dict[str, Any]:
    """CPU seconds by size and solver, and how far the eigenvalues of each are from ours."""
    raw: dict[str, Any] = {"repeats": REPEATS, "eigenpairs": EIGENPAIRS, "sizes": {}}
    for size in SIZES:
        mesh = make_creature("horse", seed=1, vertices=size).rest
        seconds: dict[str, list[float]] = {name: [] for name in SOLVERS}
        values: dict[str, Any] = {}
        for _ in range(REPEATS):
            for name, solve in SOLVERS.items():
                started = time.process_time()
                values[name] = solve(mesh)
                seconds[name].append(time.process_time() - started)
        errors = {n: float(np.max(np.abs(v / values[OURS] - 1.0))) for n, v in values.items()}
        raw["sizes"][mesh.n_vertices] = {"seconds": seconds, "relative_difference": errors}
    return raw


def score(raw: dict[str, Any], console: Console) -> None:
    """Print the peers' median CPU time as a multiple of ours."""
    table = Table(title=f"spectrum, k = {raw['eigenpairs']}: CPU time as a multiple of ours")
    peers = [name for name in SOLVERS if name != OURS]
    for column in ("vertices", *peers, "largest difference of an eigenvalue"):
        table.add_column(column, justify="right")
    for size, found in raw["sizes"].items():
        ours = np.median(found["seconds"][OURS])
        ratios = [f"{np.median(found['seconds'][peer]) / ours:.2f}" for peer in peers]
        largest = max(found["relative_difference"].values())
        table.add_row(f"{int(size):,}", *ratios, f"{largest:.0e}")
    console.print(table)


def main() -> None:
    """Measure, save, score."""
    raw = measure()
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(raw, indent=1) + "\n")
    score(json.loads(RESULTS.read_text()), Console())


if __name__ == "__main__":
    main()
