"""Normals of vertices, from those of the faces around them."""

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray, lengths
from workers.geometry.mesh import TriangleMesh


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """The vectors with length 1.

    Parameters
    ----------
    vectors : (..., d) float64
        Of any length.

    Returns
    -------
    (..., d) float64
        A vector of length 0 stays 0.
    """
    if vectors.ndim == 2 and vectors.shape[1] == 3:
        sizes = lengths(vectors.astype(np.float64, copy=False))[:, None]
    else:
        sizes = np.linalg.norm(vectors, axis=-1, keepdims=True)
    units: FloatArray = vectors / np.where(sizes > 0.0, sizes, 1.0)
    return units


def vertex_normals(mesh: TriangleMesh, *, corner_by_corner: bool = False) -> FloatArray:
    """Mean of the face normals around each vertex, weighted by the areas of the faces.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices; wound outwards for outward normals.
    corner_by_corner : bool
        Add first corners of all faces first, then second ones, then third ones, and not face by
        face. The order decides the last bits: the versions of creatures and of transformations
        stand for one each.

    Returns
    -------
    (n, 3) float64
        Of length 1; 0 at a vertex without a face.
    """
    normals = mesh.face_normals  # (m, 3): twice the area long
    if corner_by_corner:
        return _summed(mesh.faces.T.ravel(), np.tile(normals, (3, 1)), mesh.n_vertices)
    return _summed(mesh.faces.ravel(), np.repeat(normals, 3, axis=0), mesh.n_vertices)


def angle_weighted_normals(mesh: TriangleMesh) -> FloatArray:
    """Mean of the face normals around each vertex, weighted by the angles of the faces there.

    Smoother to look at than weights by area where triangles are uneven (Thürmer, Wüthrich 1998).

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.

    Returns
    -------
    (n, 3) float64
        Of length 1; 0 at a vertex without a face.
    """
    angles = _corner_angles(mesh.vertices[mesh.faces])  # (m, 3)
    normals = unit_vectors(mesh.face_normals)  # (m, 3)
    weighted = (normals[:, None, :] * angles[:, :, None]).reshape(-1, 3)  # (3m, 3)
    return _summed(mesh.faces.ravel(), weighted, mesh.n_vertices)


def _corner_angles(corners: FloatArray) -> FloatArray:
    """Angle at each corner (m, 3) of faces (m, 3, 3), in radians."""
    edges = [unit_vectors(corners[:, (i + 1) % 3] - corners[:, i]) for i in range(3)]
    cosines = [-(edges[i] * edges[i - 1]).sum(axis=1) for i in range(3)]
    angles: FloatArray = np.arccos(np.clip(np.stack(cosines, axis=1), -1.0, 1.0))
    return angles


def _summed(owners: IntArray, vectors: FloatArray, count: int) -> FloatArray:
    """Unit vectors along the sums (count, 3) of the vectors (q, 3) of each owner (q,)."""
    sums = [np.bincount(owners, vectors[:, axis], minlength=count) for axis in range(3)]
    return unit_vectors(np.stack(sums, axis=1))
