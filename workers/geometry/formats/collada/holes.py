"""Polygons with holes, cut into triangles."""

from collections.abc import Sequence

import mapbox_earcut
import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray

MOST_CORNERS = 2000  # of one polygon and its holes: clipping takes their square


def cut_with_holes(vertices: FloatArray, rings: Sequence[IntArray]) -> IntArray:
    """Cut a polygon without its holes into triangles.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    rings : sequence of (c,) int64
        Corners of the polygon, then of each hole, as indices of vertices.

    Returns
    -------
    (t, 3) int64
        In the winding of the polygon; none where it has no area.

    Raises
    ------
    InvalidMeshError
        Too many corners.
    """
    nothing = np.zeros((0, 3), dtype=np.int64)
    rings = [ring for ring in rings if len(ring) >= 3]
    if not rings:
        return nothing
    corners = np.concatenate(rings)
    if len(corners) > MOST_CORNERS:
        raise InvalidMeshError(
            f"a polygon with holes has {len(corners):,} corners, but at most {MOST_CORNERS:,} "
            "are accepted: cut it into triangles"
        )
    flat = _projected(vertices[corners], len(rings[0]))
    if flat is None:
        return nothing
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    triangles = mapbox_earcut.triangulate_float64(np.ascontiguousarray(flat), ends)
    cut = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    a, b, c = (flat[cut[:, i]] for i in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    turned = (ux * vy - uy * vx).sum() < 0.0  # the projection is against the clock
    return corners[cut[:, ::-1] if turned else cut]


def _projected(points: FloatArray, n_outer: int) -> FloatArray | None:
    """Corners (c, 2) in the plane of the outer ring, against the clock, or None without one."""
    with np.errstate(all="ignore"):  # NaN and overflow are cleaning's to report
        offsets = points - points[0]
        offsets = offsets / np.abs(offsets).max()
        outer = offsets[:n_outer]
        normal = np.cross(outer, np.roll(outer, -1, axis=0)).sum(axis=0)  # (3,)
        length = np.sqrt((normal**2).sum())
    if not (np.isfinite(offsets).all() and np.isfinite(length) and length > 0.0):
        return None
    normal = normal / length
    first = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    first /= np.sqrt((first**2).sum())
    axes = np.stack([first, np.cross(normal, first)])  # (2, 3)
    flat: FloatArray = offsets @ axes.T
    return flat
