"""Distributions of distances and of values on a surface, by area."""

from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, read_only


@dataclass(frozen=True, eq=False)
class Distribution:
    """A measure on [0, ∞) in bins, read-only.

    Attributes
    ----------
    edges : (b + 1,) float64
        Bounds of the bins, ascending.
    density : (b,) float64
        f of eq. (6): measure a unit of the axis; the last bin also holds all that lies above.
    cdf : (b,) float64
        F of eq. (6) at the upper edge of each bin; its last entry is the whole measure.
    """

    edges: FloatArray
    density: FloatArray
    cdf: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("edges", "density", "cdf"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))

    @property
    def masses(self) -> FloatArray:
        """Measure of each bin, (b,): density times width."""
        masses: FloatArray = np.diff(self.cdf, prepend=0.0)
        return masses


def distance_distribution(
    distances: FloatArray, weights: FloatArray, edges: FloatArray, *, normalised: bool = True
) -> Distribution:
    """Distribution of distances under the product measure, eq. (6).

    Every ordered pair (i, j) counts w_i w_j, the diagonal included: it is part of the square of X.

    Parameters
    ----------
    distances : (s, s) float64
        Symmetric, not negative.
    weights : (s,) float64
        Area that each sampled point stands for.
    edges : (b + 1,) float64
        Ascending, starting at 0 or above; smaller values count into the first bin, larger ones
        into the last.
    normalised : bool
        Divide by the whole measure F(∞), the squared area.

    Returns
    -------
    Distribution
    """
    i, j = np.triu_indices(len(weights))
    pairs = weights[i] * weights[j] * np.where(i == j, 1.0, 2.0)  # (s (s + 1) / 2,)
    return value_distribution(distances[i, j], pairs, edges, normalised=normalised)


def value_distribution(
    values: FloatArray, weights: FloatArray, edges: FloatArray, *, normalised: bool = True
) -> Distribution:
    """Distribution of values, each with its weight: k(x,x) over the surface, for instance.

    Parameters
    ----------
    values, weights : (n,) float64
    edges : (b + 1,) float64
        Ascending; a value on an inner edge counts into the bin above it, values beyond either
        end into the outermost bin.
    normalised : bool
        Divide by the sum of the weights.

    Returns
    -------
    Distribution

    Raises
    ------
    InvalidRequestError
        The edges do not ascend, or normalised weights sum to 0.
    """
    widths = np.diff(edges)
    if len(widths) < 1 or not np.all(widths > 0):
        raise InvalidRequestError("edges of a distribution must ascend and be at least 2")
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(widths) - 1)  # (n,)
    counted = np.bincount(bins, weights=weights, minlength=len(widths))  # (b,)
    masses = np.asarray(counted, dtype=np.float64)
    if normalised:
        total = float(masses.sum())
        if not total > 0.0:
            raise InvalidRequestError(f"the weights sum to {total:g}, expected more than 0")
        masses = masses / total
    return Distribution(edges, masses / widths, np.cumsum(masses))


def weighted_mean(values: FloatArray, weights: FloatArray) -> float:
    """Mean of (n,) values under (n,) weights; of an (s, s) matrix under their product measure."""
    if values.ndim == 2:
        values = (values * weights).sum(axis=1) / weights.sum()  # (s,)
    return float((values * weights).sum() / weights.sum())


def weighted_quantiles(values: FloatArray, weights: FloatArray, levels: FloatArray) -> FloatArray:
    """Quantiles of (n,) values at levels in (0, 1), (q,).

    Each value stands in the middle of its own weight, and between them the quantile is linear,
    so that it moves continuously with values and weights.
    """
    order = np.argsort(values, kind="stable")
    ordered = weights[order]
    places = (np.cumsum(ordered) - 0.5 * ordered) / ordered.sum()  # (n,)
    return np.interp(levels, places, values[order])
