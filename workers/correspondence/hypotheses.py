"""Maps as far as it takes to compare them: from landmarks, and as twins of each other.

Left and right of most shapes are exchanged by a map of the shape onto itself that reverses its
orientation. So each map has a twin: itself, and that map after it. Where landmarks were found for
the wrong one of both, the twin is the right one.
"""

from dataclasses import dataclass

import numpy as np

from workers.correspondence.confidence import landmark_agreement
from workers.correspondence.functional_map import (
    Matches,
    Pair,
    embeddings,
    nearest_rows,
    zoom_out,
)
from workers.correspondence.handedness import orientation
from workers.correspondence.landmarks import landmarks
from workers.correspondence.sides import Sides
from workers.geometry.arrays import FloatArray, IntArray

# Chosen on creatures of the training species.
TRIED = 2  # sets of landmarks for each orientation
FIRST_COUNTS = (10, 13, 17, 22, 28, 36)  # functions while hypotheses are compared,
_TWIN_COUNTS = (17, 22, 28, 36)  # and of a twin
_SAMPLES, _TARGETS = 500, 2500  # vertices that are matched, and that they are matched with
_HINT = 0.7  # weight of handedness beside functions
_CLEARLY, _LITTLE = 0.65, 1.0  # of the other orientation's misfit; misfits that are no reason


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A map as far as it takes to compare it with others.

    Attributes
    ----------
    pair : Pair
        What is mapped.
    start : Matches
        What it was made from.
    images : (n,) int64
        Vertex of the whole for each vertex of the part.
    misfit : float
        How badly it fits: the smaller the better.
    orientation : float
        How far it keeps the orientation, from -1 to 1.
    """

    pair: Pair
    start: Matches
    images: IntArray
    misfit: float
    orientation: float


def from_landmarks(sides: Sides, hand: float) -> list[Hypothesis]:
    """Maps that should keep the orientation, or reverse it.

    Parameters
    ----------
    sides : Sides
        Both shapes.
    hand : float
        1 to keep it, -1 to reverse it.

    Returns
    -------
    list of Hypothesis
        At least one; they may turn out to do the other.
    """
    part, whole = sides.part, sides.whole
    one, other = hand * sides.hands[0], sides.hands[1]
    costs = sides.costs.with_hands(one[part.points], other[whole.points])
    pair = Pair(part, whole, min(1.0, sides.scale**2), (one, other), sides.is_part)
    hint = 0.0 if sides.is_part else _HINT
    found = []
    for one_set in landmarks(part, whole, costs, scale=sides.scale, count=TRIED):
        weights = part.weights * one_set.support + 1e-9
        start = Matches(part.points, whole.points[one_set.places], weights)
        found.append(_refined(sides, pair, start, FIRST_COUNTS, hint=hint))
    return found


def twins(sides: Sides, tried: list[Hypothesis], hand: float) -> list[Hypothesis]:
    """Twins of those maps that turned out to have the other orientation.

    Parameters
    ----------
    sides : Sides
        Both shapes.
    tried : list of Hypothesis
        What landmarks gave.
    hand : float
        1 if maps are wanted that keep the orientation, -1 for those that reverse it.

    Returns
    -------
    list of Hypothesis
        None where the whole has no reflection.
    """
    wrong = [one for one in tried if one.orientation * hand < 0.0]
    reflected = _reflection(sides) if wrong else None
    if reflected is None:
        return []
    samples = sides.part.spread(_SAMPLES)
    areas = sides.part.spectrum.areas[samples]
    found = []
    for one in wrong:
        start = Matches(samples, reflected[one.images[samples]], areas)
        found.append(_refined(sides, one.pair, start, _TWIN_COUNTS))
    return found


def best(tried: list[Hypothesis], hand: float) -> Hypothesis | None:
    """The map of an orientation that fits best.

    Parameters
    ----------
    tried : list of Hypothesis
        Of any orientation.
    hand : float
        1 or -1.

    Returns
    -------
    Hypothesis or None
        Of this orientation, as it turned out.
    """
    right = [one for one in tried if one.orientation * hand > 0.0]
    return min(right, key=lambda one: one.misfit) if right else None


def choose(tried: list[Hypothesis], hands: tuple[float, ...]) -> Hypothesis:
    """The map of the first orientation, unless one of the other is clearly better.

    Parameters
    ----------
    tried : list of Hypothesis
        At least one.
    hands : tuple of float
        Orientations that are looked for.

    Returns
    -------
    Hypothesis
        Of any orientation where there is none of those.
    """
    found = [one for one in (best(tried, hand) for hand in hands) if one is not None]
    if not found:
        return min(tried, key=lambda one: one.misfit)
    return found[-1] if _clearly_better(found[-1], found[0]) else found[0]


def is_mirrored(tried: list[Hypothesis]) -> bool | None:
    """Whether the shapes are mirrored, if that can be known.

    Parameters
    ----------
    tried : list of Hypothesis
        At least one.

    Returns
    -------
    bool or None
        None where both orientations fit about as well.
    """
    kept, reversed_ = (best(tried, hand) for hand in (1.0, -1.0))
    if kept is None or reversed_ is None:
        return None if kept is reversed_ else kept is None
    if _clearly_better(reversed_, kept):
        return True
    return False if _clearly_better(kept, reversed_) else None


def _clearly_better(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether a map fits so much better than another that no chance explains it."""
    return one.misfit + _LITTLE < _CLEARLY * (other.misfit + _LITTLE)


def _refined(
    sides: Sides,
    pair: Pair,
    start: Matches,
    counts: tuple[int, ...],
    *,
    hint: float = 0.0,
) -> Hypothesis:
    """Refine a map, and see how well it fits."""
    part, whole = pair.part, pair.whole
    functional, _ = zoom_out(
        pair,
        start,
        counts=counts,
        samples=part.spread(_SAMPLES),
        targets=whole.spread(_TARGETS),
        hint=hint,
    )
    images, residuals = _images(pair, functional, _TARGETS)
    agreed = landmark_agreement(part, whole, images, scale=sides.scale)
    areas = part.spectrum.areas
    misfit = float(areas @ residuals / (areas @ agreed))
    return Hypothesis(pair, start, images, misfit, orientation(part, whole, images))


def _images(pair: Pair, functional: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """Images among so many vertices of the whole, and how far apart the rows of both are."""
    rows, columns = embeddings(pair, functional)
    judged = pair.whole.spread(count)
    images = judged[nearest_rows(rows, columns[judged])]
    residuals: FloatArray = np.sqrt(np.square(rows - columns[images]).sum(axis=1))
    return images, residuals


def _reflection(sides: Sides) -> IntArray | None:
    """A map of the whole onto itself that reverses the orientation, if there is one: (m,)."""
    whole, hands = sides.whole, sides.hands[1]
    few = whole.with_points(len(sides.own.values))
    costs = sides.own.with_hands(-hands[few.points], hands[whole.points])
    found = landmarks(few, whole, costs, scale=1.0, count=1)[0]
    pair = Pair(few, whole, 1.0, (-hands, hands), is_part=False)
    weights = few.weights * found.support + 1e-9
    functional, _ = zoom_out(
        pair,
        Matches(few.points, whole.points[found.places], weights),
        counts=FIRST_COUNTS,
        samples=whole.spread(_SAMPLES),
        targets=whole.spread(_TARGETS),
        hint=_HINT,
    )
    images, _ = _images(pair, functional, whole.mesh.n_vertices)
    return images if orientation(whole, whole, images) < 0.0 else None
