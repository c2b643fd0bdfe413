"""The smallest quotient aᵀ(P + ηR)a / aᵀNa: eq. (13) in closed form, and with a >= 0."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import minimize

from workers.geometry.arrays import FloatArray

RIDGE = 1e-12
"""Added to the numerator, as this share of the diagonal of N. It decides what rounding leaves open,
as between two functions that are equal on all eigenvalues; no quotient moves by more."""

_NOTHING = 1e-9  # of the largest coefficient: what is 0


def numerator(positive: FloatArray, roughness: FloatArray, negative: FloatArray) -> FloatArray:
    """P + ηR with the ridge: what both solutions put above N, eq. (13).

    Parameters
    ----------
    positive, negative : (q, q) float64
        P and N of eq. (10), symmetric.
    roughness : (q, q) float64
        ηR of eq. (12), symmetric.

    Returns
    -------
    (q, q) float64
        Symmetric, positive definite where N is.
    """
    return positive + roughness + RIDGE * np.diag(np.diag(negative))


def quotient(coefficients: FloatArray, above: FloatArray, below: FloatArray) -> float:
    """Quotient of two quadratic forms, eq. (10).

    Parameters
    ----------
    coefficients : (q,) float64
        a.
    above, below : (q, q) float64
        Symmetric.

    Returns
    -------
    float
        aᵀ above a / aᵀ below a.
    """
    return float((coefficients @ above @ coefficients) / (coefficients @ below @ coefficients))


def closed_form(above: FloatArray, below: FloatArray) -> FloatArray:
    """Minimiser (q,) of the quotient over all a: the eigenvector of eq. (13).

    It minimises (P + ηR)/N. The line above it in the paper, P/N + η aᵀRa, is another function: the
    smaller the scale of a, the less it is, so it has no minimum. Solved as the largest
    eigenvalue of N against P + ηR, so that N may be singular. The sign is that of the larger part.

    Parameters
    ----------
    above : (q, q) float64
        Symmetric, positive definite, see `numerator`.
    below : (q, q) float64
        Symmetric, positive semidefinite.

    Returns
    -------
    (q,) float64
        Of largest entry 1 in absolute value.
    """
    scale = 1.0 / np.sqrt(np.diag(above))
    scaling = np.outer(scale, scale)
    last = len(scale) - 1
    _, vectors = eigh(below * scaling, above * scaling, subset_by_index=[last, last])
    coefficients: FloatArray = scale * vectors[:, 0]
    if abs(coefficients.min()) > abs(coefficients.max()):
        coefficients = -coefficients
    return np.asarray(coefficients / np.abs(coefficients).max())


def nonnegative_minimum(
    above: FloatArray, below: FloatArray, starts: Sequence[FloatArray]
) -> FloatArray:
    """Minimiser (q,) of the quotient over a >= 0, eq. (10), from several starts.

    L-BFGS-B improves each start on the logarithm of the quotient with the bounds a >= 0. The closed
    form then improves it on those coefficients that are not 0. The best of all is kept, so no start
    is better than the result.

    Parameters
    ----------
    above, below : (q, q) float64
        As for `closed_form`.
    starts : sequence of (q,) float64
        Not negative, not 0.

    Returns
    -------
    (q,) float64
        Not negative, of largest entry 1.
    """
    scale = 1.0 / np.sqrt(np.diag(above))
    scaling = np.outer(scale, scale)
    above, below = above * scaling, below * scaling

    def descend(point: FloatArray) -> tuple[float, FloatArray]:
        upper, lower = above @ point, below @ point
        top, bottom = float(point @ upper), float(point @ lower)
        if not (top > 0.0 and bottom > 0.0):
            return np.inf, np.zeros_like(point)
        return float(np.log(top / bottom)), 2.0 * (upper / top - lower / bottom)

    candidates = []
    for start in starts:
        point = np.maximum(start, 0.0) / scale
        point = point / np.linalg.norm(point)
        found = minimize(
            descend,
            point,
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, None)] * len(point),
            options={"maxiter": 2000, "maxfun": 4000, "ftol": 1e-15, "gtol": 1e-9, "maxcor": 30},
        )
        point_found = np.maximum(found.x, 0.0)
        candidates += [point, point_found, *_polished(point_found, above, below)]
    best = min(candidates, key=lambda point: descend(point)[0])
    coefficients: FloatArray = scale * best
    return np.asarray(coefficients / coefficients.max())


def _polished(point: FloatArray, above: FloatArray, below: FloatArray) -> list[FloatArray]:
    """The exact minimiser on the support of a point, if that is not negative either."""
    support = np.flatnonzero(point > _NOTHING * point.max())
    window = np.ix_(support, support)
    inner = closed_form(above[window], below[window])
    if inner.min() < 0.0:
        return []
    polished = np.zeros_like(point)
    polished[support] = inner
    return [polished]
