"""Carrying a field from one mesh of a surface to another."""

from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from workers.geometry.box_tree import box_trees
from workers.geometry.mesh import TriangleMesh

_CHUNK = 20_000  # positions at a time
_ROUNDING = 64 * np.finfo(np.float64).eps  # of the largest coordinate: slack of a distance


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points on a mesh; arrays are read-only.

    Attributes
    ----------
    corners : (p, 3) int64
        Vertices of the face that each point lies on.
    weights : (p, 3) float64
        Barycentric coordinates in it, not negative, rows of sum 1.
    squared_distances : (p,) float64
        To what the point was looked for, in the square of the mesh's unit.
    faces : (p,) int64
        Numbers of those faces.
    """

    corners: IntArray
    weights: FloatArray
    squared_distances: FloatArray
    faces: IntArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "corners", read_only(self.corners, np.int64))
        object.__setattr__(self, "faces", read_only(self.faces, np.int64))
        object.__setattr__(self, "weights", read_only(self.weights, np.float64))
        squared = read_only(self.squared_distances, np.float64)
        object.__setattr__(self, "squared_distances", squared)

    def interpolate(self, values: FloatArray) -> FloatArray:
        """Values of a field at the points, by their barycentric coordinates.

        Parameters
        ----------
        values : (n, ...) float64
            The field at the mesh's vertices.

        Returns
        -------
        (p, ...) float64
            The field at the points; within the range of the values.
        """
        interpolated: FloatArray = np.einsum("pc,pc...->p...", self.weights, values[self.corners])
        return interpolated


def closest_points(mesh: TriangleMesh, positions: FloatArray) -> SurfacePoints:
    """Find the points of a surface closest to some positions, exactly.

    No face is left out that could be closer (decision 19). So the result is that of a comparison
    with every face: the smallest squared distance, and among equal ones the first face. The order
    and the number of the positions do not matter.

    Parameters
    ----------
    mesh : TriangleMesh
        With at least one face, and finite coordinates. Vertices without a face do not count.
    positions : (p, 3) float64
        Anywhere, in the mesh's unit.

    Returns
    -------
    SurfacePoints
        One point for each position.
    """
    corners = mesh.vertices[mesh.faces]  # (m, 3, 3)
    # A power of two keeps every digit, and fourth powers of lengths within the range of a float.
    exponent = -int(np.frexp(max(np.abs(corners).max(), np.abs(positions).max(initial=0.0)))[1])
    search = _ClosestFaces(np.ldexp(corners, exponent))
    scaled = np.ldexp(positions, exponent)  # (p, 3)
    found = [
        search.nearest(scaled[begin : begin + _CHUNK])
        for begin in range(0, max(len(positions), 1), _CHUNK)
    ]
    face, weights, squared = (np.concatenate(part) for part in zip(*found, strict=True))
    return SurfacePoints(mesh.faces[face], weights, np.ldexp(squared, -2 * exponent), face)


def transfer_to_vertices(
    source: TriangleMesh, values: FloatArray, target: TriangleMesh
) -> FloatArray:
    """Interpolate a field at the points of the source surface closest to the target's vertices.

    The field is linear on each face.

    Parameters
    ----------
    source : TriangleMesh
        Of n vertices.
    values : (n,) float64
        A value at each source vertex.
    target : TriangleMesh
        Another mesh of (nearly) the same surface, in the same position.

    Returns
    -------
    (n_target,) float64
        Within the range of the source's values.

    Raises
    ------
    InvalidRequestError
        The field is not that of the source mesh.
    """
    if values.shape != (source.n_vertices,):
        raise InvalidRequestError(
            f"the field has shape {values.shape}, expected one value for each of "
            f"{source.n_vertices} vertices"
        )
    return closest_points(source, target.vertices).interpolate(values)


def closest_barycentric(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Barycentric coordinates (p, 3) of the point of each triangle closest to each point.

    Parameters
    ----------
    points : (p, 3) float64
        One for each triangle.
    corners : (p, 3, 3) float64
        Corner after corner; a triangle may be a segment or a point.

    Returns
    -------
    (p, 3) float64
        Not negative, rows sum to 1.
    """
    inside, has_plane = _plane_barycentric(points, corners)  # (p, 3), of the foot in the plane
    is_inside = has_plane & np.all(inside >= 0.0, axis=1)
    best = np.where(is_inside, 0.0, np.inf)  # (p,) squared distance from the foot
    foot = np.where(has_plane[:, None], _at(inside, corners), points)
    weights = inside.copy()
    for i, j in ((0, 1), (1, 2), (2, 0)):
        edge = corners[:, j] - corners[:, i]
        along = _dot(foot - corners[:, i], edge)
        squared_length = _dot(edge, edge)
        has_length = squared_length > 0.0
        along = np.divide(along, squared_length, out=np.zeros_like(along), where=has_length)
        along = np.clip(along, 0.0, 1.0)
        gap = corners[:, i] + along[:, None] * edge - foot
        squared = _dot(gap, gap)
        nearer = squared < best
        best = np.where(nearer, squared, best)
        weights[nearer] = 0.0
        weights[nearer, i] = 1.0 - along[nearer]
        weights[nearer, j] = along[nearer]
    return weights


