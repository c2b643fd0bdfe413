"""Carrying a field from one mesh of a surface to another."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.mesh import TriangleMesh

_NEIGHBOURS = 4  # nearest vertices, and nearest face centres, whose faces are candidates
_CHUNK = 20_000  # positions at a time


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
    """

    corners: IntArray
    weights: FloatArray
    squared_distances: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "corners", read_only(self.corners, np.int64))
        object.__setattr__(self, "weights", read_only(self.weights, np.float64))
        squared = read_only(self.squared_distances, np.float64)
        object.__setattr__(self, "squared_distances", squared)

    def interpolate(self, values: FloatArray) -> FloatArray:
        """Values (p, ...) of a field that is given at the mesh's vertices, (n, ...)."""
        interpolated: FloatArray = np.einsum("pc,pc...->p...", self.weights, values[self.corners])
        return interpolated


def closest_points(mesh: TriangleMesh, positions: FloatArray) -> SurfacePoints:
    """Points of a surface closest to some positions.

    They are looked for on the faces around the nearest vertices and on the faces with the nearest
    centres.

    Parameters
    ----------
    mesh : TriangleMesh
        Each of its n vertices belongs to a face.
    positions : (p, 3) float64
        Near the surface.

    Returns
    -------
    SurfacePoints
    """
    corners = mesh.vertices[mesh.faces]  # (m, 3, 3)
    vertices = cKDTree(mesh.vertices)
    centres = cKDTree(corners.mean(axis=1))
    starts, incident = _incident_faces(mesh)
    found = []
    for begin in range(0, max(len(positions), 1), _CHUNK):
        points = positions[begin : begin + _CHUNK]  # (c, 3)
        near = _nearest(vertices, points)  # (c, 4)
        faces = _nearest(centres, points)  # (c, 4)
        owner, face = _candidates(near, starts, incident)
        owner = np.concatenate([owner, np.repeat(np.arange(len(points)), faces.shape[1])])
        face = np.concatenate([face, faces.ravel()])  # (q,) candidate pairs
        weights = closest_barycentric(points[owner], corners[face])  # (q, 3)
        closest = np.einsum("qc,qcd->qd", weights, corners[face])
        squared = np.einsum("qd,qd->q", closest - points[owner], closest - points[owner])
        order = np.lexsort((face, squared, owner))
        first = np.searchsorted(owner[order], np.arange(len(points)))
        best = order[first]  # (c,)
        found.append((mesh.faces[face[best]], weights[best], squared[best]))
    return SurfacePoints(*(np.concatenate(part) for part in zip(*found, strict=True)))


def transfer_to_vertices(
    source: TriangleMesh, values: FloatArray, target: TriangleMesh
) -> FloatArray:
    """Interpolate a field at the points of the source surface closest to the target's vertices.

    The field is linear on each face. Values lie within the range of the source's.

    Parameters
    ----------
    source : TriangleMesh
        Of n vertices, each of which belongs to a face.
    values : (n,) float64
        A value at each source vertex.
    target : TriangleMesh
        Another mesh of (nearly) the same surface, in the same position.

    Returns
    -------
    (n_target,) float64
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
    corners : (p, 3, 3) float64
        Of triangles with area.

    Returns
    -------
    (p, 3) float64, not negative, rows sum to 1.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    inside = _plane_barycentric(points, a, b, c)  # (p, 3), of the foot in the plane
    best = np.where(np.all(inside >= 0.0, axis=1), 0.0, np.inf)  # (p,) squared distance in plane
    foot = np.einsum("pc,pcd->pd", inside, corners)
    weights = inside.copy()
    for i, j in ((0, 1), (1, 2), (2, 0)):
        edge = corners[:, j] - corners[:, i]
        along = np.einsum("pd,pd->p", foot - corners[:, i], edge)
        along = np.clip(along / np.einsum("pd,pd->p", edge, edge), 0.0, 1.0)
        gap = corners[:, i] + along[:, None] * edge - foot
        squared = np.einsum("pd,pd->p", gap, gap)
        nearer = squared < best
        best = np.where(nearer, squared, best)
        weights[nearer] = 0.0
        weights[nearer, i] = 1.0 - along[nearer]
        weights[nearer, j] = along[nearer]
    return weights


def _plane_barycentric(
    points: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray
) -> FloatArray:
    """Barycentric coordinates (p, 3) of the points' feet in the triangles' planes."""
    normal = np.cross(b - a, c - a)  # (p, 3)
    squared = np.einsum("pd,pd->p", normal, normal)
    offset = points - a
    second = np.einsum("pd,pd->p", np.cross(offset, c - a), normal) / squared
    third = np.einsum("pd,pd->p", np.cross(b - a, offset), normal) / squared
    return np.stack([1.0 - second - third, second, third], axis=1)


def _nearest(tree: cKDTree, points: FloatArray) -> IntArray:
    """Indices (c, 4) of the nearest entries of the tree, fewer columns in a smaller tree."""
    ranks = np.arange(1, min(_NEIGHBOURS, tree.n) + 1)
    return np.asarray(tree.query(points, k=ranks)[1], dtype=np.int64)


def _incident_faces(mesh: TriangleMesh) -> tuple[IntArray, IntArray]:
    """Faces around each vertex: those of vertex v are ``faces[starts[v] : starts[v + 1]]``."""
    corners = mesh.faces.ravel()
    order = np.argsort(corners, kind="stable")
    counts = np.bincount(corners, minlength=mesh.n_vertices)
    return np.concatenate([[0], np.cumsum(counts)]), order // 3


def _candidates(near: IntArray, starts: IntArray, incident: IntArray) -> tuple[IntArray, IntArray]:
    """Pairs (point, face) for all faces around the vertices near each point, (q,) each."""
    vertices = near.ravel()
    counts = starts[vertices + 1] - starts[vertices]  # (c * near,)
    owner = np.repeat(np.repeat(np.arange(len(near)), near.shape[1]), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, incident[np.repeat(starts[vertices], counts) + within]
