"""How true the figures are that everything rests on: against closed forms and other programs.

``python -m benchmarks.truth [--meshes FOLDER]`` prints the largest relative error of each. FOLDER
holds real meshes: the reference poses and the objects below it are taken.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import lapy
import numpy as np
import robust_laplacian
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.sparse.linalg import eigsh
from scipy.stats import wasserstein_distance

from tests.meshes import (
    flat_torus_corners,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
)
from workers.geometry.arrays import FloatArray
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.laplacian import cotangent_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.geometry.spectrum import compute_spectrum, laplacian_spectrum
from workers.retrieval.builtin import built_in_models
from workers.retrieval.dissimilarity import DISSIMILARITIES
from workers.retrieval.model import Model, describe

LARGEST_MESH = 20_000  # vertices; the peers take minutes on more


def largest_error(found: FloatArray, exact: FloatArray) -> float:
    """Largest relative error."""
    return float(np.max(np.abs(found / exact - 1.0)))


def closed_forms() -> Iterator[tuple[str, str, float]]:
    """Sphere, rectangle and flat torus: the error of the discretisation alone."""
    sphere = np.repeat([degree * (degree + 1.0) for degree in range(1, 6)], [3, 5, 7, 9, 11])
    values = compute_spectrum(icosphere(5), n_eigenpairs=35).eigenvalues
    yield "sphere, 10,242 vertices", "l(l + 1), first 35", largest_error(values, sphere)
    squares = sorted((p / 2.0) ** 2 + q**2 for p in range(9) for q in range(9))[1:21]
    values = compute_spectrum(rectangle(100, 50, 2.0, 1.0), n_eigenpairs=20).eigenvalues
    error = largest_error(values, np.pi**2 * np.array(squares))
    yield "rectangle, 5,151 vertices", "π²(p²/a² + q²/b²), first 20", error
    torus = cotangent_laplacian(*flat_torus_corners(80, 80))
    values = laplacian_spectrum(torus, n_eigenpairs=20).eigenvalues
    lattice = sorted(p**2 + q**2 for p in range(-5, 6) for q in range(-5, 6))[1:21]
    error = largest_error(values, 4.0 * np.pi**2 * np.array(lattice))
    yield "flat torus, 6,400 vertices", "4π²(p² + q²), first 20", error


def real_meshes(folder: Path) -> list[tuple[str, TriangleMesh]]:
    """Cleaned meshes of at most so many vertices, of area 1."""
    paths = [*sorted(folder.glob("poses/*/*-reference.ply")), *sorted(folder.glob("objects/*"))]
    found = []
    for path in paths:
        mesh = clean(parse(path.read_bytes(), filename=path.name).mesh).mesh
        if mesh.n_vertices <= LARGEST_MESH:
            found.append((path.stem, scaled(mesh, 1.0 / np.sqrt(mesh.area))))
    return found


def peer_errors(mesh: TriangleMesh) -> dict[str, float]:
    """Largest relative difference of the first 50 eigenvalues from lapy and robust_laplacian."""
    ours = compute_spectrum(mesh, n_eigenpairs=50).eigenvalues
    solver = lapy.Solver(lapy.TriaMesh(mesh.vertices, mesh.faces), lump=True, use_cholmod=False)
    other = np.sort(solver.eigs(k=60)[0])
    zeros = int(np.count_nonzero(other < 1e-6))  # one a component
    stiffness, masses = robust_laplacian.mesh_laplacian(
        mesh.vertices, mesh.faces, mollify_factor=0.0
    )
    robust = np.sort(eigsh(stiffness.tocsc(), k=60, M=masses.tocsc(), sigma=-0.01)[0])
    count = min(50, 60 - zeros)
    return {
        "lapy": largest_error(other[zeros : zeros + count], ours[:count]),
        "robust_laplacian": largest_error(robust[zeros : zeros + count], ours[:count]),
    }


def copy_errors(mesh: TriangleMesh, models: tuple[Model, ...]) -> dict[str, float]:
    """Relative difference (L1) of the descriptors of a scaled, rotated and renumbered copy."""
    rng = np.random.default_rng(1)
    copy, _ = renumbered(scaled(rotated(mesh, rng), 37.0), rng)
    ours, theirs = (_descriptors(one, models) for one in (mesh, copy))
    return {
        name: float(np.abs(ours[name] - theirs[name]).sum() / np.abs(ours[name]).sum())
        for name in ours
    }


def _descriptors(mesh: TriangleMesh, models: tuple[Model, ...]) -> dict[str, FloatArray]:
    (view,) = models[0].views
    solutions = {view.name: solve(clean(mesh).mesh, view)}
    return {model.name: describe(solutions, model).astype(np.float64) for model in models}


def earth_movers_error() -> float:
    """Largest relative difference from scipy's Wasserstein distance, over random histograms."""
    rng = np.random.default_rng(2)
    edges = np.cumsum(rng.uniform(0.1, 1.0, 101))
    widths, centres = np.diff(edges), (edges[1:] + edges[:-1]) / 2
    histograms = rng.dirichlet(np.ones(100), size=50)
    ours = DISSIMILARITIES["earth-movers"](histograms[0], histograms, widths)[1:]
    exact = [wasserstein_distance(centres, centres, histograms[0], h) for h in histograms[1:]]
    return largest_error(ours, np.array(exact))


def main() -> None:
    """Print all of it."""
    parser = argparse.ArgumentParser(description="truth of spectra, distances and descriptors")
    parser.add_argument("--meshes", type=Path, help="folder of real meshes")
    options = parser.parse_args()
    table = Table(title="largest relative difference")
    for column in ("what", "from"):
        table.add_column(column, overflow="fold")
    for column in ("median", "largest"):
        table.add_column(column, no_wrap=True, min_width=len("1.0e-10"))
    for what, source, error in closed_forms():
        table.add_row(what, source, "", f"{error:.1e}")
    table.add_row("earth mover's, 49 pairs", "scipy", "", f"{earth_movers_error():.1e}")
    if options.meshes is not None:
        meshes, models = real_meshes(options.meshes), built_in_models()
        peers, copies = [], []
        for _, mesh in track(meshes, "real meshes", console=Console(stderr=True)):
            peers.append(peer_errors(mesh))
            copies.append(copy_errors(mesh, models))
        for rows, what in ((peers, "first 50 eigenvalues"), (copies, "descriptor of a copy")):
            for name in rows[0]:
                errors = [row[name] for row in rows]
                cells = f"{np.median(errors):.1e}", f"{max(errors):.1e}"
                table.add_row(f"{what}, {len(meshes)} meshes", name, *cells)
    Console().print(table)


if __name__ == "__main__":
    main()