def _plane_barycentric(points: FloatArray, corners: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Coordinates (p, 3) of the points' feet in the triangles' planes, and who has a plane (p,)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)  # (p, 3)
    squared = _dot(normal, normal)
    has_plane = squared > 0.0
    divisor = np.where(has_plane, squared, 1.0)
    offset = points - a
    second = _dot(np.cross(offset, c - a), normal) / divisor
    third = _dot(np.cross(b - a, offset), normal) / divisor
    return np.stack([1.0 - second - third, second, third], axis=1), has_plane


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Scalar products (p,) of vectors (p, 3).

    The products are added in a fixed order, for a library may add them in one that depends on the
    processor.
    """
    x, y, z = (first[:, i] * second[:, i] for i in range(3))
    products: FloatArray = x + z + y
    return products


def _at(weights: FloatArray, corners: FloatArray) -> FloatArray:
    """Points (p, 3) with these barycentric coordinates (p, 3) in triangles (p, 3, 3)."""
    a, b, c = (weights[:, i, None] * corners[:, i] for i in range(3))
    points: FloatArray = a + b + c
    return points


@dataclass(frozen=True, eq=False)
class _Slabs:
    """A short cylinder around each triangle, flatter than its box: axis, ends, centre, radius."""

    axes: FloatArray  # (m, 3), of length 1, or 0 for a triangle without a plane
    ends: FloatArray  # (m, 2), along the axis from the centre
    centres: FloatArray  # (m, 3)
    radii: FloatArray  # (m,)

    @classmethod
    def of(cls, corners: FloatArray) -> "_Slabs":
        """Cylinders around triangles (m, 3, 3), along their normals."""
        sides = np.roll(corners, -1, axis=1) - corners  # (m, 3, 3)
        normals = np.cross(sides[:, 0], sides[:, 1])  # (m, 3)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        axes = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
        centres = corners.mean(axis=1)
        offsets = corners - centres[:, None]  # (m, 3, 3)
        heights = np.stack([_dot(offsets[:, i], axes) for i in range(3)], axis=1)  # (m, 3)
        radii = np.sqrt((offsets**2).sum(axis=2).max(axis=1))
        ends = np.stack([heights.min(axis=1), heights.max(axis=1)], axis=1)
        return cls(axes, ends, centres, radii)

    def distances(self, points: FloatArray, triangles: IntArray) -> FloatArray:
        """Distance (q,) of each point (q, 3) to the cylinder of its triangle, or less."""
        offsets = points - self.centres[triangles]
        heights = _dot(offsets, self.axes[triangles])
        ends = self.ends[triangles]
        along = np.maximum(np.maximum(ends[:, 0] - heights, heights - ends[:, 1]), 0.0)
        whole = _dot(offsets, offsets)
        across = np.sqrt(np.maximum(whole * (1.0 - _ROUNDING) - heights**2, 0.0))
        across = np.maximum(across - self.radii[triangles], 0.0)
        distances: FloatArray = np.sqrt(along**2 + across**2)
        return distances


class _ClosestFaces:
    """Finds the closest face of one mesh."""

    def __init__(self, corners: FloatArray) -> None:
        self._corners = corners  # (m, 3, 3)
        self._trees = box_trees(corners)
        self._slack = _ROUNDING * float(np.abs(corners).max())
        self._slabs = _Slabs.of(corners)

    def nearest(self, points: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Face (c,), weights (c, 3) and squared distance (c,) for positions (c, 3)."""
        face = np.zeros(len(points), dtype=np.int64)
        weights = np.zeros((len(points), 3))
        squared = np.full(len(points), np.inf)
        everyone = np.arange(len(points))
        # A bound first: one face of each size that is probably near.
        for tree in self._trees:
            self._improve(points, (everyone, tree.nearest_centres(points)), face, weights, squared)
        # Then every face whose box the bound reaches, the largest first: they make it tight.
        for tree in self._trees:
            radii = np.sqrt(squared) + self._slack + _ROUNDING * np.abs(points).max(axis=1)
            for owner, candidate in tree.within(points, radii**2):
                nearer = self._slabs.distances(points[owner], candidate) <= radii[owner]
                pairs = owner[nearer], candidate[nearer]
                self._improve(points, pairs, face, weights, squared)
        return face, weights, squared

    def _improve(
        self,
        points: FloatArray,
        pairs: tuple[IntArray, IntArray],
        face: IntArray,
        weights: FloatArray,
        squared: FloatArray,
    ) -> None:
        """Replace what is known of the points where one of the faces (q,) is closer."""
        owner, candidate = pairs
        corners = self._corners[candidate]  # (q, 3, 3)
        found = closest_barycentric(points[owner], corners)  # (q, 3)
        gaps = _at(found, corners) - points[owner]
        distances = _dot(gaps, gaps)  # (q,)
        order = np.lexsort((candidate, distances, owner))
        first = np.ones(len(order), dtype=np.bool_)
        first[1:] = np.diff(owner[order]) != 0
        best = order[first]  # one a point
        old = owner[best]
        better = (distances[best] < squared[old]) | (
            (distances[best] == squared[old]) & (candidate[best] < face[old])
        )
        best, old = best[better], old[better]
        face[old], weights[old], squared[old] = candidate[best], found[best], distances[best]
