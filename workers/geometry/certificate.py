"""What turns Ritz pairs into a result: the count by inertia, and the residuals."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy import sparse

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.inertia import SOUND_ERROR, ShiftedFactor, factors_between

RESIDUAL = 1e-10
"""Relative residual that the search must reach; ten times that is accepted in the end.

Chosen, not measured: it leaves the eigenvalues of LAPACK and Lanczos equal to 1e-10
(``tests/geometry/test_eigensolver.py``), far below the error of any mesh.
"""

# Relative width of a gap between eigenvalues. Chosen, not measured: narrower than `_GAP` is one
# cluster, whose members differ less than any descriptor can tell; in a `_WIDE` gap the factor of a
# mesh without slivers certifies at the first try.
_GAP = 1e-8
_WIDE = 1e-4
_REFINEMENTS = 3  # chosen, not measured: one step takes off some five digits
_NEARLY_ORTHONORMAL = 1e-10  # its square is below rounding errors
_NEAR = 8  # gaps above the k-th eigenvalue that are looked at: farther ones have not converged


@dataclass(frozen=True, eq=False)
class Candidate:
    """Eigenvalues seen through a Krylov space, with bounds and where they come from.

    Attributes
    ----------
    values : (m,) float64
        Without the zero mode, ascending, in 1/area.
    lower, upper : (m,) float64
        An eigenvalue lies between the two.
    indices : (m,) int64
        Of the Ritz pairs that the values belong to.
    """

    values: FloatArray
    lower: FloatArray
    upper: FloatArray
    indices: IntArray


def is_complete(
    matrix: sparse.csc_array, zero_mode: FloatArray, candidate: Candidate, factor: ShiftedFactor
) -> bool:
    """Whether the inertia of the search's own factor certifies all eigenvalues below its shift.

    Those found are as many as the negative pivots, and all have converged. On both sides, the shift
    is farther from the next one than the rounding error of the factor moves it (`is_certified`).

    Parameters
    ----------
    matrix : (n, n) sparse
        S = A^-1/2 W A^-1/2, at area 1.
    zero_mode : (n,) float64
        Square roots of the vertices' areas: the eigenvector of S for the eigenvalue 0.
    candidate : Candidate
        All eigenvalues found below the shift, converged, and some above.
    factor : ShiftedFactor
        The one that the candidate was found with.

    Returns
    -------
    bool
        False too where no eigenvalue above the shift is known.
    """
    uncertainty = 2.0 * factor.backward_error * _trace(matrix, zero_mode)
    found = int(np.count_nonzero(candidate.values < factor.shift))
    if not found == factor.n_below - 1 < len(candidate.values):
        return False
    below = candidate.upper[:found].max(initial=0.0) + uncertainty
    above = candidate.lower[found:].min() - uncertainty
    return bool(below < factor.shift < above)


def is_certified(
    matrix: sparse.csc_array, zero_mode: FloatArray, candidate: Candidate, count: int
) -> bool:
    """Whether the inertia in a gap at the k-th eigenvalue equals the number found below it.

    By Sylvester's law of inertia the negative pivots of S - τI count the eigenvalues below τ. A
    rounding error E of the factor moves an eigenvalue by φᵀEφ. That is at most about the relative
    size of E times the trace of W. τ must be farther than that from both ends of its gap.

    Parameters
    ----------
    matrix : (n, n) sparse
        S = A^-1/2 W A^-1/2, at area 1.
    zero_mode : (n,) float64
        Square roots of the vertices' areas: the eigenvector of S for the eigenvalue 0.
    candidate : Candidate
        At least ``count`` eigenvalues.
    count : int
        k, the number of eigenvalues to certify.

    Returns
    -------
    bool
        True if some gap has the right count, and is wider than the rounding error of its factor.
    """
    trace = _trace(matrix, zero_mode)
    for found, low, high in _gaps(candidate, count):
        for factor in factors_between(matrix, low, high):
            # Another number than was found (and the zero mode): an eigenvalue was missed.
            if factor.n_below != found + 1:
                break
            uncertainty = 2.0 * factor.backward_error * trace
            if low + uncertainty < factor.shift < high - uncertainty:
                return True
            # The count fits, but the gap is too narrow for this factor. If a tiny pivot cost it
            # digits, another shift in the gap may do; if not, only a wider gap can.
            if factor.backward_error <= SOUND_ERROR:
                break
    return False


def _gaps(candidate: Candidate, count: int) -> Iterator[tuple[int, float, float]]:
    """Gaps that can certify ``count`` eigenvalues: how many lie below, and the two ends."""
    values = candidate.values
    widths = (candidate.lower[1:] - candidate.upper[:-1]) / values[1:]  # (m - 1,): after i + 1
    # A gap above the k-th eigenvalue, where as many more were found as belong to its cluster.
    above = [m for m in range(count, len(values)) if widths[m - 1] > _GAP]
    near = above[:_NEAR]
    # The first that is wide has the fewest eigenvalues below it, so the least that may be missed.
    first_wide = [m for m in near if widths[m - 1] > _WIDE]
    tried = (first_wide or above)[:1]
    # On slivers it can be too narrow still: then the widest of those near.
    widest = max(near, key=lambda m: float(widths[m - 1]), default=None)
    if widest is not None and widest not in tried:
        tried.append(widest)
    for m in tried:
        yield m, float(candidate.upper[m - 1]), float(candidate.lower[m])
    # Where not all of the cluster was found, the gap below it serves. It begins at most 1e-8 below
    # the cluster: a member that was missed then differs from the one returned by no more.
    first = int(np.searchsorted(values, values[count - 1] * (1.0 - _GAP)))
    floor = max(candidate.upper[first - 1] if first > 0 else 0.0, values[first] * (1.0 - _GAP))
    yield first, float(floor), float(candidate.lower[first])


def polished(
    matrix: sparse.csc_array, factor: ShiftedFactor, vectors: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Eigenpairs of S by Rayleigh-Ritz on the found vectors, refined until residuals are small.

    Where the residual r = S x - λ x is too large, (S - shift I)⁻¹ r is taken from x. That is a step
    of inverse iteration. Its own errors are relative to r, so it removes what inexact solves
    left, above all on stiff vertices.

    Parameters
    ----------
    matrix : (n, n) sparse
        S, at area 1.
    factor : ShiftedFactor
        Of S at a shift inside the wanted range.
    vectors : (n, k) float64
        Span the wanted eigenspace, nearly; need not be orthonormal.

    Returns
    -------
    values : (k,) float64
        Ascending, in 1/area.
    vectors : (n, k) float64
        Orthonormal. None instead of both if a residual stays above `RESIDUAL` times 10.
    """
    values, vectors, residuals = _with_residuals(matrix, vectors)
    bad = np.arange(len(values))  # those still looked at
    for attempt in range(_REFINEMENTS):
        excess = np.linalg.norm(residuals, axis=0) - 10.0 * RESIDUAL * values[bad]
        above = np.flatnonzero(excess > 0.0)
        # The rounding error of S x itself is allowed for: on slivers it is all there is.
        rounding = np.linalg.norm(abs(matrix) @ np.abs(vectors[:, bad[above]]), axis=0)
        above = above[excess[above] > 64.0 * np.finfo(np.float64).eps * rounding]
        bad = bad[above]
        if len(bad) == 0:
            order = np.argsort(values, kind="stable")
            in_order = np.array_equal(order, np.arange(len(order)))
            return values[order], vectors if in_order else vectors[:, order]
        if attempt + 1 == _REFINEMENTS:
            break
        refined = vectors[:, bad] - factor.solve(residuals[:, above])
        along = vectors.T @ refined
        along[bad] = 0.0
        refined -= vectors @ along  # the good ones stay as they are
        values[bad], vectors[:, bad], residuals = _rayleigh_ritz(matrix, refined)
    return None


