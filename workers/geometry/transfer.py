"""Carrying a field from one mesh of a surface to another."""

import numpy as np
from scipy.spatial import cKDTree

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh

_NEIGHBOURS = 4  # nearest vertices, and nearest face centres, whose faces are candidates
_CHUNK = 20_000  # target vertices at a time


def transfer_to_vertices(
    source: TriangleMesh, values: FloatArray, target: TriangleMesh
) -> FloatArray:
    """Interpolate a field at the points of the source surface closest to the target's vertices.

    The closest point is looked for on the faces around the nearest source vertices and on the
    faces with the nearest centres; the field is linear on each face. Values lie within the range
    of the source's.

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
    corners = source.vertices[source.faces]  # (m, 3, 3)
    vertices = cKDTree(source.vertices)
    centres = cKDTree(corners.mean(axis=1))
    starts, incident = _incident_faces(source)
    carried = np.empty(target.n_vertices)
    for begin in range(0, target.n_vertices, _CHUNK):
        points = target.vertices[begin : begin + _CHUNK]  # (c, 3)
        near = _nearest(vertices, points)  # (c, 4)
        faces = _nearest(centres, points)  # (c, 4)
        owner, face = _candidates(near, starts, incident)
        owner = np.concatenate([owner, np.repeat(np.arange(len(points)), faces.shape[1])])
        face = np.concatenate([face, faces.ravel()])  # (p,) candidate pairs
        weights = closest_barycentric(points[owner], corners[face])  # (p, 3)
        closest = np.einsum("pc,pcd->pd", weights, corners[face])
        squared = np.einsum("pd,pd->p", closest - points[owner], closest - points[owner])
        order = np.lexsort((face, squared, owner))
        first = np.searchsorted(owner[order], np.arange(len(points)))
        best = order[first]  # (c,)
        chosen = values[source.faces[face[best]]]  # (c, 3)
        carried[begin : begin + _CHUNK] = np.einsum("cd,cd->c", weights[best], chosen)
    return carried


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
