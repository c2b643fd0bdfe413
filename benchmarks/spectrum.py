"""CPU time of the spectrum beside the peers a user would take instead, in one process.

``python -m benchmarks.spectrum`` measures and saves raw seconds as JSON; scoring reads them and
prints ratios of medians. One BLAS thread, every solver on the same mesh in turn, for each number of
eigenpairs that is asked for. "scipy eigsh" is what pyFM does. "robust_laplacian" is its intrinsic
Delaunay operator with the same eigsh. The peer "eigsh, our factor" differs from ours in the search
alone: operator, factor and certificate are the same, and its shift lies in the middle of what is
wanted; it is left out where it misses an eigenvalue. ``--strategies`` measures our solver's own
settings instead: blocks, shifts, and all eigenpairs by LAPACK.
"""

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import lapy
import numpy as np
import robust_laplacian
from rich.console import Console
from rich.table import Table
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from workers.creatures import make_creature
from workers.geometry.certificate import RESIDUAL, Candidate, is_certified
from workers.geometry.eigensolver import STRATEGIES, Strategy, place_shift, smallest_eigenpairs
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.refinement import refine
from workers.geometry.spectrum import compute_spectrum
from workers.transformations.resampling import decimated

RESULTS = Path(__file__).parent / "results" / "spectrum.json"
SIZES = (1000, 2000, 5000, 10_000, 20_000, 50_000)
STRATEGY_SIZES = (600, 1000, 5000, 20_000)
LARGEST_DENSE = 1000  # LAPACK takes a minute at 5,000
REPEATS = 5
EIGENPAIRS = (100,)
STRATEGY_EIGENPAIRS = 100
OURS = "proteus"
MIDDLE = 0.5  # ARPACK finds what is nearest to the shift, as far on both sides
BEYOND = 10  # eigenpairs more than wanted: the zero mode, and a gap above the k-th to certify in
FEWEST, MOST = 2000, 20_000  # vertices that a creature is made with


class MissedError(Exception):
    """A peer did not find all eigenvalues."""


Solver = Callable[[TriangleMesh, int], Any]


def _proteus(mesh: TriangleMesh, count: int) -> Any:
    return compute_spectrum(mesh, n_eigenpairs=count).eigenvalues


def _lapy(mesh: TriangleMesh, count: int) -> Any:
    surface = lapy.TriaMesh(mesh.vertices, mesh.faces)
    solver = lapy.Solver(surface, lump=True, use_cholmod=False)
    return solver.eigs(k=count + 1)[0][1:] * 1.0


def _scipy(mesh: TriangleMesh, count: int) -> Any:
    """ARPACK with a shift a little below zero, as pyFM does."""
    laplacian = mesh_laplacian(mesh)
    masses = sparse.diags_array(laplacian.areas, format="csc")
    values = eigsh(laplacian.stiffness, count + 1, masses, sigma=-0.01)[0]
    return values[1:]


def _robust(mesh: TriangleMesh, count: int) -> Any:
    """The intrinsic Delaunay Laplacian (Sharp, Crane 2020), solved in the same way."""
    stiffness, masses = robust_laplacian.mesh_laplacian(
        np.array(mesh.vertices), np.array(mesh.faces), mollify_factor=0.0
    )
    return np.sort(eigsh(stiffness.tocsc(), count + 1, masses.tocsc(), sigma=-0.01)[0])[1:]


