"""Faces without area."""

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray

THINNEST_FACE = 1e-6  # height over longest edge; cotangents beyond its inverse drown in rounding


def degenerate_faces(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Tell which faces are points, segments or needles.

    Parameters
    ----------
    vertices : (n, 3) float64
        In a unit in which squares of lengths are normal numbers, such as about the extent.
    faces : (m, 3) int64
        Of these vertices.

    Returns
    -------
    (m,) bool
        True where the face has no area, or next to none for its length.
    """
    corners = vertices[faces]  # (m, 3, 3)
    sides = np.roll(corners, -1, axis=1) - corners  # (m, 3, 3)
    longest = (sides**2).sum(axis=2).max(axis=1)  # (m,), squared
    doubled_area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)  # (m,)
    degenerate: BoolArray = doubled_area <= THINNEST_FACE * longest  # a point has 0 ≤ 0
    return degenerate
