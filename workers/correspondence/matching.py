"""Dense correspondence of two solved shapes."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from workers.correspondence.confidence import confidences, landmark_agreement
from workers.correspondence.fields import Images, bending, stretch
from workers.correspondence.functional_map import (
    Matches,
    Pair,
    embeddings,
    nearest_rows,
    zoom_out,
)
from workers.correspondence.handedness import alike_in_size, handedness, orientation
from workers.correspondence.landmarks import landmarks
from workers.correspondence.precise import points_on_faces
from workers.correspondence.surface import Surface
from workers.correspondence.windows import candidates
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.solution import Solution
from workers.geometry.topology import count_components, is_closed

CORRESPONDENCES_VERSION = "1"
"""Part of the key of what is stored: raised when the same meshes have another correspondence."""

# Chosen on creatures of the training species.
POINTS, MORE_POINTS = 96, 192  # of the part and of the whole
TRIED = 2  # sets of landmarks for each orientation
FIRST_COUNTS = (10, 13, 17, 22, 28, 36)  # functions while hypotheses are compared,
LAST_COUNTS = (46, 60, 78, 100, 120)  # and of the one that is kept
_SAMPLES, _TARGETS, _MORE_SAMPLES, _JUDGED = 300, 1200, 800, 2500
_HAND = 3.0  # numbers of a window that handedness counts as much as
_HINT = 0.7  # weight of handedness beside functions
_CLEARLY, _LITTLE = 0.65, 1.0  # of the other orientation's misfit; misfits that are no reason
_COVERED = 2.0  # mean edges from an image


@dataclass(frozen=True, eq=False)
class Correspondence:
    """A point of the second shape for each vertex of the first; arrays are read-only.

    Attributes
    ----------
    scale : float
        Lengths on the second shape over those on the first, in the units of both.
    mirrored : bool or None
        Whether the map reverses the orientation. None where a map that keeps it fits as well as
        one that reverses it: then this one keeps it.
    coverage : float
        Share of the second shape's area that has a counterpart on the first.
    faces : (n,) int64
        Face of the second shape for each vertex of the first.
    barycentric : (n, 3) float64
        Place in the face: not negative, rows of sum 1.
    confidence : (n,) float64
        From 0 to 1: how likely the point lies within 0.05 √A of the true one.
    stretch : (n,) float64
        ln of the ratio of areas beyond that of the scale.
    bending : (n,) float64
        Change of the mean curvature after scaling, in units of 1 / √A of the first shape.
    covered : (m,) float64
        For each vertex of the second shape whether it has a counterpart, 0 or 1.
    """

    scale: float
    mirrored: bool | None
    coverage: float
    faces: IntArray
    barycentric: FloatArray
    confidence: FloatArray
    stretch: FloatArray
    bending: FloatArray
    covered: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "faces", read_only(self.faces, np.int64))
        for name in ("barycentric", "confidence", "stretch", "bending", "covered"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))


def correspond(
    first: Solution, second: Solution, *, mirrored: bool | None = None
) -> Correspondence:
    """Find the point of the second shape for each vertex of the first one's working mesh.

    Parameters
    ----------
    first, second : Solution
        Working meshes, not doubled, with their spectra. A shape that has a boundary may be a part
        of the other.
    mirrored : bool, optional
        Look only for a map that reverses the orientation, or only for one that keeps it.

    Returns
    -------
    Correspondence
        Faces are those of the second working mesh.
    """
    sides = _assigned(first, second)
    hands = (1.0, -1.0) if mirrored is None else (-1.0 if mirrored else 1.0,)
    tried = [one for hand in hands for one in _hypotheses(sides, hand)]
    chosen = _chosen(tried, hands)
    maps = _refined(sides, chosen)
    return _answer(sides, maps, _told(tried) if mirrored is None else mirrored)


@dataclass(frozen=True, eq=False)
class _Sides:
    """Which of both shapes is the part, and what of it looks like what of the whole."""

    part: Surface
    whole: Surface
    is_swapped: bool
    scale: float
    costs: FloatArray
    counts: FloatArray
    hands: tuple[FloatArray, FloatArray]
    is_part: bool


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """A map as far as it takes to compare it with others."""

    hand: float
    places: IntArray
    support: FloatArray
    pair: Pair
    functional: FloatArray
    matches: Matches
    misfit: float
    orientation: float


@dataclass(frozen=True, eq=False)
class _Maps:
    """Vertex maps in both directions, the rows they compare, and whether they turn faces over."""

    to_whole: IntArray
    to_part: IntArray
    rows: tuple[FloatArray, FloatArray]
    is_mirrored: bool


def _assigned(first: Solution, second: Solution) -> _Sides:
    """Find out which shape is a part of the other, and at which scale."""
    may_be_part = _may_be_part(first, second), _may_be_part(second, first)
    ways = [False, True] if all(may_be_part) else [may_be_part[1]]
    tried = []
    for swapped in ways:
        part, whole = (second, first) if swapped else (first, second)
        one, other = Surface.of(part, POINTS), Surface.of(whole, MORE_POINTS)
        found = candidates(one, other, is_part=any(may_be_part))
        tried.append((found, swapped, one, other))
    found, is_swapped, one, other = min(tried, key=lambda way: way[0].misfit)
    is_part = any(may_be_part)
    fields = alike_in_size(
        handedness(one, found.scale, is_local=is_part),
        handedness(other, 1.0, is_local=is_part),
    )
    return _Sides(one, other, is_swapped, found.scale, found.costs, found.counts, fields, is_part)


def _may_be_part(one: Solution, other: Solution) -> bool:
    """Whether a shape has a boundary, or fewer components than another."""
    if not is_closed(one.mesh):
        return True
    return count_components(one.mesh) < count_components(other.mesh)


def _hypotheses(sides: _Sides, hand: float) -> list[_Hypothesis]:
    """Maps that keep the orientation (hand 1) or reverse it (hand -1)."""
    part, whole = sides.part, sides.whole
    one, other = hand * sides.hands[0], sides.hands[1]
    points, others = one[part.points], other[whole.points]
    apart = np.square(points[:, None] - others[None]).mean(axis=2)  # (s, t)
    counts = sides.counts[:, None]
    costs = (sides.costs * counts + _HAND * apart) / (counts + _HAND)
    found = []
    for one_set in landmarks(part, whole, costs, scale=sides.scale, count=TRIED):
        share = min(1.0, sides.scale**2)
        pair = Pair(part, whole, share, (one, other), sides.is_part)
        start = Matches(
            part.points, whole.points[one_set.places], part.weights * one_set.support + 1e-9
        )
        samples, targets = part.spread(_SAMPLES), whole.spread(_TARGETS)
        functional, matches = zoom_out(
            pair,
            start,
            counts=FIRST_COUNTS,
            samples=samples,
            targets=targets,
            hint=0.0 if sides.is_part else _HINT,
        )
        rows, columns = embeddings(pair, functional)
        judged = whole.spread(_JUDGED)
        images = judged[nearest_rows(rows, columns[judged])]
        residual = np.sqrt(np.square(rows - columns[images]).sum(axis=1))
        agreed = landmark_agreement(part, whole, images, scale=sides.scale)
        found.append(
            _Hypothesis(
                hand=hand,
                places=one_set.places,
                support=one_set.support,
                pair=pair,
                functional=functional,
                matches=matches,
                misfit=float(part.spectrum.areas @ residual / (part.spectrum.areas @ agreed)),
                orientation=orientation(part, whole, images),
            )
        )
    return found


def _best(tried: list[_Hypothesis], hand: float) -> _Hypothesis | None:
    """The best map of an orientation, as it turned out."""
    right = [one for one in tried if one.orientation * hand > 0.0]
    return min(right, key=lambda one: one.misfit) if right else None


def _chosen(tried: list[_Hypothesis], hands: tuple[float, ...]) -> _Hypothesis:
    """The map that keeps the orientation, unless one that reverses it is clearly better."""
    found = [one for one in (_best(tried, hand) for hand in hands) if one is not None]
    if not found:
        return min(tried, key=lambda one: one.misfit)
    return found[-1] if _clearly_better(found[-1], found[0]) else found[0]


def _told(tried: list[_Hypothesis]) -> bool | None:
    """Whether the map is mirrored, if that can be told."""
    kept, reversed_ = (_best(tried, hand) for hand in (1.0, -1.0))
    if kept is None or reversed_ is None:
        return None if kept is reversed_ else kept is None
    if _clearly_better(reversed_, kept):
        return True
    return False if _clearly_better(kept, reversed_) else None


def _clearly_better(one: _Hypothesis, other: _Hypothesis) -> bool:
    """Whether a map fits so much better than another that no chance explains it."""
    return one.misfit + _LITTLE < _CLEARLY * (other.misfit + _LITTLE)


def _refined(sides: _Sides, chosen: _Hypothesis) -> _Maps:
    """Refine the chosen map with all vertices and more functions."""
    samples = sides.part.spread(_MORE_SAMPLES)
    everywhere = np.arange(sides.whole.mesh.n_vertices)
    functional, _ = zoom_out(
        chosen.pair,
        chosen.matches,
        counts=LAST_COUNTS,
        samples=samples,
        targets=everywhere,
        hint=0.0,
    )
    rows = embeddings(chosen.pair, functional)
    return _Maps(nearest_rows(*rows), nearest_rows(*rows[::-1]), rows, chosen.orientation < 0.0)


def _answer(sides: _Sides, maps: _Maps, mirrored: bool | None) -> Correspondence:
    """Points, fields and confidences for the vertices of the first shape."""
    source, target = sides.part, sides.whole
    forward, back, rows = maps.to_whole, maps.to_part, maps.rows
    scale = _fitted_scale(sides, forward)
    confident = confidences(source, target, forward, back, scale=scale)
    if sides.is_swapped:
        source, target, rows = target, source, rows[::-1]
        forward, back, scale = back, forward, 1.0 / scale
        confident = confident[::-1]
    faces, weights = points_on_faces(*rows, target.mesh, forward)
    images = Images(faces, weights)
    reach = _COVERED * max(source.spacing * scale, target.spacing)
    covered = (_from_images(target, forward, confident[0]) <= reach).astype(np.float64)
    return Correspondence(
        scale=scale * target.unit / source.unit,
        mirrored=mirrored,
        coverage=min(1.0, float(target.spectrum.areas @ covered) / target.spectrum.area),
        faces=faces,
        barycentric=weights,
        confidence=confident[0],
        stretch=stretch(source, target, images, scale, is_mirrored=maps.is_mirrored),
        bending=bending(source, target, images, scale),
        covered=covered,
    )


def _fitted_scale(sides: _Sides, images: IntArray) -> float:
    """Median ratio of distances between points of the part and between their images."""
    part, whole = sides.part, sides.whole
    places = whole.cells[images[part.points]]
    before, after = part.mutual, whole.mutual[np.ix_(places, places)]
    far = (before * sides.scale > 0.2) & (before < 3.0) & (after < 3.0) & (after > 0.0)
    if far.sum() < 20:
        return sides.scale
    return float(np.median(after[far] / before[far]))


def _from_images(target: Surface, images: IntArray, confidence: FloatArray) -> FloatArray:
    """Distance (m,) of each vertex of the target to the nearest image that is no mere guess."""
    sure = np.unique(images[confidence >= 0.25])
    if not len(sure):
        return np.full(target.mesh.n_vertices, np.inf)
    distances: FloatArray = dijkstra(target.graph, indices=sure, min_only=True)
    return distances