def _scipy_with_our_factor(mesh: TriangleMesh, count: int) -> Any:
    """ARPACK on our operator, shift and factor, to our residual, certified by our inertia."""
    laplacian = mesh_laplacian(mesh)
    roots = np.sqrt(laplacian.areas / mesh.area)  # (n,)
    scaling = sparse.diags_array(1.0 / roots)
    matrix = sparse.csc_array(scaling @ laplacian.stiffness @ scaling)
    factor = place_shift(matrix, count, MIDDLE)
    if factor is None:
        raise RuntimeError("no sound factor")
    inverse = LinearOperator(matrix.shape, matvec=factor.solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(len(roots))
    values, vectors = eigsh(
        matrix,
        2 * max(factor.n_below, count - factor.n_below) + BEYOND,  # the farther side decides
        sigma=factor.shift,
        OPinv=inverse,
        v0=start,
        tol=RESIDUAL,
    )
    order = np.argsort(values)[1:]  # without the zero mode
    values, vectors = values[order], vectors[:, order]
    errors = np.linalg.norm(matrix @ vectors - values * vectors, axis=0)
    candidate = Candidate(values, values - errors, values + errors, np.arange(len(values)))
    if not is_certified(matrix, roots, candidate, count):
        raise MissedError
    return values[:count] / mesh.area


SOLVERS: Mapping[str, Solver] = {
    OURS: _proteus,
    "eigsh, our factor": _scipy_with_our_factor,
    "lapy": _lapy,
    "scipy eigsh": _scipy,
    "robust_laplacian": _robust,
}


def _by_strategies(strategies: Sequence[Strategy]) -> Solver:
    """Our solver with other settings, alone; all eigenpairs by LAPACK without any."""

    def solve(mesh: TriangleMesh, count: int) -> Any:
        laplacian = mesh_laplacian(mesh)
        return smallest_eigenpairs(
            laplacian.stiffness,
            laplacian.areas,
            count,
            strategies=strategies,
            last_resort=0 if strategies else mesh.n_vertices,
        )[0]

    return solve


VARIANTS: Mapping[str, Solver] = {
    OURS: _by_strategies(STRATEGIES[:1]),
    "block 4": _by_strategies([Strategy(4, 0.6)]),
    "block 16": _by_strategies([Strategy(16, 0.6)]),
    "block 32": _by_strategies([Strategy(32, 0.6)]),
    "shift 0.45": _by_strategies([Strategy(8, 0.45)]),
    "shift 0.7": _by_strategies([Strategy(8, 0.7)]),
    "shift 1.05": _by_strategies([Strategy(8, 1.05)]),
    "shift -0.02": _by_strategies([Strategy(8, -0.02)]),
    "LAPACK": _by_strategies([]),
}


def _creature(vertices: int) -> TriangleMesh:
    """A horse of about so many vertices, few or many."""
    if vertices > MOST:
        coarse = make_creature("horse", seed=1, vertices=vertices // 4).rest
        return refine(coarse, vertices=coarse.n_vertices + 1)
    mesh = make_creature("horse", seed=1, vertices=max(vertices, FEWEST)).rest
    return mesh if vertices >= FEWEST else decimated(mesh, 2 * vertices).mesh


def measure(
    solvers: Mapping[str, Solver], sizes: Sequence[int], counts: Sequence[int], repeats: int
) -> list[dict[str, Any]]:
    """CPU seconds by size, eigenpairs and solver, and how far eigenvalues of each are from ours."""
    raw = []
    for size in sizes:
        mesh = _creature(size)
        taken = {n: s for n, s in solvers.items() if n != "LAPACK" or size <= LARGEST_DENSE}
        for count in counts:
            missed: set[str] = set()
            seconds: dict[str, list[float]] = {name: [] for name in taken}
            values: dict[str, Any] = {}
            for _ in range(repeats):
                for name, solve in taken.items():
                    if name in missed:
                        continue
                    started = time.process_time()
                    try:
                        values[name] = solve(mesh, count)
                    except MissedError:
                        missed.add(name)
                        del seconds[name]
                        continue
                    seconds[name].append(time.process_time() - started)
            errors = {n: float(np.max(np.abs(v / values[OURS] - 1.0))) for n, v in values.items()}
            found = {"seconds": seconds, "relative_difference": errors}
            raw.append({"vertices": mesh.n_vertices, "eigenpairs": count, **found})
    return raw


def score(raw: Sequence[Mapping[str, Any]], console: Console) -> None:
    """Print the others' median CPU time as a multiple of ours."""
    title = (
        "spectrum: CPU time as a multiple of ours (largest relative difference of an eigenvalue)"
    )
    table = Table(title=title)
    peers = list(dict.fromkeys(n for one in raw for n in one["seconds"] if n != OURS))
    for column in ("vertices", "k", f"{OURS}, s", *peers):
        table.add_column(column, justify="right")
    for one in raw:
        ours = np.median(one["seconds"][OURS])
        cells = [
            f"{np.median(one['seconds'][peer]) / ours:.2f} ({one['relative_difference'][peer]:.0e})"
            if peer in one["seconds"]
            else ""
            for peer in peers
        ]
        table.add_row(f"{one['vertices']:,}", str(one["eigenpairs"]), f"{ours:.2f}", *cells)
    console.print(table)


def main() -> None:
    """Measure, save, score."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--strategies", action="store_true", help="our own settings, not peers")
    parser.add_argument("--sizes", type=int, nargs="+", help="of vertices")
    parser.add_argument("--eigenpairs", type=int, nargs="+", default=EIGENPAIRS)
    parser.add_argument("--repeats", type=int, default=REPEATS)
    options = parser.parse_args()
    if options.strategies:
        sizes, counts = options.sizes or STRATEGY_SIZES, (STRATEGY_EIGENPAIRS,)
        raw = measure(VARIANTS, sizes, counts, options.repeats)
    else:
        raw = measure(SOLVERS, options.sizes or SIZES, options.eigenpairs, options.repeats)
    results = RESULTS.with_stem("spectrum-strategies") if options.strategies else RESULTS
    results.parent.mkdir(exist_ok=True)
    results.write_text(json.dumps(raw, indent=1) + "\n")
    score(json.loads(results.read_text()), Console(width=160))


if __name__ == "__main__":
    main()
