"""Whether the nearest windows of a query lie on a candidate as they lie on the query (p).

Geodesic distances between points of a part are those on the whole, up to one scale. So matches of
points that do not belong together betray themselves by their distances to the others.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import BoolArray, FloatArray, IntArray

QUERY_POINTS = 48
"""So many first points of the query are matched."""

FIRST_CHOICES, LATER_CHOICES = 4, 16
"""Points of the candidate that a match is chosen from: at first, and in refinement."""

_STEPS = 10  # of the power iteration
_ROUNDS = 3  # of refinement
_SLACK, _SHARE = 0.03, 0.02  # tolerance of a distance D: slack + share · D, in √A
_WIDTH = 3.0  # times the tolerance, beyond which two matches exclude each other
_FINAL_SLACK = 0.035
_SCALES = (0.93, 1.07)  # the hypothesis fixes the scale up to this
_FITTING = 0.15  # relative difference up to which a pair of distances has a say in the scale
_FEWEST = 20  # pairs that a scale is fitted to


@dataclass(frozen=True, eq=False)
class Verified:
    """Consistent matches of a query's points.

    Attributes
    ----------
    consistency : float
        p in (0, 1): weighted mean over pairs of points of 1 / (1 + (ΔD / tolerance)²).
    scale : float
        Factor by which the query's distances fit best, beside the hypothesis.
    matches : (q,) int64
        Point of the candidate that each of the query's first points lies at.
    """

    consistency: float
    scale: float
    matches: IntArray


def verify(
    costs: NDArray[np.floating[Any]],
    counts: BoolArray,
    cells: FloatArray,
    query: FloatArray,
    candidate: FloatArray,
) -> Verified:
    """Match points so that distances agree.

    Parameters
    ----------
    costs : (q, f) float32
        Mean squared whitened differences of the query's points to the candidate's.
    counts : (q,) bool
        Query points of which any window counts.
    cells : (q,) float64
        Area of the cell of each point of the query.
    query : (q, q) float64
        Distances between the query's points, in the scale of the hypothesis.
    candidate : (f, f) float64
        Between the candidate's; both infinite between components.

    Returns
    -------
    Verified
    """
    weights = cells * counts
    if len(query) < 2 or len(candidate) < 2 or np.count_nonzero(weights) < 2:
        return Verified(0.0, 1.0, np.zeros(len(query), dtype=np.int64))
    known = np.isfinite(query)
    own = np.where(known, query, 0.0)
    matches = _first_matches(costs, weights, own, known, candidate)
    choices = _nearest(costs, LATER_CHOICES)  # (q, 16)
    liking = 1.0 / np.sqrt(1.0 + 0.5 * np.take_along_axis(costs, choices, axis=1))
    scale = 1.0
    for _ in range(_ROUNDS):
        scale = _fitted_scale(own, known, candidate[np.ix_(matches, matches)], scale)
        offered = candidate[choices][:, :, matches]  # (q, 16, q)
        agreement = _agreement(scale * own[:, None], known[:, None], offered)
        votes = (agreement * weights).sum(axis=2) * liking
        matches = choices[np.arange(len(choices)), votes.argmax(axis=1)]
    agreement = _agreement(scale * own, known, candidate[np.ix_(matches, matches)])
    pairs = np.outer(weights, weights)
    np.fill_diagonal(pairs, 0.0)
    return Verified(float((agreement * pairs).sum() / pairs.sum()), scale, matches)


def _first_matches(
    costs: NDArray[np.floating[Any]],
    weights: FloatArray,
    own: FloatArray,
    known: BoolArray,
    candidate: FloatArray,
) -> IntArray:
    """The matches (q,) that agree most with each other, by power iteration on their affinities."""
    choices = _nearest(costs, FIRST_CHOICES)
    liking = np.sqrt(1.0 / (1.0 + 0.5 * np.take_along_axis(costs, choices, axis=1))).ravel()
    owners = np.repeat(np.arange(len(choices)), choices.shape[1])
    pairs = np.ix_(owners, owners)
    there = candidate[np.ix_(choices.ravel(), choices.ravel())]
    tolerance = _WIDTH * (_SLACK + _SHARE * own[pairs])
    possible = known[pairs] & np.isfinite(there) & (owners[:, None] != owners)
    gaps = np.where(possible, np.abs(own[pairs] - np.where(possible, there, 0.0)), np.inf)
    affinities = np.square(np.maximum(1.0 - np.square(gaps / tolerance), 0.0))
    strength = liking * np.sqrt(weights[owners])
    affinities *= np.outer(strength, strength)
    support = np.ones(len(owners))
    for _ in range(_STEPS):
        support = affinities @ support
        support /= max(float(np.linalg.norm(support)), np.finfo(np.float64).tiny)
    best = support.reshape(choices.shape).argmax(axis=1)
    first: IntArray = choices[np.arange(len(choices)), best]
    return first


def _nearest(costs: NDArray[np.floating[Any]], count: int) -> IntArray:
    """The points (q, count) of the least cost, the first ones of those that are level."""
    order: IntArray = np.argsort(costs, axis=1, kind="stable")[:, :count]
    return order


def _fitted_scale(own: FloatArray, known: BoolArray, matched: FloatArray, before: float) -> float:
    """The scale by least squares over the pairs of distances that nearly agree."""
    usable = known & np.isfinite(matched) & (own > 0.0)
    distances = np.where(usable, matched, 0.0)
    near = usable & (np.abs(distances - before * own) < _FITTING * own)
    if np.count_nonzero(near) < _FEWEST:
        return before
    fitted = float((distances * own)[near].sum() / np.square(own[near]).sum())
    return float(np.clip(fitted, *_SCALES))


def _agreement(own: FloatArray, known: BoolArray, there: FloatArray) -> FloatArray:
    """1 / (1 + (ΔD / tolerance)²), 0 between components."""
    both = known & np.isfinite(there)
    gaps = np.where(both, there, own) - own
    agreement: FloatArray = both / (1.0 + np.square(gaps / (_FINAL_SLACK + _SHARE * own)))
    return agreement
