"""Sparse factors of a shifted matrix that solve, and count eigenvalues by Sylvester's law."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from workers.geometry.arrays import FloatArray

# Componentwise backward error above which a factor made without pivoting is not believed.
# A sound one has 1e-15 to 1e-14; a tiny pivot shows as digits lost here.
_BACKWARD_ERROR = 1e-11


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
    _factor: SuperLU

    def solve(self, block: FloatArray) -> FloatArray:
        """Return (S - shift I)⁻¹ block, for columns (n, b)."""
        solution: FloatArray = self._factor.solve(np.asfortranarray(block))
        return solution


def factorise(matrix: sparse.csc_array, shift: float) -> ShiftedFactor | None:
    """Factor S - shift I without pivoting, or None where the result cannot be believed.

    SuperLU in symmetric mode takes the diagonal as pivot unless it is exactly zero; then the
    matrix is P(LDLᵀ)Pᵀ and its pivots have the signs of the eigenvalues. Where it exchanged rows
    (``perm_r`` differs from ``perm_c``), found the matrix singular, or lost digits to a tiny
    pivot, the shift is on an eigenvalue of a leading block: the caller moves it a little.
    """
    shifted = sparse.csc_array(matrix - shift * sparse.eye_array(matrix.shape[0], format="csc"))
    try:
        factor = splu(
            shifted,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # exactly singular
        return None
    if not np.array_equal(factor.perm_r, factor.perm_c):
        return None
    pivots = factor.U.diagonal()  # (n,)
    error = _backward_error(shifted, factor)
    if not np.all(np.isfinite(pivots)) or not error <= _BACKWARD_ERROR:
        return None
    return ShiftedFactor(float(shift), int(np.count_nonzero(pivots < 0.0)), error, factor)


def factorise_between(
    matrix: sparse.csc_array, low: float, high: float, *, attempts: int = 7
) -> ShiftedFactor | None:
    """Factor at a shift in the open interval (low, high), from its middle outwards."""
    for attempt in range(attempts):
        offset = 0.5 + (-1) ** attempt * 0.11 * ((attempt + 1) // 2)
        found = factorise(matrix, low + offset * (high - low))
        if found is not None:
            return found
    return None


def _backward_error(matrix: sparse.csc_array, factor: SuperLU) -> float:
    """Componentwise backward error of solving with the factor; NaN where that overflows."""
    rng = np.random.Generator(np.random.PCG64(7))
    right = rng.uniform(0.5, 1.5, matrix.shape[0]) * rng.choice([-1.0, 1.0], matrix.shape[0])
    solution = factor.solve(right)
    with np.errstate(invalid="ignore", over="ignore"):
        error = np.abs(matrix @ solution - right)
        size = abs(matrix) @ np.abs(solution) + np.abs(right)
        return float(np.max(error / size))
