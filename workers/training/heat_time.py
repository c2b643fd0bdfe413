"""The best time of the heat kernel by the criterion of eq. (7): section 4, third experiment."""

from collections.abc import Callable

import numpy as np

from workers.geometry.arrays import FloatArray

Criterion = Callable[[FloatArray], FloatArray]
"""From times (r,) to the criterion of the heat kernel at each, (r,)."""

COARSE_TIMES = 81
FINE_TIMES = 13
_NOTHING = 1e-120  # its square times a moment is still a normal number: others are slow
_PRECISION = 1e-5  # relative, of the time


def candidate_times(low: float, high: float, count: int = COARSE_TIMES) -> FloatArray:
    """Times, even in their logarithm, between which K² goes from constant to nearly 0.

    Parameters
    ----------
    low, high : float
        Smallest and largest eigenvalue.
    count : int
        How many times.

    Returns
    -------
    (count,) float64
        Rising, in 1 / unit of the eigenvalues.
    """
    return np.geomspace(0.01 / high, 10.0 / low, count)


def heat_columns(times: FloatArray, low: float) -> Callable[[FloatArray], FloatArray]:
    """Functions exp(-2t(λ - low)): heat kernels up to factors that keep them from underflow.

    Parameters
    ----------
    times : (r,) float64
        In 1 / unit of the eigenvalues.
    low : float
        Smallest eigenvalue.

    Returns
    -------
    callable
        From eigenvalues (k,) to (k, r) float64.
    """

    def columns(eigenvalues: FloatArray) -> FloatArray:
        values: FloatArray = np.exp(-2.0 * np.outer(eigenvalues - low, times))
        values[values < _NOTHING] = 0.0
        return values

    return columns


def best_heat_time(criterion: Criterion, low: float, high: float) -> float:
    """Time t* that minimises a criterion: on a grid, then on finer ones about the best point.

    Parameters
    ----------
    criterion : callable
        Eq. (7) of the heat kernel at each time.
    low, high : float
        Smallest and largest eigenvalue.

    Returns
    -------
    float
        t*, to a relative precision of 1e-5, in 1 / unit of the eigenvalues.
    """
    times = candidate_times(low, high)
    while True:
        best = int(np.argmin(criterion(times)))
        lower, upper = times[max(best - 1, 0)], times[min(best + 1, len(times) - 1)]
        if upper / lower < 1.0 + _PRECISION:
            return float(times[best])
        times = np.geomspace(lower, upper, FINE_TIMES)
