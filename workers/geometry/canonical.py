"""A coordinate system and a vertex order that copies of a mesh agree on.

Copies may be rotated, scaled, mirrored and renumbered. Principal axes do not serve: on a
symmetric shape two of them coincide, or the sign of one is undecided. Here three vertices fix
the axes, each of which can be told from all others. On a mesh with symmetries, each can be
taken for its images only.
"""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray, first_of_runs, lengths
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh

# Chosen, not measured; the symmetric meshes of tests/geometry/test_canonical.py hold with them.
GRID = 2.0**-22  # canonical coordinates are rounded to this, far above rounding errors
SEPARATIONS = (1e-5, 1e-8)  # keys nearer than this are equal; unit area, first try and second
FLAT = 1e-9  # a mesh thinner than this is seen from the side its faces show
FAR = 0.5473  # share of the farthest: no simple fraction, since corners of boxes lie at those
LARGEST_KEY = 2**63
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


def canonical_frame(mesh: TriangleMesh, edges: IntArray | None = None) -> CanonicalFrame:
    """Coordinates of unit area with the surface's centroid as origin, fixed by three vertices.

    The first vertex shows where the first axis points. The second, seen from that axis, shows the
    second one. The third shows on which side the third axis is. Each is chosen by a key that knows
    its place, its surroundings and the vertices chosen before. So a symmetry of the mesh, also a
    reflection, takes one choice to the other.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    edges : (e, 2) int64, optional
        Its `undirected_edges`, where they are known.

    Returns
    -------
    CanonicalFrame
        The same for copies, up to their symmetries.
    """
    # Place and size: the centroid and the area, which do not depend on how the surface is turned.
    areas = mesh.face_areas  # (m,)
    length = float(np.sqrt(areas.sum()))
    origin = (areas / areas.sum()) @ _centroids(mesh)  # (3,)
    points = (mesh.vertices - origin) / length  # (n, 3)
    distance = lengths(points)  # (n,)
    mixing = _Mixing(points, undirected_edges(mesh) if edges is None else edges)
    # A first key of what every copy has: the distance from the centroid, the edges around.
    keys = mixing.of(distance + mixing.mean_lengths)

    # The first axis points to a far vertex of the rarest key.
    one = _chosen(keys, distance)
    first = _unit(points[one])
    # From now on distances from that vertex are part of the keys: symmetries that move it are gone.
    keys = mixing.of(keys + lengths(points - points[one]))
    # The second axis points to a vertex far from the first axis, as its line across it.
    across = points - np.outer(points @ first, first)  # (n, 3)
    two = _chosen(keys, lengths(across))
    second = _unit(across[two] - (across[two] @ first) * first)
    # Only a reflection in the plane of both axes is left. A third vertex tells its two sides apart.
    keys = mixing.of(keys + lengths(points - points[two]))
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
    return order_by_place(TriangleMesh(rounded(frame.enter(mesh.vertices)), mesh.faces))


def order_by_place(mesh: TriangleMesh, edges: IntArray | None = None) -> IntArray:
    """Order of the vertices of a mesh in rounded canonical coordinates.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices; sums of their coordinates are exact.
    edges : (e, 2) int64, optional
        Its `undirected_edges`, where they are known.

    Returns
    -------
    (n,) int64
        Vertex indices, sorted by coordinates, ties by the sums of the neighbours' coordinates.
    """
    keys = mesh.vertices.T  # (3, n)
    order = np.argsort(keys[0])
    # Few vertices share the first coordinate: only these are compared by more.
    new = first_of_runs(keys[0][order])
    shared = ~(new & np.append(new[1:], True))
    if not shared.any():
        return order
    places = np.flatnonzero(shared)  # of the order, run after run
    unsure = np.sort(order[places])  # (q,)
    # Vertices in the same place, such as those of two sheets, are told apart by their neighbours.
    edges = undirected_edges(mesh) if edges is None else edges
    around = [_summed(key, edges)[unsure] for key in keys]
    order[places] = unsure[np.lexsort([*around[::-1], *keys[::-1, unsure]])]
    return order


def _centroids(mesh: TriangleMesh) -> FloatArray:
    """Middles of the faces, (m, 3)."""
    middles, second, third = (mesh.vertices.take(mesh.faces[:, i], axis=0) for i in range(3))
    middles += second
    middles += third
    middles /= 3.0
    return middles


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
    n = mesh.n_vertices
    new_index = np.empty(n, dtype=np.int64)
    new_index[order] = np.arange(n)
    corners = new_index.take(mesh.faces.T[::-1] if mirrored else mesh.faces.T)  # (3, m)
    # A face may be written from any corner: begin with the smallest, so that sorting decides all.
    smallest = corners.min(axis=0)
    second, third = (
        np.where(
            corners[0] == smallest,
            corners[i],
            np.where(corners[1] == smallest, corners[(i + 1) % 3], corners[(i + 2) % 3]),
        )
        for i in (1, 2)
    )
    if n**3 <= LARGEST_KEY:  # a face as one number
        keys = (smallest * n + second) * n + third
        keys.sort()
        first, rest = np.divmod(keys, n * n)
        faces = np.stack([first, *np.divmod(rest, n)], axis=1)
    else:
        faces = np.stack([smallest, second, third], axis=1)
        faces = faces[np.lexsort(faces.T[::-1])]
    return TriangleMesh(mesh.vertices[order], faces)


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
    start, end = edges.T
    totals = np.zeros(len(values))
    for own, other in ((start, end), (end, start)):
        ofs = values.take(other)
        if weights is not None:
            ofs *= weights
        totals += np.bincount(own, ofs, len(values))
    return totals


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
    keys = keys[far]
    ordered = np.sort(keys)
    gaps = np.diff(ordered, prepend=-np.inf)
    for separation in SEPARATIONS:
        starts = np.flatnonzero(gaps > separation)
        sizes = np.diff(starts, append=len(ordered))
        if sizes.min() == 1:
            break
    best = len(sizes) - 1 - int(sizes[::-1].argmin())  # of the smallest groups the last
    return int(far[np.argmax(keys == ordered[starts[best]])])


def _unit(vector: FloatArray) -> FloatArray:
    """Return the vector with length 1."""
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit
