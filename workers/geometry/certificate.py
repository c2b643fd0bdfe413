"""What turns Ritz pairs into a result: the count by inertia, and the residuals."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy import sparse

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.inertia import ShiftedFactor, factorise_between

RESIDUAL = 1e-10
"""Relative residual that the search must reach; ten times that is accepted in the end."""

_GAP = 1e-8  # relative width of a gap between eigenvalues in which the certificate can stand


@dataclass(frozen=True, eq=False)
class Candidate:
    """Eigenvalues seen through a Krylov space, ascending, with bounds and where they come from."""

    values: FloatArray  # (m,)
    lower: FloatArray  # (m,) an eigenvalue lies between lower and upper
    upper: FloatArray  # (m,)
    indices: IntArray  # (m,) of the Ritz pairs


def is_certified(
    matrix: sparse.csc_array, zero_mode: FloatArray, candidate: Candidate, count: int
) -> bool:
    """Whether the inertia in a gap at the k-th eigenvalue equals the number found below it.

    The gap lies above the k-th eigenvalue, after as many more as belong to its cluster. Where not
    all of a cluster was found the gap below it serves, if the cluster is so narrow that it does
    not matter which of its members were taken. A rounding error E of the factor moves an eigenvalue
    by φᵀEφ, about its relative size times the trace of W at most; the gap must be wider.
    """
    values = candidate.values
    widths = (candidate.lower[1:] - candidate.upper[:-1]) / values[1:]  # (m - 1,): after i + 1
    above = [m for m in range(count, len(values)) if widths[m - 1] > _GAP]
    comfortable = [m for m in above[:8] if widths[m - 1] > 1e-4]
    gaps = [(m, candidate.upper[m - 1], candidate.lower[m]) for m in (comfortable or above)[:1]]
    first = int(np.searchsorted(values, values[count - 1] * (1.0 - _GAP)))  # of the cluster
    floor = max(candidate.upper[first - 1] if first > 0 else 0.0, values[first] * (1.0 - _GAP))
    gaps.append((first, floor, candidate.lower[first]))
    for found, low, high in gaps:
        factor = factorise_between(matrix, low, high) if low < high else None
        if factor is not None and factor.n_below == found + 1:  # and the zero mode
            uncertainty = 2.0 * factor.backward_error * _trace(matrix, zero_mode)
            return bool(low + uncertainty < factor.shift < high - uncertainty)
    return False


def polished(
    matrix: sparse.csc_array, factor: ShiftedFactor, vectors: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Rayleigh-Ritz on the found vectors (n, k); None if a residual stays above what is promised.

    Where the residual r = S x - λ x is too large, (S - shift I)⁻¹ r is taken from x: a step of
    inverse iteration whose own errors are relative to r, so that it removes what inexact solves
    left, above all on stiff vertices. The rounding error of S x itself is allowed for: on slivers
    it is all there is.
    """
    for _ in range(3):
        image = matrix @ vectors  # (n, k)
        energy = vectors.T @ image
        values, rotation = scipy.linalg.eigh(0.5 * (energy + energy.T), vectors.T @ vectors)
        vectors = vectors @ rotation
        residuals = image @ rotation - values * vectors  # (n, k)
        rounding = np.linalg.norm(abs(matrix) @ np.abs(vectors), axis=0)
        allowed = 10.0 * RESIDUAL * values + 64.0 * np.finfo(np.float64).eps * rounding
        if np.all(np.linalg.norm(residuals, axis=0) <= allowed):
            return values, vectors
        vectors = vectors - factor.solve(residuals)
    return None


def _trace(matrix: sparse.csc_array, zero_mode: FloatArray) -> float:
    """Trace of W: about 4n on a good mesh, more by a cotangent for every sliver."""
    return float(matrix.diagonal() @ zero_mode**2)
