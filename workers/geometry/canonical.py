"""A frame and an order that rotated, scaled, mirrored and renumbered copies of a mesh agree on.

Principal axes are no such frame: on a symmetric body two of them coincide, or the sign of one
is undecided. Here three vertices turn the frame that no other vertex can be taken for; on a
mesh with symmetries, vertices that only their images can be taken for.
"""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh

GRID = 2.0**-22  # canonical coordinates are rounded to this, far above rounding errors
SEPARATIONS = (1e-5, 1e-8)  # keys nearer than this are equal; unit area, first try and second
FLAT = 1e-9  # a mesh thinner than this is seen from the side its faces show
FAR = 0.5473  # of the farthest: no simple fraction, where the corners of boxes are
MIXING_ROUNDS = 3  # how far a vertex's key looks round it, in edges


@dataclass(frozen=True, eq=False)
class CanonicalFrame:
    """A similarity: canonical = (point - origin) @ axes.T / length.

    Attributes
    ----------
    origin : (3,) float64
        Centroid of the surface.
    axes : (3, 3) float64
        Orthonormal rows, of either hand.
    length : float
        Square root of the area.
    """

    origin: FloatArray
    axes: FloatArray
    length: float

    @property
    def mirrored(self) -> bool:
        """Whether the frame is left-handed."""
        return bool(np.linalg.det(self.axes) < 0)

    def enter(self, points: FloatArray) -> FloatArray:
        """Canonical coordinates (n, 3) of points in the mesh's unit."""
        inside: FloatArray = (points - self.origin) @ self.axes.T / self.length
        return inside

    def leave(self, points: FloatArray) -> FloatArray:
        """Points (n, 3) in the mesh's unit of canonical coordinates."""
        outside: FloatArray = points @ self.axes * self.length + self.origin
        return outside


def canonical_frame(mesh: TriangleMesh) -> CanonicalFrame:
    """Frame of unit area with the surface's centroid as origin, turned by three vertices.

    The first vertex shows where the first axis points, the second, seen from that axis, the
    second; the third on which side the third axis is. Each is chosen by a key that knows its
    place and surroundings and the vertices chosen before, so that a symmetry of the mesh,
    a reflection as well, takes one choice to the other.
    """
    areas = mesh.face_areas  # (m,)
    length = float(np.sqrt(areas.sum()))
    centroids = mesh.vertices[mesh.faces].mean(axis=1)  # (m, 3)
    origin = (areas / areas.sum()) @ centroids  # (3,)
    points = (mesh.vertices - origin) / length  # (n, 3)
    distance = np.linalg.norm(points, axis=1)  # (n,)
    mixing = _Mixing(points, undirected_edges(mesh))
    keys = mixing.of(distance + mixing.mean_lengths)

    one = _chosen(keys, distance)
    first = _unit(points[one])
    keys = mixing.of(keys + np.linalg.norm(points - points[one], axis=1))
    across = points - np.outer(points @ first, first)  # (n, 3)
    two = _chosen(keys, np.linalg.norm(across, axis=1))
    second = _unit(across[two] - (across[two] @ first) * first)
    keys = mixing.of(keys + np.linalg.norm(points - points[two], axis=1))
    third = np.cross(first, second)
    beside = points @ third  # (n,)
    if np.abs(beside).max() < FLAT:
        of_faces = keys[mesh.faces].sum(axis=1)  # (m,): the two sides of a pillow differ
        beside, keys = (of_faces @ mesh.face_normals)[None] @ third, np.zeros(1)
    side = 1.0 if beside[_chosen(keys, np.abs(beside))] >= 0 else -1.0
    return CanonicalFrame(origin, np.stack([first, second, side * third]), length)


def canonical_order(mesh: TriangleMesh, frame: CanonicalFrame) -> IntArray:
    """Vertex indices (n,), sorted by rounded canonical coordinates, ties by the neighbours'."""
    points = rounded(frame.enter(mesh.vertices))  # (n, 3)
    around = np.stack([_summed(points[:, i], undirected_edges(mesh)) for i in range(3)], axis=1)
    return np.lexsort([*around.T[::-1], *points.T[::-1]])


def rounded(points: FloatArray) -> FloatArray:
    """Points on the grid of multiples of 2^-22: sums of them are exact in any order."""
    return np.rint(points / GRID) * GRID


def reordered(mesh: TriangleMesh, order: IntArray, *, mirrored: bool = False) -> TriangleMesh:
    """Mesh whose vertex i is vertex ``order[i]``; faces sorted, smallest vertex first.

    With ``mirrored`` the winding is turned, for coordinates of a left-handed frame.
    """
    new_index = np.empty(mesh.n_vertices, dtype=np.int64)
    new_index[order] = np.arange(mesh.n_vertices)
    faces = new_index[mesh.faces[:, ::-1] if mirrored else mesh.faces]  # (m, 3)
    turns = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    faces = np.take_along_axis(faces, turns, axis=1)
    return TriangleMesh(mesh.vertices[order], faces[np.lexsort(faces.T[::-1])])


class _Mixing:
    """Lets every vertex's key know the keys round it."""

    def __init__(self, points: FloatArray, edges: IntArray) -> None:
        self._edges = edges
        self._lengths = edge_lengths(points, edges)  # (e,)
        ones = np.ones(len(points))
        totals = _summed(ones, edges, self._lengths)
        self._totals = np.where(totals > 0, totals, 1.0)  # unreferenced vertices have no edge
        self.mean_lengths = totals / np.maximum(_summed(ones, edges), 1.0)

    def of(self, keys: FloatArray) -> FloatArray:
        """Keys (n,) plus the mean of the neighbours' squares, weighted by edge length.

        Repeated, this tells apart vertices in mirrored places of a mesh whose edges are not
        mirrored.
        """
        mixed = keys
        for _ in range(MIXING_ROUNDS):
            mixed = keys + 0.5 * _summed(mixed**2, self._edges, self._lengths) / self._totals
            mixed /= np.abs(mixed).max()
        return mixed


def _summed(values: FloatArray, edges: IntArray, weights: FloatArray | None = None) -> FloatArray:
    """Sum (n,) of the neighbours' values, weighted by edge."""
    w = np.ones(len(edges)) if weights is None else weights
    n = len(values)
    of_first = np.bincount(edges[:, 0], w * values[edges[:, 1]], n)
    of_second = np.bincount(edges[:, 1], w * values[edges[:, 0]], n)
    return np.asarray(of_first + of_second, dtype=np.float64)


def _chosen(keys: FloatArray, reach: FloatArray) -> int:
    """Index of a vertex of large reach (n,) whose key is shared with as few others as can be.

    Equal keys belong, but for chance, to images of each other: any of them will do.
    """
    far = np.flatnonzero(reach > FAR * reach.max())
    if len(far) == 0:
        return 0
    order = far[np.argsort(keys[far], kind="stable")]
    for separation in SEPARATIONS:
        starts = np.flatnonzero(np.diff(keys[order], prepend=-np.inf) > separation)
        sizes = np.diff(starts, append=len(order))
        if sizes.min() == 1:
            break
    best = len(sizes) - 1 - int(sizes[::-1].argmin())  # of the smallest groups the last
    return int(order[starts[best]])


def _unit(vector: FloatArray) -> FloatArray:
    """Return the vector with length 1."""
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit
