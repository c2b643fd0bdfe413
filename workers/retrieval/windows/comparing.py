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

ALL_AROUND, FACING = slice(0, len(RADII)), slice(len(RADII), KINDS)
"""Windows of all that is near, and of what faces the same way."""


@dataclass(frozen=True, eq=False)
class Side:
    """One group of a query's windows at all its scales, ready to be compared.

    Attributes
    ----------
    columns : (m,) int
        Of the whitened numbers: those of the group.
    left : (h, s, 2 m) float32
        Such that its product with numbers and their squares gives squared differences but for
        ``squares``.
    squares, dimensions : (h, s) float32
        Squared numbers that count, and how many count.
    weights : (h, s) float64
        Area of each point, times the root of its dimensions.
    """

    columns: NDArray[np.intp]
    left: NDArray[np.float32]
    squares: NDArray[np.float32]
    dimensions: NDArray[np.float32]
    weights: FloatArray

    @classmethod
    def of(
        cls, query: Signature, whitening: Whitening, group: slice, *, points: int | None = None
    ) -> "Side":
        """Prepare a query.

        Parameters
        ----------
        query : Signature
            With one scale or several.
        whitening : Whitening
            Of the model.
        group : slice
            Windows, of 7.
        points : int, optional
            The first so many alone.

        Returns
        -------
        Side
        """
        columns = _columns(group)
        areas = query.areas[:points].astype(np.float64)
        found = []
        for numbers, reaches in zip(query.numbers, query.reaches, strict=True):
            white = whitening.apply(numbers[:points])[:, columns]
            counted, of_windows = masks(reaches[:points])
            counted = counted[:, columns]
            dimensions = of_windows[:, group].sum(axis=1)
            left = np.concatenate([-2.0 * white * counted, counted], axis=1)
            squares = (np.square(white) * counted).sum(axis=1)
            found.append((left, squares, dimensions, areas * np.sqrt(dimensions)))
        return cls(columns, *(np.stack(column) for column in zip(*found, strict=True)))

    def costs(self, scales: Sequence[int], right: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mean squared whitened differences of the query's points to a candidate's.

        The same bits for the same candidate, whatever others there are: sizes do not depend on
        them, so that sums are taken in one order.

        Parameters
        ----------
        scales : sequence of int
            Of the query, c of them.
        right : (p, 77) float32
            Whitened numbers of the candidate's points.

        Returns
        -------
        (c, s, p) float32, not negative
        """
        chosen = list(scales)
        own = right[:, self.columns]
        both = np.concatenate([own, np.square(own)], axis=1)  # (p, 2 m)
        left = self.left[chosen]
        products = (left.reshape(-1, left.shape[2]) @ both.T).reshape(*left.shape[:2], -1)
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
        costs : (c, s, p) float32
            What `costs` gave.

        Returns
        -------
        (c,) float64
            Weighted mean over the query's points of the fourth root of the mean squared whitened
            difference to the nearest point of the candidate.
        """
        weights = self.weights[list(scales)]
        totals = weights.sum(axis=1)
        roots = costs.min(axis=2).astype(np.float64) ** POWER  # (c, s)
        with np.errstate(invalid="ignore"):
            found = (weights * roots).sum(axis=1) / totals
        return np.where(totals > 0.0, found, NOTHING_COUNTS)


def _columns(group: slice) -> NDArray[np.intp]:
    """Columns of the whitened numbers of some windows."""
    chosen = np.arange(KINDS)[group]
    whole = (NUMBERS * chosen[:, None] + np.arange(NUMBERS)).ravel()
    cut = WHOLE_COLUMNS + (len(STEADY) * chosen[:, None] + np.arange(len(STEADY))).ravel()
    return np.concatenate([whole, cut])
