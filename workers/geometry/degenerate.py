"""Faces without area."""

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, cross, lengths, squared_lengths

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
    sides = np.empty((3, len(faces), 3))  # from corner to corner
    for corner in range(3):
        start, end = faces[:, corner], faces[:, (corner + 1) % 3]
        np.subtract(vertices.take(end, axis=0), vertices.take(start, axis=0), out=sides[corner])
    longest = np.zeros(len(faces))  # squared
    for side in sides:
        np.maximum(longest, squared_lengths(side), out=longest)
    doubled_area = lengths(cross(sides[0], sides[1]))  # (m,)
    degenerate: BoolArray = doubled_area <= THINNEST_FACE * longest  # a point has 0 ≤ 0
    return degenerate
