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
    """Times (r,), even in their logarithm, between which K² passes from flat to all but gone.

    Parameters
    ----------
    low, high : float
        Smallest and largest eigenvalue.
    """
    return np.geomspace(0.01 / high, 10.0 / low, count)


def heat_columns(times: FloatArray, low: float) -> Callable[[FloatArray], FloatArray]:
    """Functions exp(-2t(λ - low)), (k, r): heat kernels up to factors, none of which underflows."""

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
    low, high : float
        Smallest and largest eigenvalue.
    """
    times = candidate_times(low, high)
    while True:
        best = int(np.argmin(criterion(times)))
        lower, upper = times[max(best - 1, 0)], times[min(best + 1, len(times) - 1)]
        if upper / lower < 1.0 + _PRECISION:
            return float(times[best])
        times = np.geomspace(lower, upper, FINE_TIMES)
