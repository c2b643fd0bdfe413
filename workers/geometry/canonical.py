"""A coordinate system and a vertex order that copies of a mesh agree on.

Copies may be rotated, scaled, mirrored and renumbered. Principal axes do not serve: on a
symmetric shape two of them coincide, or the sign of one is undecided. Here three vertices fix
the axes, each of which can be told from all others. On a mesh with symmetries, each can be
taken for its images only.
"""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh

# Chosen, not measured; the symmetric meshes of tests/geometry/test_canonical.py hold with them.
GRID = 2.0**-22  # canonical coordinates are rounded to this, far above rounding errors
SEPARATIONS = (1e-5, 1e-8)  # keys nearer than this are equal; unit area, first try and second
FLAT = 1e-9  # a mesh thinner than this is seen from the side its faces show
FAR = 0.5473  # share of the farthest: no simple fraction, since corners of boxes lie at those
MIXING_ROUNDS = 3  # how many edges away a vertex's key looks


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
        """Canonical coordinates of points.

        Parameters
        ----------
        points : (n, 3) float64
            In the mesh's unit.

        Returns
        -------
        (n, 3) float64
            Without unit: the mesh has area 1 in them.
        """
        inside: FloatArray = (points - self.origin) @ self.axes.T / self.length
        return inside

    def leave(self, points: FloatArray) -> FloatArray:
        """Points of canonical coordinates.

        Parameters
        ----------
        points : (n, 3) float64
            Canonical coordinates.

        Returns
        -------
        (n, 3) float64
            In the mesh's unit.
        """
        outside: FloatArray = points @ self.axes * self.length + self.origin
        return outside


def canonical_frame(mesh: TriangleMesh) -> CanonicalFrame:
    """Coordinates of unit area with the surface's centroid as origin, fixed by three vertices.

    The first vertex shows where the first axis points. The second, seen from that axis, shows the
    second one. The third shows on which side the third axis is. Each is chosen by a key that knows
    its place, its surroundings and the vertices chosen before. So a symmetry of the mesh, also a
    reflection, takes one choice to the other.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.

    Returns
    -------
    CanonicalFrame
        The same for copies, up to their symmetries.
    """
    # Place and size: the centroid and the area, which do not depend on how the surface is turned.
    areas = mesh.face_areas  # (m,)
    length = float(np.sqrt(areas.sum()))
    centroids = mesh.vertices[mesh.faces].mean(axis=1)  # (m, 3)
    origin = (areas / areas.sum()) @ centroids  # (3,)
    points = (mesh.vertices - origin) / length  # (n, 3)
    distance = np.linalg.norm(points, axis=1)  # (n,)
    mixing = _Mixing(points, undirected_edges(mesh))
    # A first key of what every copy has: the distance from the centroid, the edges around.
    keys = mixing.of(distance + mixing.mean_lengths)

    # The first axis points to a far vertex of the rarest key.
    one = _chosen(keys, distance)
    first = _unit(points[one])
    # From now on distances from that vertex are part of the keys: symmetries that move it are gone.
    keys = mixing.of(keys + np.linalg.norm(points - points[one], axis=1))
    # The second axis points to a vertex far from the first axis, as its line across it.
    across = points - np.outer(points @ first, first)  # (n, 3)
    two = _chosen(keys, np.linalg.norm(across, axis=1))
    second = _unit(across[two] - (across[two] @ first) * first)
    # Only a reflection in the plane of both axes is left. A third vertex tells its two sides apart.
    keys = mixing.of(keys + np.linalg.norm(points - points[two], axis=1))
    third = np.cross(first, second)
    beside = points @ third  # (n,)
    # A flat mesh has no vertex beside the plane: the side that its faces show decides.
    if np.abs(beside).max() < FLAT:
        of_faces = keys[mesh.faces].sum(axis=1)  # (m,): the two sides of a pillow differ
        beside, keys = (of_faces @ mesh.face_normals)[None] @ third, np.zeros(1)
    side = 1.0 if beside[_chosen(keys, np.abs(beside))] >= 0 else -1.0
    return CanonicalFrame(origin, np.stack([first, second, side * third]), length)


def canonical_order(mesh: TriangleMesh, frame: CanonicalFrame) -> IntArray:
    """Order of the vertices that copies of a mesh agree on.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    frame : CanonicalFrame
        Of this mesh.

    Returns
    -------
    (n,) int64
        Vertex indices, sorted by rounded canonical coordinates, ties by the neighbours'.
    """
    # Rounded, so that the rounding errors of a copy change no comparison.
    points = rounded(frame.enter(mesh.vertices))  # (n, 3)
    # Vertices in the same place, such as those of two sheets, are told apart by their neighbours.
    edges = undirected_edges(mesh)
    around = np.stack([_summed(points[:, i], edges) for i in range(3)], axis=1)
    return np.lexsort([*around.T[::-1], *points.T[::-1]])


def rounded(points: FloatArray) -> FloatArray:
    """Points on the grid of multiples of 2^-22: sums of them are exact in any order.

    Parameters
    ----------
    points : (n, 3) float64
        Canonical coordinates.

    Returns
    -------
    (n, 3) float64
        At most 2^-23 away, in each coordinate.
    """
    return np.rint(points / GRID) * GRID


def reordered(mesh: TriangleMesh, order: IntArray, *, mirrored: bool = False) -> TriangleMesh:
    """Mesh with its vertices in another order, and its faces in an order that follows from it.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    order : (n,) int64
        Vertex i of the result is vertex ``order[i]``.
    mirrored : bool
        Turn the winding, for coordinates of a left-handed frame.

    Returns
    -------
    TriangleMesh
        Each face begins with its smallest vertex; faces are sorted.
    """
    new_index = np.empty(mesh.n_vertices, dtype=np.int64)
    new_index[order] = np.arange(mesh.n_vertices)
    faces = new_index[mesh.faces[:, ::-1] if mirrored else mesh.faces]  # (m, 3)
    # A face may be written from any corner: begin with the smallest, so that sorting decides all.
    turns = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    faces = np.take_along_axis(faces, turns, axis=1)
    return TriangleMesh(mesh.vertices[order], faces[np.lexsort(faces.T[::-1])])


class _Mixing:
    """Adds to every vertex's key what the keys around it are."""

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
        # Squares, since a mean of the keys themselves could be the same on both sides of a mirror.
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

    Vertices of equal keys are, but for chance, images of each other under a symmetry of the mesh:
    any of them will do.
    """
    # Far ones alone: the direction to a near vertex would be lost in rounding.
    far = np.flatnonzero(reach > FAR * reach.max())
    if len(far) == 0:
        return 0
    # Sorted keys fall into groups of equal ones. With a finer separation more keys differ, but
    # rounding may make some of them differ: it is used only where no vertex is alone.
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
