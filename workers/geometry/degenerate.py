"""Faces without area."""

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, cross, lengths, squared_lengths

THINNEST_FACE = 1e-6  # height over longest edge; cotangents beyond its inverse drown in rounding
AT_A_TIME = 1 << 14  # faces: what is computed of them stays in the processor's cache


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
    degenerate = np.empty(len(faces), dtype=np.bool_)
    for first in range(0, len(faces), AT_A_TIME):
        some = slice(first, first + AT_A_TIME)
        degenerate[some] = _degenerate(*(vertices.take(faces[some, i], axis=0) for i in range(3)))
    return degenerate


def _degenerate(first: FloatArray, second: FloatArray, third: FloatArray) -> BoolArray:
    """Which faces (q,) of these corners (q, 3) are degenerate."""
    sides = second - first, third - second, first - third
    longest = squared_lengths(sides[0])
    for side in sides[1:]:
        np.maximum(longest, squared_lengths(side), out=longest)
    doubled_area = lengths(cross(sides[0], sides[1]))  # (q,)
    degenerate: BoolArray = doubled_area <= THINNEST_FACE * longest  # a point has 0 ≤ 0
    return degenerate
