"""From polygons to the triangles of a mesh, with the checks that all formats share."""

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.tokens import Polygons
from workers.geometry.mesh import TriangleMesh

LONGEST_CLIPPED_POLYGON = 256  # corners; ear clipping takes their square


def polygon_mesh(vertices: FloatArray, polygons: Polygons, limits: MeshLimits) -> TriangleMesh:
    """Mesh of polygons cut into triangles; points and segments are left out.

    Parameters
    ----------
    vertices : (n, 3) float64
    polygons : Polygons
        Corners are indices from 0, not checked before.

    Raises
    ------
    InvalidMeshError
        No face, or a face that refers to a vertex that there is not.
    UploadTooLargeError
        More vertices or triangles than the limits allow.
    """
    n_triangles = int(np.maximum(polygons.counts - 2, 0).sum())
    limits.check(vertices=len(vertices), faces=n_triangles)
    require_faces(len(vertices), n_triangles)
    faces_of_corners = np.repeat(np.arange(len(polygons.counts)), polygons.counts)
    require_indices(polygons.corners, faces_of_corners, len(vertices))
    return TriangleMesh(vertices, triangulate(vertices, polygons))


def require_faces(n_vertices: int, n_faces: int) -> None:
    """Raise ``InvalidMeshError`` for an empty file or a point cloud."""
    if n_faces == 0 and n_vertices == 0:
        raise InvalidMeshError("the file has neither vertices nor faces; expected a surface")
    if n_faces == 0:
        raise InvalidMeshError(
            f"the file has points but no faces ({n_vertices:,} points); expected a surface"
        )


def require_indices(
    corners: IntArray, faces_of_corners: IntArray, n_vertices: int, *, first: int = 0
) -> None:
    """Raise ``InvalidMeshError`` naming the first corner that is no vertex.

    Parameters
    ----------
    corners, faces_of_corners : (c,) int64
        Vertex indices from 0, and the face each belongs to.
    first : int
        What the format calls its first vertex, for the message (1 in OBJ).
    """
    bad = (corners < 0) | (corners >= n_vertices)
    if bad.any():
        where = int(np.argmax(bad))
        raise InvalidMeshError(
            f"face {faces_of_corners[where]} refers to vertex {corners[where] + first}, "
            f"but the mesh has {n_vertices} vertices"
        )


def triangulate(vertices: FloatArray, polygons: Polygons) -> IntArray:
    """Triangles (m, 3) in the order of the polygons, same winding.

    Quads are cut along a diagonal that lies inside, larger polygons as a fan, or ear by ear
    where the fan would fold over.
    """
    counts = polygons.counts
    starts = np.cumsum(counts) - counts  # (p,)
    pieces: list[IntArray] = []
    origins: list[IntArray] = []
    for n_corners in np.unique(counts[counts >= 3]):
        rows = np.flatnonzero(counts == n_corners)  # (r,)
        corners = polygons.corners[starts[rows, None] + np.arange(n_corners)]  # (r, n_corners)
        triangles = _cut(vertices, corners)  # (r, n_corners - 2, 3)
        pieces.append(triangles.reshape(-1, 3))
        origins.append(np.repeat(rows, n_corners - 2))
    if len(pieces) == 1:
        return pieces[0]
    order = np.argsort(np.concatenate(origins), kind="stable")
    faces: IntArray = np.concatenate(pieces)[order]
    return faces


def _cut(vertices: FloatArray, corners: IntArray) -> IntArray:
    """Polygons of the same number of corners (r, c) to triangles (r, c - 2, 3)."""
    n_corners = corners.shape[1]
    if n_corners == 3:
        return corners[:, None, :]
    triangles = _fan(corners)  # (r, c - 2, 3)
    folded = np.flatnonzero(_folds(vertices, triangles))
    if n_corners == 4:
        other = _fan(np.roll(corners[folded], -1, axis=1))
        better = ~_folds(vertices, other)
        triangles[folded[better]] = other[better]
    elif n_corners <= LONGEST_CLIPPED_POLYGON:
        for row in folded:
            triangles[row] = corners[row][_clip_ears(vertices[corners[row]])]
    return triangles


def _fan(corners: IntArray) -> IntArray:
    """Triangles (r, c - 2, 3) that share the first corner."""
    n_triangles = corners.shape[1] - 2
    first = np.repeat(corners[:, :1], n_triangles, axis=1)
    return np.stack([first, corners[:, 1:-1], corners[:, 2:]], axis=2)


def _folds(vertices: FloatArray, triangles: IntArray) -> BoolArray:
    """Whether triangles (r, t, 3) of one polygon face opposite ways, (r,)."""
    a, b, c = (vertices[triangles[:, :, i]] for i in range(3))
    with np.errstate(all="ignore"):  # NaN and overflow are cleaning's to report
        normals = np.cross(b - a, c - a)  # (r, t, 3)
        along = (normals * normals.sum(axis=1, keepdims=True)).sum(axis=2)  # (r, t)
    folded: BoolArray = (along < 0).any(axis=1)
    return folded


def _clip_ears(points: FloatArray) -> IntArray:
    """Triangulate one simple, nearly flat polygon (c, 3) by ear clipping: (c - 2, 3)."""
    with np.errstate(all="ignore"):
        following = np.roll(points, -1, axis=0)
        normal = np.cross(points - points[0], following - points[0]).sum(axis=0)  # (3,)
        axis = int(np.argmax(np.abs(np.nan_to_num(normal))))
        flat = points[:, [(axis + 1) % 3, (axis + 2) % 3]] * np.array([1.0, np.sign(normal[axis])])
        left = list(range(len(points)))
        triangles = []
        while len(left) > 3:
            ears = (i for i in range(len(left)) if _is_ear(flat, left, i))
            ear = next(ears, 1)
            triangles.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
            del left[ear]
        return np.array([*triangles, left], dtype=np.int64)


def _is_ear(flat: FloatArray, left: list[int], i: int) -> bool:
    """Whether corner i of the counter-clockwise polygon ``flat[left]`` can be cut off."""
    indices = [left[i - 1], left[i], left[(i + 1) % len(left)]]
    triangle = flat[indices]  # (3, 2)
    sides = np.roll(triangle, -1, axis=0) - triangle  # (3, 2)
    turn = sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0]
    if not turn > 0:
        return False
    others = flat[[k for k in left if k not in indices]]  # (r, 2)
    to_point = others[:, None, :] - triangle[None]  # (r, 3, 2)
    cross = sides[:, 0] * to_point[..., 1] - sides[:, 1] * to_point[..., 0]  # (r, 3)
    return not bool((cross >= 0).all(axis=1).any())
