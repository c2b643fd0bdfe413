"""Functional maps: fitted to landmarks, refined by ZoomOut, also of a part.

A function g on the whole becomes a function on the part: Φ_P C expands it there (Ovsjanikov et al.
2012). Between two wholes, each point goes to the one whose row of Φ_W Cᵀ is nearest to its own row
of Φ_P. A fitted C is smaller than it should be: a map that is not exact yet averages. So the rows
of Φ_P C would draw all images inwards, and Cᵀ on the other side does not. But what a part lacks
makes C small, too. There the rows are Φ_P U S^0.7 Vᵀ and Φ_W, where U S Vᵀ = C.

ZoomOut fits C to that map again, with more functions (Melzi et al. 2019). A part of a
share f of the area has about f k of the whole's k first functions (Rodolà et al. 2017): C is that
much lower than wide.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workers.correspondence.surface import Surface
from workers.geometry.arrays import FloatArray, IntArray

EVERYWHERE = slice(None)
# Chosen on creatures of the training species.
_MORE = 1.2  # times f k functions of a part: with fewer, its image shrinks
_POWER = 0.7  # of the singular values: at 1 the image of a part shrinks, at 0 it grows
_CHUNK = 250  # rows that are compared at once: what fits a processor's cache
_RIDGE = 1e-6  # of the mean diagonal, against functions that few samples cannot tell apart


@dataclass(frozen=True, eq=False)
class Matches:
    """Vertices of a part and their images.

    Attributes
    ----------
    vertices : (q,) int64
        Of the part.
    images : (q,) int64
        Vertices of the whole.
    weights : (q,) float64
        How much each counts.
    """

    vertices: IntArray
    images: IntArray
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class Pair:
    """A part and the whole it is mapped into, with what is compared beside the functions.

    Attributes
    ----------
    part, whole : Surface
        They may also be two wholes.
    share : float
        f: area of the part over that of the whole, at most 1.
    hints : (n, c) and (m, c) float64
        Fields that should be equal at points that correspond.
    is_part : bool
        Whether something of the whole may be missing.
    """

    part: Surface
    whole: Surface
    share: float
    hints: tuple[FloatArray, FloatArray]
    is_part: bool

    def sizes(self, count: int) -> tuple[int, int]:
        """How many functions of the part and of the whole go with ``count`` of the whole.

        Parameters
        ----------
        count : int
            k.

        Returns
        -------
        (int, int)
            At least 1, and at most as many as there are.
        """
        fewer = int(np.ceil(min(1.0, _MORE * self.share) * count)) + (self.share < 1.0)
        widths = self.part.basis.shape[1], self.whole.basis.shape[1]
        return max(1, min(fewer, count, widths[0])), max(1, min(count, widths[1]))

    def detuning(self, a: int, b: int) -> FloatArray:
        """How unlike the frequencies of both shapes' functions are.

        Parameters
        ----------
        a, b : int
            How many functions of the part and of the whole.

        Returns
        -------
        (a, b) float64
            Squared difference of eigenvalues over the largest one; 0 to 1.
        """
        one, other = self.part.frequencies[:a] / self.share, self.whole.frequencies[:b]
        largest = max(float(one.max()), float(other.max()), 1e-30)
        unlike: FloatArray = np.square((one[:, None] - other[None]) / largest)
        return unlike


def zoom_out(
    pair: Pair,
    matches: Matches,
    *,
    counts: Sequence[int],
    samples: IntArray,
    targets: IntArray,
    hint: float,
    stiffness: float = 0.0,
) -> tuple[FloatArray, Matches]:
    """Fit a functional map to matches and refine it with more and more functions.

    Parameters
    ----------
    pair : Pair
        Part and whole.
    matches : Matches
        To begin with.
    counts : sequence of int
        Functions of the whole, ascending.
    samples : (q,) int64
        Vertices of the part that are matched anew in each round.
    targets : (t,) int64
        Vertices of the whole that they may be matched with.
    hint : float
        Weight of the fields beside the functions.
    stiffness : float
        How much the first C is kept from mapping functions to those of other frequencies: needed
        where there are few matches for many functions.

    Returns
    -------
    (a, b) float64 and Matches
        C, and the matches that it was fitted to.
    """
    areas = pair.part.spectrum.areas[samples]
    functional = np.zeros((1, 1))
    for number, count in enumerate(counts):
        a, b = pair.sizes(count)
        functional = _fitted(
            pair.part.basis[matches.vertices, :a],
            pair.whole.basis[matches.images, :b],
            matches.weights,
            _RIDGE + (0.0 if number else stiffness) * pair.detuning(a, b),
        )
        if number + 1 == len(counts):
            break
        rows, columns = embeddings(pair, functional, samples, targets)
        rows = np.hstack([rows, hint * pair.hints[0][samples]])
        columns = np.hstack([columns, hint * pair.hints[1][targets]])
        matches = Matches(samples, targets[nearest_rows(rows, columns)], areas)
    return functional, matches


def embeddings(
    pair: Pair,
    functional: FloatArray,
    samples: IntArray | slice = EVERYWHERE,
    targets: IntArray | slice = EVERYWHERE,
) -> tuple[FloatArray, FloatArray]:
    """Rows that are equal at points that correspond.

    Parameters
    ----------
    pair : Pair
        Part and whole.
    functional : (a, b) float64
        C.
    samples, targets : (q,) and (t,) int64
        Vertices of the part and of the whole; all without them.

    Returns
    -------
    (q, c) and (t, c) float64
        Of the part's vertices and of the whole's.
    """
    a, b = functional.shape
    one, other = pair.part.basis[samples, :a], pair.whole.basis[targets, :b]
    if not pair.is_part:
        return one, other @ functional.T
    left, values, right = np.linalg.svd(functional, full_matrices=False)
    return one @ ((left * values**_POWER) @ right), other


def nearest_rows(rows: FloatArray, among: FloatArray) -> IntArray:
    """Find the nearest of some rows to each row.

    Parameters
    ----------
    rows : (n, b) float64
        Compared in single precision.
    among : (m, b) float64
        At least one.

    Returns
    -------
    (n,) int64
        Index of the nearest, the first one among equals.
    """
    others = among.astype(np.float32)
    squares = 0.5 * np.einsum("mb,mb->m", others, others)
    found = []
    for chunk in np.array_split(rows, max(1, len(rows) // _CHUNK)):
        gaps = chunk.astype(np.float32) @ others.T
        found.append(np.subtract(squares, gaps, out=gaps).argmin(axis=1))
    nearest: IntArray = np.concatenate(found).astype(np.int64)
    return nearest


def _fitted(
    first: FloatArray, second: FloatArray, weights: FloatArray, penalty: FloatArray
) -> FloatArray:
    """C (a, b) with ``first`` (q, a) times C near ``second`` (q, b), and small where penalised."""
    weighted = first * weights[:, None]
    gram, right = first.T @ weighted, weighted.T @ second
    size = np.trace(gram) / len(gram)
    own = np.arange(len(gram))
    if np.ptp(penalty) == 0.0:
        gram[own, own] += size * penalty[0, 0] + 1e-30
        fitted: FloatArray = np.linalg.solve(gram, right).astype(np.float64)
        return fitted
    grams = np.repeat(gram[None], len(penalty.T), axis=0)  # (b, a, a)
    grams[:, own, own] += size * penalty.T + 1e-30
    columns = np.linalg.solve(grams, right.T[:, :, None])[:, :, 0]
    return np.asarray(columns.T, dtype=np.float64)
