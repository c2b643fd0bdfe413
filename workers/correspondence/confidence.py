"""How likely an image is right: whether distances agree, and whether the way back leads home."""

import numpy as np

from workers.correspondence.surface import Surface
from workers.geometry.arrays import FloatArray, IntArray, lengths

_USUAL, _SHARE = 0.035, 0.02  # differences of distances, in √A and of the distance
# Logistic regression on 14,400 vertices of creatures of the training species: poses, parts in
# wholes and wholes in parts. Whether a point lies within 0.05 √A of the true one, by both features.
_WEIGHTS = (-4.2, 8.6, -38.9)


def confidences(
    part: Surface, whole: Surface, forward: IntArray, back: IntArray, *, scale: float
) -> tuple[FloatArray, FloatArray]:
    """Confidence in the image of each vertex, in both directions.

    Parameters
    ----------
    part, whole : Surface
        Of n and m vertices.
    forward : (n,) int64
        Vertex of the whole for each vertex of the part.
    back : (m,) int64
        Vertex of the part for each vertex of the whole.
    scale : float
        Lengths on the part, times this, are lengths on the whole.

    Returns
    -------
    (n,) and (m,) float64
        From 0 to 1.
    """
    features = agreement(part, whole, forward, back, scale=scale)
    one, other = (_logistic(*both) for both in features)
    return one, other


def agreement(
    part: Surface, whole: Surface, forward: IntArray, back: IntArray, *, scale: float
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """What confidence is computed from, in both directions; arguments as in `confidences`.

    Parameters
    ----------
    part, whole : Surface
        Of n and m vertices.
    forward : (n,) int64
        Vertex of the whole for each vertex of the part.
    back : (m,) int64
        Vertex of the part for each vertex of the whole.
    scale : float
        Lengths on the part, times this, are lengths on the whole.

    Returns
    -------
    ((n,), (n,)) and ((m,), (m,)) float64
        Share of the points whose distances agree, and how far from home the way back ends, in √A
        of the whole.
    """
    places = whole.cells[forward[part.points]]  # (s,)
    there = whole.distances[places]  # (s, m)
    here = scale * part.distances  # (s, n)
    weights = part.weights / part.weights.sum()
    ahead = landmark_agreement(part, whole, forward, scale=scale)
    behind = _agreed(here[:, back], there, weights)
    vertices = part.mesh.vertices
    home = scale * lengths(vertices[back[forward]] - vertices)
    others = whole.mesh.vertices
    away = lengths(others[forward[back]] - others)
    return (ahead, home), (behind, away)


def landmark_agreement(
    part: Surface, whole: Surface, forward: IntArray, *, scale: float
) -> FloatArray:
    """Share of the part's points whose distances to each vertex its image agrees with.

    Parameters
    ----------
    part, whole : Surface
        Of n and m vertices.
    forward : (n,) int64
        Vertex of the whole for each vertex of the part.
    scale : float
        Lengths on the part, times this, are lengths on the whole.

    Returns
    -------
    (n,) float64
        By the areas of the points' cells; 0 to 1.
    """
    places = whole.cells[forward[part.points]]  # (s,)
    there = whole.distances[places[:, None], forward]  # (s, n)
    return _agreed(scale * part.distances, there, part.weights / part.weights.sum())


def _agreed(one: FloatArray, other: FloatArray, weights: FloatArray) -> FloatArray:
    """Share (n,) of the points (s,) whose distances to each vertex agree."""
    agreed: FloatArray = weights @ (
        1.0 / (1.0 + np.square((one - other) / (_USUAL + _SHARE * one)))
    )
    return agreed


def _logistic(agreed: FloatArray, away: FloatArray) -> FloatArray:
    """Confidence (n,) from both features."""
    offset, by_agreement, by_distance = _WEIGHTS
    score = offset + by_agreement * agreed + by_distance * away
    confidence: FloatArray = 1.0 / (1.0 + np.exp(-np.clip(score, -30.0, 30.0)))
    return confidence
