"""Slivers taken out of a closed surface, its topology and all else left as they are."""

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh

# Chosen, not measured.
_POOR = 0.2  # quality below which a triangle goes
_ROUNDS = 4


def drop_slivers(points: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Points and faces after an edge of each sliver was collapsed.

    An edge is collapsed to its middle only where this changes no topology and folds nothing over.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices.
    faces : (m, 3) int64
        Of a closed surface.

    Returns
    -------
    points : (n', 3) float64
    faces : (m', 3) int64
    """
    points, faces = points.copy(), faces.copy()
    for _ in range(_ROUNDS):
        quality = triangle_quality(points, faces)
        poor = faces[quality < _POOR][np.argsort(quality[quality < _POOR])]
        if len(poor) == 0:
            break
        for face in poor:
            faces = _collapse_one(points, faces, face)
    used, renumbered = np.unique(faces, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3).astype(np.int64)


def triangle_quality(points: FloatArray, faces: IntArray) -> FloatArray:
    """Area over the sum of squared edges, scaled.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices.
    faces : (m, 3) int64
        Of the surface.

    Returns
    -------
    (m,) float64: 1 for equilateral triangles, 0 for lines
    """
    corners = points[faces]  # (m, 3, 3)
    squares = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=(1, 2))
    quality: FloatArray = 4 * np.sqrt(3) * TriangleMesh(points, faces).face_areas / squares
    return quality


def _collapse_one(points: FloatArray, faces: IntArray, face: IntArray) -> IntArray:
    """Faces after the first edge of the face that can go was collapsed; moves its point."""
    if not (faces == face).all(axis=1).any():
        return faces  # gone or changed with a neighbour
    edges = sorted(
        ((face[i], face[i - 1]) for i in range(3)),
        key=lambda edge: float(np.linalg.norm(points[edge[0]] - points[edge[1]])),
    )
    for kept, lost in edges:
        around_kept, around_lost = (faces[(faces == v).any(axis=1)] for v in (kept, lost))
        shared = np.intersect1d(around_kept, around_lost)
        if len(shared) != 4:  # the edge and its two opposite corners: else a loop would close
            continue
        ring = np.concatenate([around_kept, around_lost])
        ring = ring[~((ring == kept).any(axis=1) & (ring == lost).any(axis=1))]
        before = TriangleMesh(points, ring).face_normals
        middle, old = (points[kept] + points[lost]) / 2, points[kept].copy()
        points[kept] = middle
        after = TriangleMesh(points, np.where(ring == lost, kept, ring)).face_normals
        if ((before * after).sum(axis=1) > 0).all():
            faces = np.where(faces == lost, kept, faces)
            degenerate = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
            remaining: IntArray = faces[~degenerate]
            return remaining
        points[kept] = old
    return faces
