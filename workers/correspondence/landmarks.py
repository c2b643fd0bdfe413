"""Consistent landmarks: matches of points that agree on distances along the surface.

Two matches agree where the distance between both points is the same on both surfaces. The matches
that agree most are the first eigenvector of the matrix of agreements (Leordeanu, Hebert 2005). A
symmetric shape has several such sets of matches: what was found is taken out, and looked again.
"""

from dataclasses import dataclass

import numpy as np

from workers.correspondence.surface import Surface
from workers.geometry.arrays import BoolArray, FloatArray, IntArray

# Chosen on creatures of the training species; distances are in √A.
CANDIDATES = 6  # points of the larger surface for each point of the other
_NEAR = 0.12  # matches so near to those that were found are taken out
_ROUNDS = 15  # of the power iteration
_COARSE, _FINE, _SHARE = 0.03, 0.035, 0.02  # differences of distances that are usual
_SLACKS = (0.06, 0.06, 0.03, 0.03, 0.0, 0.0)  # rounds of refinement, ever stricter
_PLACES = 32  # to which a match may move in a round
_STRONG = 0.3  # of what the strongest quarter has


@dataclass(frozen=True, eq=False)
class Landmarks:
    """A point of one surface for each point of another.

    Attributes
    ----------
    places : (s,) int64
        Place of the match among the points of the larger surface.
    support : (s,) float64
        Share of the other landmarks, by area, that agree with each; 0 to 1.
    """

    places: IntArray
    support: FloatArray


def landmarks(
    part: Surface, whole: Surface, costs: FloatArray, *, scale: float, count: int
) -> list[Landmarks]:
    """Find sets of matches that agree on distances, one after the other.

    Parameters
    ----------
    part : Surface
        Of s points.
    whole : Surface
        Of t points.
    costs : (s, t) float64
        Of matching each point with each, in units of usual costs.
    scale : float
        Lengths on the part, times this, are lengths on the whole.
    count : int
        How many sets.

    Returns
    -------
    list of Landmarks
        At least one, at most ``count``.
    """
    distances = scale * part.mutual
    width = min(CANDIDATES, costs.shape[1])
    tried = np.argsort(costs, axis=1, kind="stable")[:, :width]  # (s, c)
    usual = float(np.median(costs.min(axis=1))) + 1e-9
    owner = np.repeat(np.arange(len(costs)), width)
    place = tried.ravel()
    likeness = 1.0 / (1.0 + costs[owner, place] / (2.0 * usual))
    agreements = _agreements(distances, whole.mutual, owner, place, likeness)
    alive = np.ones(len(owner), dtype=np.bool_)
    found: list[Landmarks] = []
    while len(found) < count and (not found or alive.sum() >= 3 * width):
        strength = _strongest(agreements, alive, likeness * part.weights[owner])
        by_point = strength.reshape(-1, width)  # (s, c)
        chosen = tried[np.arange(len(tried)), by_point.argmax(axis=1)]
        start = _without_weak(by_point.max(axis=1))
        likely = 1.0 / (1.0 + costs / (4.0 * usual))
        found.append(_refined(part, whole, distances, chosen, start, likely))
        alive &= whole.mutual[place, found[-1].places[owner]] >= _NEAR
    return found


def _agreements(
    first: FloatArray, second: FloatArray, owner: IntArray, place: IntArray, likeness: FloatArray
) -> FloatArray:
    """How well each two matches agree, (c, c); two of one point do not."""
    apart = first[np.ix_(owner, owner)]
    off = np.abs(apart - second[np.ix_(place, place)])
    usual = 3.0 * (_COARSE + _SHARE * apart) + _COARSE
    agreements: FloatArray = np.square(np.maximum(1.0 - np.square(off / usual), 0.0))
    agreements *= np.sqrt(likeness)[:, None] * np.sqrt(likeness)
    agreements[owner[:, None] == owner] = 0.0
    return agreements


def _strongest(agreements: FloatArray, alive: BoolArray, start: FloatArray) -> FloatArray:
    """First eigenvector (c,) among the matches that are left."""
    strength: FloatArray = alive * start
    for _ in range(_ROUNDS):
        strength = alive * (agreements @ strength)
        strength /= max(float(np.linalg.norm(strength)), 1e-30)
    return strength


def _without_weak(strength: FloatArray) -> FloatArray:
    """Strengths (s,), those far below the strongest quarter at 0."""
    top = np.sort(strength)[-max(1, len(strength) // 4) :].mean()
    kept: FloatArray = np.where(strength > _STRONG * top, strength, 0.0)
    return kept if kept.any() else np.ones(len(strength))


def _refined(
    part: Surface,
    whole: Surface,
    distances: FloatArray,
    places: IntArray,
    weights: FloatArray,
    likely: FloatArray,
) -> Landmarks:
    """Move each match to where most others agree with it, in rounds."""
    nearest = np.argsort(whole.mutual, axis=1, kind="stable")[:, :_PLACES]  # (t, p)
    support = weights
    for number, slack in enumerate(_SLACKS):
        if number < 2:  # first anywhere, then near by
            around = np.broadcast_to(np.arange(len(whole.points)), (len(places), len(whole.points)))
        else:
            around = nearest[places]
        counted = part.weights * weights
        total = max(float(counted.sum()), 1e-30)
        strong = np.flatnonzero(counted > 0.0)
        there = whole.mutual[around[:, :, None], places[strong]]  # (s, p, s')
        off = distances[:, None, strong] - there
        usual = _FINE + slack + _SHARE * distances[:, None, strong]
        agreed = (1.0 / (1.0 + np.square(off / usual))) @ (counted[strong] / total)  # (s, p)
        liked = agreed * np.take_along_axis(likely, around, axis=1) ** 0.25
        best = liked.argmax(axis=1)[:, None]
        places = np.take_along_axis(around, best, axis=1)[:, 0]
        support = np.take_along_axis(agreed, best, axis=1)[:, 0]
        weights = np.square(support)
    return Landmarks(places, support)
