"""Signatures at some points of a surface, and whether each is found again on another one.

A part of a shape has another distribution of signatures than the whole, but at small times the
signature of a point says what its surroundings look like, and they are there on the whole too. So
the query's points are looked for among the candidate's, and not the reverse.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from workers.geometry.arrays import FloatArray


def point_signatures(logarithms: FloatArray, indices: NDArray[np.int64], count: int) -> FloatArray:
    """Signatures of a sample as one vector, (count · t,), one point after the other.

    Parameters
    ----------
    logarithms : (t, n) float64
        ln k(x,x) at t times and all vertices.
    indices : (s,) int64
        The sample, at most ``count`` vertices; where there are fewer, they are repeated.
    count : int
    """
    chosen = np.resize(indices, count)
    signatures: FloatArray = logarithms[:, chosen].T.ravel()
    return signatures


def unfound_points(query: NDArray[Any], rows: NDArray[Any], times: int) -> FloatArray:
    """(mean over the query's points of √δ)², δ to the nearest of a row's points.

    δ is the mean of |a − b| over the times. The root lets points count more for being found exactly
    than for being far from everything, as those at a cut are. Not symmetric; 0 for equal rows.

    Parameters
    ----------
    query : (p · times,) float
    rows : (n, p · times) float
    times : int

    Returns
    -------
    (n,) float64
    """
    points = np.asarray(query, dtype=np.float64).reshape(-1, times)
    found = np.empty(len(rows))
    for number, row in enumerate(rows):
        others = np.asarray(row, dtype=np.float64).reshape(-1, times)
        nearest = cdist(points, others, "cityblock").min(axis=1) / times
        found[number] = np.square(np.sqrt(nearest).mean())
    return found
