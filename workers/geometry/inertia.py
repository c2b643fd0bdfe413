"""Factors of a shifted matrix that solve, and count eigenvalues by Sylvester's law of inertia."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from workers.geometry.arrays import FloatArray
from workers.geometry.factorisation import SymmetricFactor

SOUND_ERROR = 1e-13
"""Componentwise backward error of a factor that lost no digits: those have 1e-16 to 1e-14."""

# Above this error a factor made without pivoting is not believed. Chosen between sound factors
# and those with a tiny pivot, whose error is 1e-8 and more (`tests/geometry/test_inertia.py`).
_BACKWARD_ERROR = 1e-11

_ATTEMPTS = 7  # shifts tried in an interval, 0.11 of its width apart; chosen, not measured
_PANEL_SIZE = 2  # measured from 2,500 to 20,000 vertices: 0.65 to 0.85 of the time with 20
_PROBE_SEED = 7  # of the right-hand side that the backward error is measured with


@dataclass(frozen=True, eq=False)
class ShiftedFactor:
    """A sound LDLᵀ of S - shift I.

    Attributes
    ----------
    shift : float
        Where S was shifted to.
    n_below : int
        Number of eigenvalues of S below the shift, with multiplicity: the negative pivots.
    backward_error : float
        Componentwise: the factor is exact for a matrix whose entries differ by this, relatively.
    """

    shift: float
    n_below: int
    backward_error: float
    _factor: SymmetricFactor

    def solve(self, block: FloatArray) -> FloatArray:
        """Apply (S - shift I)⁻¹.

        Parameters
        ----------
        block : (n, b) float64
            Right-hand sides, as columns.

        Returns
        -------
        (n, b) float64
        """
        return self._factor.solve(np.asfortranarray(block))


def factorise(matrix: sparse.csc_array, shift: float) -> ShiftedFactor | None:
    """Factor S - shift I without pivoting, or None where the result cannot be believed.

    The diagonal serves as pivot unless it is exactly zero. Then the matrix is P(LDLᵀ)Pᵀ, and by
    Sylvester's law its pivots have the signs of the eigenvalues. The factor is refused where rows
    were exchanged, where the matrix is singular, and where a tiny pivot cost digits. In all
    three cases the shift is on an eigenvalue of a leading block: the caller moves it a little.

    Parameters
    ----------
    matrix : (n, n) sparse
        S, symmetric.
    shift : float
        In the unit of the eigenvalues.

    Returns
    -------
    ShiftedFactor or None
    """
    shifted = sparse.csc_array(matrix - shift * sparse.eye_array(matrix.shape[0], format="csc"))
    try:
        factor = SymmetricFactor(shifted, panel_size=_PANEL_SIZE)
    except RuntimeError:  # exactly singular
        return None
    if factor.exchanged_rows:
        return None
    pivots = factor.pivots  # (n,)
    error = _backward_error(shifted, factor)
    if not np.all(np.isfinite(pivots)) or not error <= _BACKWARD_ERROR:
        return None
    return ShiftedFactor(float(shift), int(np.count_nonzero(pivots < 0.0)), error, factor)


def factorise_between(matrix: sparse.csc_array, low: float, high: float) -> ShiftedFactor | None:
    """First sound factor at a shift in the open interval (low, high), from its middle outwards.

    Parameters
    ----------
    matrix : (n, n) sparse
        S, symmetric.
    low, high : float
        Ends of the interval, in the unit of the eigenvalues.

    Returns
    -------
    ShiftedFactor or None
        None where the interval is empty, or none of seven shifts gave a sound factor.
    """
    return next(factors_between(matrix, low, high), None)


def factors_between(matrix: sparse.csc_array, low: float, high: float) -> Iterator[ShiftedFactor]:
    """All sound factors at shifts in the open interval (low, high), from its middle outwards.

    Parameters
    ----------
    matrix : (n, n) sparse
        S, symmetric.
    low, high : float
        Ends of the interval, in the unit of the eigenvalues.

    Yields
    ------
    ShiftedFactor
        At most seven, each made when it is asked for; none where the interval is empty.
    """
    if not low < high:
        return
    for attempt in range(_ATTEMPTS):
        offset = 0.5 + (-1) ** attempt * 0.11 * ((attempt + 1) // 2)
        found = factorise(matrix, low + offset * (high - low))
        if found is not None:
            yield found


def _backward_error(matrix: sparse.csc_array, factor: SymmetricFactor) -> float:
    """Componentwise backward error of solving with the factor; NaN where that overflows."""
    rng = np.random.Generator(np.random.PCG64(_PROBE_SEED))
    right = rng.uniform(0.5, 1.5, matrix.shape[0]) * rng.choice([-1.0, 1.0], matrix.shape[0])
    solution = factor.solve(right)
    with np.errstate(invalid="ignore", over="ignore"):
        error = np.abs(matrix @ solution - right)
        size = abs(matrix) @ np.abs(solution) + np.abs(right)
        return float(np.max(error / size))
