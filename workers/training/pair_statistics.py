"""P and N of eq. (10) from the moments of pairs of shapes, for any basis of functions."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.training.moments import Columns, PairMoments


@dataclass(frozen=True, eq=False)
class PairStatistics:
    """P and N of eq. (10) as sums over pairs of shapes; those of a union are the sum.

    Attributes
    ----------
    positive, negative : (q, q) float64
        Each pair of shapes adds the mean over its pairs of points.
    n_positive, n_negative : float
        Pairs of shapes, so that means can be compared.
    """

    positive: FloatArray
    negative: FloatArray
    n_positive: float
    n_negative: float

    def __add__(self, other: "PairStatistics") -> "PairStatistics":
        """Statistics of the union."""
        return PairStatistics(
            *(getattr(self, field.name) + getattr(other, field.name) for field in fields(self))
        )

    @property
    def means(self) -> tuple[FloatArray, FloatArray]:
        """P and N as means over pairs of shapes."""
        return self.positive / self.n_positive, self.negative / self.n_negative


@dataclass(frozen=True, eq=False)
class ShapeMoments:
    """Sums over the pairs (X, Y) of a class, of moments in a basis; those of a union are the sum.

    Attributes
    ----------
    count : int
        Pairs.
    positive : (q, q) float64
        Of the difference between X and Y at corresponding points, (u - v)(u - v)ᵀ.
    second, transformed_second : (q, q) float64
        Of u uᵀ on X and v vᵀ on Y.
    mean, transformed_mean : (q,) float64
        Of u and v.
    """

    count: int
    positive: FloatArray
    second: FloatArray
    transformed_second: FloatArray
    mean: FloatArray
    transformed_mean: FloatArray

    def __add__(self, other: "ShapeMoments") -> "ShapeMoments":
        """Moments of the union."""
        return ShapeMoments(
            *(getattr(self, field.name) + getattr(other, field.name) for field in fields(self))
        )

    @property
    def statistics_within(self) -> PairStatistics:
        """Positives, and no negatives."""
        return PairStatistics(self.positive, np.zeros_like(self.positive), self.count, 0)


def shape_moments(moments: PairMoments, functions: Columns, unit: str) -> ShapeMoments:
    """Moments of one pair of shapes in the functions in which K² is written.

    Parameters
    ----------
    moments : PairMoments
        Of X and Y.
    functions : callable
        S of eq. (11): from eigenvalues in the unit to (k, q).
    unit : str
        "none", "area" or "first-eigenvalue".

    Returns
    -------
    ShapeMoments
        Of one pair of shapes.
    """
    first, second = moments.columns(functions, unit)
    k = len(first)
    gram = moments.gram
    own = first.T @ gram[:k, :k] @ first
    other = second.T @ gram[k:, k:] @ second
    cross = first.T @ gram[:k, k:] @ second
    return ShapeMoments(
        count=1,
        positive=own + other - cross - cross.T,
        second=own,
        transformed_second=other,
        mean=moments.mean[:k] @ first,
        transformed_mean=moments.mean[k:] @ second,
    )


def negatives_between(first: ShapeMoments, second: ShapeMoments) -> PairStatistics:
    """Negatives between every X of one class and every Y of another, without enumerating them.

    Values at pairs of points that do not correspond are independent. The mean of (u - v)(u - v)ᵀ
    is therefore E[u uᵀ] + E[v vᵀ] - E[u] E[v]ᵀ - E[v] E[u]ᵀ.

    Parameters
    ----------
    first, second : ShapeMoments
        Sums over the pairs of two classes.

    Returns
    -------
    PairStatistics
        Negatives, and no positives.
    """
    cross = np.outer(first.mean, second.transformed_mean)
    negative = (
        second.count * first.second + first.count * second.transformed_second - cross - cross.T
    )
    return PairStatistics(np.zeros_like(negative), negative, 0, first.count * second.count)


def pair_statistics(
    classes: Mapping[str, ShapeMoments], queries: Iterable[str] | None = None
) -> PairStatistics:
    """P and N of several classes.

    Parameters
    ----------
    classes : Mapping
        Moments by the class's label; at least two.
    queries : iterable of str, optional
        Only pairs in which one of these classes takes part.

    Returns
    -------
    PairStatistics
        Positives within the classes, negatives between them.
    """
    chosen = set(classes if queries is None else queries)
    parts = [moments.statistics_within for label, moments in classes.items() if label in chosen]
    for label, moments in classes.items():
        for other, others in classes.items():
            if label != other and chosen & {label, other}:
                parts.append(negatives_between(moments, others))
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total