def _with_residuals(
    matrix: sparse.csc_array, vectors: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rayleigh quotients (k,), orthonormal vectors (n, k) and residuals S x - λ x (n, k).

    What is nearly orthonormal is made so to first order, for a third of the work of Rayleigh-Ritz.
    """
    gram = vectors.T @ vectors
    unit = np.eye(len(gram))
    if np.abs(gram - unit).max() > _NEARLY_ORTHONORMAL:
        return _rayleigh_ritz(matrix, vectors)
    vectors = vectors @ (1.5 * unit - 0.5 * gram)
    residuals = matrix @ vectors
    values = np.einsum("ij,ij->j", vectors, residuals)
    residuals -= values * vectors
    return values, vectors, residuals


def _rayleigh_ritz(
    matrix: sparse.csc_array, vectors: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same of the best eigenpairs that the span of the vectors has, in ascending order."""
    image = matrix @ vectors
    energy = vectors.T @ image
    values, rotation = scipy.linalg.eigh(0.5 * (energy + energy.T), vectors.T @ vectors)
    vectors = vectors @ rotation
    residuals = image @ rotation
    residuals -= values * vectors
    return values, vectors, residuals


def _trace(matrix: sparse.csc_array, zero_mode: FloatArray) -> float:
    """Trace of W: about 4n on a good mesh, more by a cotangent for every sliver."""
    return float(matrix.diagonal() @ zero_mode**2)
