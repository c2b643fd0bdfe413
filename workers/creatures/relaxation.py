"""Better triangles for a level set: vertices slide along the surface towards their neighbours."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import symmetric_graph, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.normals import vertex_normals

Field = Callable[[FloatArray], FloatArray]

# Chosen, not measured.
_ROUNDS = 2
_STEPS = 6  # of sliding a round


def relax(points: FloatArray, faces: IntArray, field: Field, spacing: float) -> FloatArray:
    """Vertices slid to the mean of their neighbours and put back onto the surface.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices of the surface.
    faces : (m, 3) int64
        Of a closed surface, wound outwards.
    field : function (n, 3) → (n,)
        About the distance from the surface, negative inside.
    spacing : float
        Grid spacing, the length of an edge; no vertex goes back by more than half of it.

    Returns
    -------
    (n, 3) float64
    """
    average = neighbour_average(TriangleMesh(points, faces))
    for _ in range(_ROUNDS):
        for _ in range(_STEPS):
            shift = average @ points - points
            normals = vertex_normals(TriangleMesh(points, faces))
            shift -= (shift * normals).sum(axis=1, keepdims=True) * normals
            points = points + 0.6 * shift
        points = _projected(points, field, spacing)
    return points


def neighbour_average(mesh: TriangleMesh) -> sparse.csr_array:
    """Matrix whose rows average over a vertex's neighbours.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices; closed, so that each edge counts once.

    Returns
    -------
    (n, n) sparse float64, rows of sum 1
    """
    edges = undirected_edges(mesh)
    averages = symmetric_graph(edges, np.ones(len(edges)), mesh.n_vertices)
    averages.data = averages.data / np.repeat(averages.sum(axis=1), np.diff(averages.indptr))
    return averages


def _projected(points: FloatArray, field: Field, spacing: float) -> FloatArray:
    """One Newton step towards the level 0, at most half a spacing long."""
    step = 1e-3 * spacing
    value = field(points)
    slopes = [
        (field(points + step * axis) - field(points - step * axis)) / (2 * step)
        for axis in np.eye(3)
    ]
    gradient = np.stack(slopes, axis=1)  # (n, 3)
    steepness = np.maximum((gradient**2).sum(axis=1), 0.05)
    move = -(value / steepness)[:, None] * gradient
    length = np.linalg.norm(move, axis=1, keepdims=True)
    moved: FloatArray = points + move * np.minimum(1.0, 0.5 * spacing / np.maximum(length, 1e-300))
    return moved
