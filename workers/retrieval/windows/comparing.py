"""How far the windows of a query are from their nearest ones on a candidate (X)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import FloatArray
from workers.retrieval.windows.moments import NUMBERS, STEADY
from workers.retrieval.windows.signature import KINDS, RADII, Signature
from workers.retrieval.windows.whitening import WHOLE_COLUMNS, Whitening, masks

POWER = 0.25
"""Of a point's squared difference: a point without its like counts little more than a bad one."""

NOTHING_COUNTS = 3.0
"""Difference of a query none of whose windows count: about that of noise."""

ALL_AROUND, FACING = tuple(range(len(RADII))), tuple(range(len(RADII), KINDS))
"""Windows of all that is near, and of what faces the same way."""

AT_A_GLANCE = (0, 1, 4, 6)
"""Windows of a short look: .12 and .18 of all that is near, .08 and .18 of what faces the same way.
They find wholes as often as all seven do (docs/method.md)."""


@dataclass(frozen=True, eq=False)
class Side:
    """One group of a query's windows at all its scales, ready to be compared.

    Attributes
    ----------
    windows : (w,) int
        Of 7: those of the group.
    whitener : (7 w, m) float32
        From their numbers to whitened ones.
    left : (h, s, 2 m) float32
        Such that its product with numbers and their squares gives squared differences but for
        ``squares``.
    squares, dimensions : (h, s) float32
        Squared numbers that count, and how many count.
    weights : (h, s) float64
        Area of each point, times the root of its dimensions.
    """

    windows: NDArray[np.intp]
    whitener: NDArray[np.float32]
    left: NDArray[np.float32]
    squares: NDArray[np.float32]
    dimensions: NDArray[np.float32]
    weights: FloatArray

    @classmethod
    def of(
        cls,
        query: Signature,
        whitening: Whitening,
        group: Sequence[int],
        *,
        points: int | None = None,
    ) -> "Side":
        """Prepare a query.

        Parameters
        ----------
        query : Signature
            With one scale or several.
        whitening : Whitening
            Of the model.
        group : sequence of int
            Windows, of 7.
        points : int, optional
            The first so many alone.

        Returns
        -------
        Side
        """
        chosen = np.array(group, dtype=np.intp)
        columns = _columns(chosen)
        areas = query.areas[:points].astype(np.float64)
        found = []
        for numbers, reaches in zip(query.numbers, query.reaches, strict=True):
            white = whitening.apply(numbers[:points])[:, columns]
            counted, of_windows = masks(reaches[:points])
            counted = counted[:, columns]
            dimensions = of_windows[:, chosen].sum(axis=1)
            left = np.concatenate([-2.0 * white * counted, counted], axis=1)
            squares = (np.square(white) * counted).sum(axis=1)
            found.append((left, squares, dimensions, areas * np.sqrt(dimensions)))
        whitener = whitening.matrix[_numbers_of(chosen)][:, columns]
        return cls(chosen, whitener, *(np.stack(column) for column in zip(*found, strict=True)))

    def right(self, numbers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Points of candidates, ready to be compared.

        Parameters
        ----------
        numbers : (..., p, w, 7) float32
            Of the group's windows, of a candidate or of several.

        Returns
        -------
        (..., p, 2 m) float32
            Whitened, and their squares.
        """
        white = numbers.reshape(*numbers.shape[:-2], -1) @ self.whitener
        return np.concatenate([white, np.square(white)], axis=-1)

    def costs(self, scales: Sequence[int], right: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mean squared whitened differences of the query's points to those of candidates.

        The same bits for the same candidate, whatever others there are: each has a product of its
        own, whose size does not depend on them, so that sums are taken in one order.

        Parameters
        ----------
        scales : sequence of int
            Of the query, c of them.
        right : (..., p, 2 m) float32
            What `right` gave.

        Returns
        -------
        (..., c, s, p) float32, not negative
        """
        chosen = list(scales)
        left = self.left[chosen]
        flat = left.reshape(-1, left.shape[2])  # (c s, 2 m)
        products = np.matmul(flat, right.swapaxes(-1, -2))
        products = products.reshape(*right.shape[:-2], *left.shape[:2], -1)
        products += self.squares[chosen][:, :, None]
        products /= np.maximum(self.dimensions[chosen], 1.0)[:, :, None]
        found: NDArray[np.float32] = np.maximum(products, 0.0, out=products)
        return found

    def differences(self, scales: Sequence[int], costs: NDArray[np.float32]) -> FloatArray:
        """X at some scales.

        Parameters
        ----------
        scales : sequence of int
            Of the query, c of them.
        costs : (..., c, s, p) float32
            What `costs` gave.

        Returns
        -------
        (..., c) float64
            Weighted mean over the query's points of the fourth root of the mean squared whitened
            difference to the nearest point of the candidate.
        """
        weights = self.weights[list(scales)]
        totals = weights.sum(axis=1)
        roots = costs.min(axis=-1).astype(np.float64) ** POWER  # (..., c, s)
        with np.errstate(invalid="ignore"):
            found = (weights * roots).sum(axis=-1) / totals
        return np.where(totals > 0.0, found, NOTHING_COUNTS)


def _numbers_of(windows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Places of the numbers of some windows."""
    return (NUMBERS * windows[:, None] + np.arange(NUMBERS)).ravel()


def _columns(windows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Columns of their whitened numbers."""
    cut = WHOLE_COLUMNS + (len(STEADY) * windows[:, None] + np.arange(len(STEADY))).ravel()
    return np.concatenate([_numbers_of(windows), cut])
