"""Polygons cut into triangles: area and winding stay, and every side is a triangle's side.

Neighbouring polygons share their sides, so a side must not be lost: it would leave a crack.
"""

from collections.abc import Callable
from functools import partial

import mapbox_earcut
import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.formats.surfaces.sweep import NotSimpleError, sweep_triangles
from workers.geometry.formats.text.tokens import Polygons

LARGEST_CLIPPED = 64  # corners; ear clipping takes their square, or their cube (decision 18)
OPENINGS = (1e-9, 1e-12, 0.0)  # in this order: slits need one, the thinnest teeth bear none
AREA_ERROR = 1e-6  # relative: more is lost or doubled only where sides cross


def triangulate(vertices: FloatArray, polygons: Polygons) -> IntArray:
    """Cut polygons into triangles, in the order of the polygons and in their winding.

    A quad is cut along a diagonal that lies inside. A larger polygon is cut as a fan, or, where
    the fan would fold over, by ear clipping or by a sweep. A polygon whose sides cross has no
    right answer: it becomes a fan.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    polygons : Polygons
        Corners are indices of vertices; polygons of less than 3 corners are left out.

    Returns
    -------
    (m, 3) int64
        Two triangles fewer than corners for each polygon; some may have no area. A view of the
        corners where all polygons are triangles.
    """
    counts = polygons.counts
    if (counts == 3).all():
        return polygons.corners.reshape(-1, 3)
    starts = np.cumsum(counts) - counts  # (p,)
    by_count = np.argsort(counts, kind="stable")
    by_count = by_count[counts[by_count] >= 3]
    sizes, begins = np.unique(counts[by_count], return_index=True)
    pieces: list[IntArray] = []
    origins: list[IntArray] = []
    for n_corners, rows in zip(sizes, np.split(by_count, begins[1:]), strict=True):
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
        return triangles
    for row in folded:
        found = _cut_folded(vertices[corners[row]])
        if found is not None:
            triangles[row] = corners[row][found]
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


def _cut_folded(points: FloatArray) -> IntArray | None:
    """Triangles (c - 2, 3) of one polygon (c, 3), or None where its sides cross."""
    flat = _projected(points)
    if flat is None:
        return None
    distinct = np.flatnonzero((flat != np.roll(flat, -1, axis=0)).any(axis=1))
    area = _doubled_areas(flat, _fan(np.arange(len(flat))[None])[0]).sum()
    ways: list[Callable[[FloatArray], IntArray | None]] = [
        partial(_sweep, opening=opening) for opening in OPENINGS
    ]
    if len(flat) <= LARGEST_CLIPPED:
        ways.insert(0, _clip)
    for cut in ways:
        found = _completed(cut(flat[distinct]), distinct, len(flat))
        if found is not None:
            areas = _doubled_areas(flat, found)
            if np.abs(areas).sum() <= (1.0 + AREA_ERROR) * area:
                return found
    return None


def _projected(points: FloatArray) -> FloatArray | None:
    """Corners (c, 2) in the polygon's own plane, against the clock, or None without a plane.

    The plane is that of the vector area (Newell): half the sum of the cross products of
    neighbouring corners. So the area in the plane is the polygon's vector area.
    """
    with np.errstate(all="ignore"):  # NaN and overflow are cleaning's to report
        offsets = points - points[0]
        offsets = offsets / np.abs(offsets).max()
        normal = np.cross(offsets, np.roll(offsets, -1, axis=0)).sum(axis=0)  # (3,)
        length = np.sqrt((normal**2).sum())
    if not (np.isfinite(length) and length > 0.0):
        return None
    normal = normal / length
    # Two axes across the normal; the first is across the coordinate axis it is farthest from.
    first = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    first /= np.sqrt((first**2).sum())
    axes = np.stack([first, np.cross(normal, first)])  # (2, 3)
    return np.stack([(offsets * axis).sum(axis=1) for axis in axes], axis=1)


def _clip(flat: FloatArray) -> IntArray | None:
    """Triangles by ear clipping; sides in a line and touching corners may lack theirs."""
    ends = np.array([len(flat)], dtype=np.uint32)
    triangles = mapbox_earcut.triangulate_float64(np.ascontiguousarray(flat), ends)
    return np.asarray(triangles, dtype=np.int64).reshape(-1, 3)


def _sweep(flat: FloatArray, *, opening: float) -> IntArray | None:
    """Triangles by a sweep, or None where it lost its way."""
    try:
        return sweep_triangles(flat, opening=opening)
    except NotSimpleError:
        return None


def _completed(triangles: IntArray | None, corners: IntArray, count: int) -> IntArray | None:
    """Triangles (count - 2, 3) that have all sides of a polygon of so many corners.

    Parameters
    ----------
    triangles : (t, 3) int64 or None
        Indices into ``corners``.
    corners : (d,) int64
        Those of the polygon that were cut, ascending.
    count : int
        Corners of the whole polygon. Those that lie on a side of a triangle, or in the place of
        the next one, are put into that side.

    Returns
    -------
    (count - 2, 3) int64, or None where some side has no triangle.
    """
    if triangles is None:
        return None
    waiting = corners[triangles].tolist()
    sides = {(t[i - 1], t[i]) for t in waiting for i in range(3)}
    complete = []
    while waiting:
        triangle = waiting.pop()
        for i in range(3):
            start, end = triangle[i - 1], triangle[i]
            left_out = (end - start) % count - 1
            if left_out and (end, start) not in sides and len(waiting) < 2 * count:
                # The side skips corners: the first of them splits the triangle.
                middle, apex = (start + 1) % count, triangle[i - 2]
                waiting += [[start, middle, apex], [middle, end, apex]]
                sides |= {(middle, apex), (apex, middle)}
                break
        else:
            complete.append(triangle)
    if len(complete) != count - 2:
        return None
    return np.array(complete, dtype=np.int64)


def _doubled_areas(flat: FloatArray, triangles: IntArray) -> FloatArray:
    """Twice the signed area (t,) of triangles in the plane."""
    a, b, c = (flat[triangles[:, i]] for i in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    areas: FloatArray = ux * vy - uy * vx
    return areas
