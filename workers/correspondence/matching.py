"""Dense correspondence of two solved shapes."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.csgraph import dijkstra

from workers.correspondence.confidence import confidences
from workers.correspondence.fields import Images, bending, stretch
from workers.correspondence.functional_map import embeddings, nearest_rows, zoom_out
from workers.correspondence.hypotheses import (
    Hypothesis,
    choose,
    from_landmarks,
    is_mirrored,
    twins,
)
from workers.correspondence.precise import points_on_faces
from workers.correspondence.sides import Sides
from workers.correspondence.surface import Surface
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.solution import Solution
from workers.retrieval.windows.whitening import Whitening

CORRESPONDENCES_VERSION = "2"
"""Part of the key of what is stored: raised when the same meshes have another correspondence."""

# Chosen on creatures of the training species.
LAST_COUNTS = (36, 46, 60, 78, 100, 120)  # functions of the map that is kept
_STIFFNESS = 3.0  # of the first of them, which is fitted to about a hundred matches
_USUAL = 0.1  # √A between a match and its image, beyond which it counts little
_SAMPLES = 800  # vertices that they are fitted to
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
    first: Solution, second: Solution, whitening: Whitening, *, mirrored: bool | None = None
) -> Correspondence:
    """Find the point of the second shape for each vertex of the first one's working mesh.

    Parameters
    ----------
    first, second : Solution
        Working meshes, not doubled, with their spectra. A shape that has a boundary may be a part
        of the other.
    whitening : Whitening
        How windows are compared; a model has it.
    mirrored : bool, optional
        Look only for a map that reverses the orientation, or only for one that keeps it.

    Returns
    -------
    Correspondence
        Faces are those of the second working mesh.
    """
    sides = Sides.of(first, second, whitening)
    hands = (1.0, -1.0) if mirrored is None else (-1.0 if mirrored else 1.0,)
    tried = [one for hand in (1.0, -1.0) for one in from_landmarks(sides, hand)]
    tried += twins(sides, tried, hands[0])
    maps = _refined(sides, choose(tried, hands))
    return _answer(sides, maps, is_mirrored(tried) if mirrored is None else mirrored)


@dataclass(frozen=True, eq=False)
class _Maps:
    """Vertex maps in both directions, the rows they compare, and whether they turn faces over."""

    to_whole: IntArray
    to_part: IntArray
    rows: tuple[FloatArray, FloatArray]
    is_mirrored: bool


def _refined(sides: Sides, chosen: Hypothesis) -> _Maps:
    """Refine the chosen map with all vertices and more functions."""
    part, whole = sides.part, sides.whole
    start = chosen.start
    # A map of few functions is smoother than shapes that stretch: so begin with its matches anew.
    places = whole.cells[chosen.images[start.vertices]]
    moved = whole.distances[places, start.images]
    weights = start.weights / (1.0 + np.square(moved / _USUAL))
    functional, _ = zoom_out(
        chosen.pair,
        replace(start, weights=weights),
        counts=LAST_COUNTS,
        samples=part.spread(_SAMPLES),
        targets=np.arange(whole.mesh.n_vertices),
        hint=0.0,
        stiffness=_STIFFNESS,
    )
    rows = embeddings(chosen.pair, functional)
    return _Maps(nearest_rows(*rows), nearest_rows(*rows[::-1]), rows, chosen.orientation < 0.0)


def _answer(sides: Sides, maps: _Maps, mirrored: bool | None) -> Correspondence:
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


def _fitted_scale(sides: Sides, images: IntArray) -> float:
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
