"""Very fine meshes come down to what a grid of cells tells apart, cheaply and in any order.

Vertices of a cell become one where edges within the cell connect them (Rossignac, Borrel 1993,
without gluing sheets that only come near each other). It costs a few passes over the arrays, where
collapsing edge by edge takes 300 bytes and some microseconds for each face.
"""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import IntArray
from workers.geometry.canonical import GRID, rounded
from workers.geometry.edges import component_labels
from workers.geometry.mesh import TriangleMesh
from workers.geometry.strays import without_unreferenced

CELL_STEPS = 10_240  # of the grid of canonical coordinates: 1/410 of a side of the area as a square
MOST_CELLS = 2**20  # along an axis, on either side of the origin


@dataclass(frozen=True, eq=False)
class Clusters:
    """A mesh of clusters of vertices.

    Attributes
    ----------
    mesh : TriangleMesh
        In the coordinates of the original; it may have no face.
    lost_area : float
        Share of the original's area at clusters that have no face left.
    """

    mesh: TriangleMesh
    lost_area: float


def clustered(mesh: TriangleMesh, edges: IntArray, *, steps: int = CELL_STEPS) -> Clusters | None:
    """Mesh with one vertex for each connected part of a mesh in each cell, in their middle.

    Nothing depends on the order of the vertices and faces, but the order of the result. Faces
    within two cells are gone. Faces that came to lie on each other cancel out or become one.

    Parameters
    ----------
    mesh : TriangleMesh
        In rounded canonical coordinates: sums of them are exact.
    edges : (e, 2) int64
        Its `undirected_edges`.
    steps : int
        Side of a cell, in steps of the grid of coordinates.

    Returns
    -------
    Clusters or None
        Of some 250,000 vertices if the mesh is one plain surface; None where it is too long for
        the grid.
    """
    cells = _cells(mesh, steps)
    if cells is None:
        return None
    start, end = edges.T
    within = cells.take(start) == cells.take(end)
    labels = component_labels(np.stack([start[within], end[within]]).T, mesh.n_vertices)  # (n,)
    counts = np.bincount(labels)  # (c,)
    middles = np.empty((len(counts), 3))
    for axis in range(3):
        middles[:, axis] = np.bincount(labels, mesh.vertices[:, axis]) / counts
    faces = _distinct(labels, mesh.faces)
    has_face = np.zeros(len(counts), dtype=np.bool_)
    has_face[faces] = True
    lost = ~has_face.take(labels.take(mesh.faces[:, 0]))  # (m,)
    areas = mesh.face_areas
    coarse = TriangleMesh(*without_unreferenced(rounded(middles), faces))
    return Clusters(coarse, float(areas[lost].sum() / areas.sum()))


def _cells(mesh: TriangleMesh, side: int) -> IntArray | None:
    """Number of the cell of each vertex (n,), or None where there are too many cells."""
    numbers = np.zeros(mesh.n_vertices, dtype=np.int64)
    for axis in range(3):
        steps = np.rint(mesh.vertices[:, axis] / GRID).astype(np.int64)
        steps //= side
        if max(int(steps.max()), -int(steps.min())) >= MOST_CELLS:
            return None
        steps += MOST_CELLS
        numbers *= 2 * MOST_CELLS
        numbers += steps
    return numbers


def _distinct(labels: IntArray, faces: IntArray) -> IntArray:
    """Faces (f, 3) between three clusters; of those with the same three one, or none.

    Two that face each other are a fold without thickness: both go. So whatever the order, what is
    left is one face of the side that most of them show.
    """
    a, b, c = (labels.take(faces[:, i]) for i in range(3))
    kept = (a != b) & (b != c) & (c != a)
    a, b, c = a[kept], b[kept], c[kept]
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    middle = a + b + c - low - high
    # Even: the corners ascend as the face goes round.
    even = np.where(a == low, b < c, np.where(b == low, c < a, a < b))
    order = np.lexsort([high, middle, low])
    low, middle, high, even = low[order], middle[order], high[order], even[order]
    new = np.ones(len(order), dtype=np.bool_)
    new[1:] = (low[1:] != low[:-1]) | (middle[1:] != middle[:-1]) | (high[1:] != high[:-1])
    first = np.flatnonzero(new)
    if len(first) == 0:
        return np.zeros((0, 3), dtype=np.int64)
    sides = np.add.reduceat(np.where(even, 1, -1), first)
    first, sides = first[sides != 0], sides[sides != 0]
    low, middle, high = low[first], middle[first], high[first]
    ahead = sides > 0
    return np.stack([low, np.where(ahead, middle, high), np.where(ahead, high, middle)], axis=1)
