"""Whether a coarser mesh has the first eigenvalues of the mesh it came from, at little cost.

The first eigenfunctions of the coarser mesh are carried to the mesh and smoothed a little. By the
principle of Rayleigh and Ritz no eigenvalue of the mesh is above what they give there. If that is
near the coarser mesh's own eigenvalues, no connection was cut or narrowed. Nothing is solved on the
mesh itself, which may be ten times as fine (decision 0032).
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy import sparse

from workers.errors import SpectrumError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import compute_spectrum, first_eigenvalues
from workers.geometry.topology import vertex_components

CHECKED_EIGENVALUES = 10
LARGEST_ERROR = 0.1  # relative; sound levels were within 0.04, broken ones at 5

# Chosen, not measured, but for the sweeps: after eight the first ten are 2 % too large where a
# vertex stands for four, 1 % where it stands for two.
LARGEST_SOLVED = 20_000  # vertices of a mesh whose eigenvalues are computed where the test doubts
DAMPING = 0.6
SWEEPS = 4  # between two looks
MOST_LOOKS = 12


@dataclass(frozen=True)
class Likeness:
    """How far the first eigenvalues of a coarser mesh are from those of the mesh it came from.

    Attributes
    ----------
    error : float
        The largest relative one; infinite where nothing is known.
    fault : str
        What is wrong, in a sentence; empty where nothing is.
    """

    error: float
    fault: str


def compare_eigenvalues(mesh: TriangleMesh, coarse: TriangleMesh, to: IntArray) -> Likeness:
    """Compare the first eigenvalues for unit area of a coarser mesh with those of a mesh.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices, clean.
    coarse : TriangleMesh
        Made of it, with as many components.
    to : (n,) int64
        The vertex of the coarser mesh that each vertex became part of, or -1.

    Returns
    -------
    Likeness
        Of bounds, or of the eigenvalues themselves where the bounds doubt and the mesh is small.
    """
    try:
        spectrum = compute_spectrum(coarse, n_eigenpairs=CHECKED_EIGENVALUES)
    except SpectrumError:
        return Likeness(np.inf, "the first eigenvalues cannot be certified")
    own = spectrum.eigenvalues * coarse.area  # (k,)
    errors = np.abs(_upper_bounds(mesh, coarse, to, spectrum.eigenvectors, own) / own - 1.0)
    if errors.max(initial=0.0) > LARGEST_ERROR and mesh.n_vertices <= LARGEST_SOLVED:
        try:  # a bound may be too high: the truth decides
            truth = first_eigenvalues(mesh, len(own)) * mesh.area
        except SpectrumError:  # of what cannot be solved the coarser mesh may well be sound
            return Likeness(0.0, "")
        errors = np.abs(own / truth - 1.0)
    if not np.isfinite(errors).all():
        return Likeness(np.inf, "the first eigenfunctions cannot be carried over")
    largest = float(errors.max(initial=0.0))
    if largest <= LARGEST_ERROR:
        return Likeness(largest, "")
    return Likeness(largest, f"eigenvalue {int(errors.argmax()) + 1} is {largest:.0%} off")


def _upper_bounds(
    mesh: TriangleMesh,
    coarse: TriangleMesh,
    to: IntArray,
    eigenvectors: FloatArray,
    own: FloatArray,
) -> FloatArray:
    """Bounds (k,) from above on the mesh's first eigenvalues for unit area.

    They fall with every sweep of damped Jacobi steps, which take the jumps between vertices off
    that became different ones. Sweeps end where the bounds are near ``own`` (k,) or hardly fall.
    """
    laplacian = mesh_laplacian(mesh)
    stiffness, areas = sparse.csr_array(laplacian.stiffness), laplacian.areas
    # Rows of cotangents may have both signs. With half the sum of their sizes no step overshoots.
    sizes = np.maximum(stiffness.diagonal(), 0.5 * abs(stiffness).sum(axis=1))
    steps = DAMPING / np.where(sizes > 0.0, sizes, 1.0)  # (n,)
    labels = vertex_components(coarse)
    zero_modes = labels[:, None] == np.arange(labels.max() + 1)  # (p, c)
    functions = np.concatenate([zero_modes, eigenvectors], axis=1)  # (p, c + k)
    spread = np.where((to >= 0)[:, None], functions[to], 0.0)  # (n, c + k)
    bounds = np.full(len(own), np.inf)
    for _ in range(MOST_LOOKS):
        before = bounds
        for _ in range(SWEEPS):
            spread = spread - steps[:, None] * (stiffness @ spread)
        energy = spread.T @ (stiffness @ spread)
        masses = spread.T @ (areas[:, None] * spread)
        try:
            values = scipy.linalg.eigh(energy, masses, eigvals_only=True)
        except np.linalg.LinAlgError:  # they no longer differ: nothing is known of the mesh
            return np.full(len(own), np.inf)
        bounds = values[zero_modes.shape[1] :] * areas.sum()
        is_near = (np.abs(bounds / own - 1.0) <= 0.5 * LARGEST_ERROR).all()
        if is_near or (bounds > 0.99 * before).all():
            break
    return bounds
