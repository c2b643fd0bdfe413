"""A distribution as a vector: probabilities of bins, or quantiles."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from workers.diffusion.distributions import value_distribution, weighted_quantiles
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, read_only


@dataclass(frozen=True)
class Histogram:
    """Probability of each bin.

    Attributes
    ----------
    edges : (d + 1,) tuple of float
        Bounds of the bins, ascending; the outermost bins take what is beyond.
    """

    edges: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the edges."""
        if len(self.edges) < 2 or not np.all(np.diff(self.edges) > 0.0):
            raise InvalidRequestError(
                f"edges of a histogram are {self.edges}, expected at least 2 that ascend"
            )

    @property
    def dimension(self) -> int:
        """Number of bins."""
        return len(self.edges) - 1

    @cached_property
    def widths(self) -> FloatArray:
        """Widths of the bins, (d,)."""
        widths: FloatArray = read_only(np.diff(np.asarray(self.edges)), np.float64)
        return widths

    def summarise(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Share of the weight in each bin.

        Parameters
        ----------
        values, weights : (n,) float64
            In any order.

        Returns
        -------
        (d,) float64, sum 1
        """
        edges = np.asarray(self.edges, dtype=np.float64)
        return value_distribution(values, weights, edges).masses


@dataclass(frozen=True)
class Quantiles:
    """Quantiles at some levels.

    Attributes
    ----------
    levels : (d,) tuple of float
        Between 0 and 1.
    """

    levels: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the levels."""
        if not self.levels or not all(0.0 < level < 1.0 for level in self.levels):
            raise InvalidRequestError(
                f"levels of quantiles are {self.levels}, expected at least 1, all in (0, 1)"
            )

    @property
    def dimension(self) -> int:
        """Number of levels."""
        return len(self.levels)

    @cached_property
    def widths(self) -> FloatArray:
        """All 1, (d,): quantiles have no bins."""
        widths: FloatArray = read_only(np.ones(self.dimension), np.float64)
        return widths

    def summarise(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Quantiles of weighted values.

        Parameters
        ----------
        values, weights : (n,) float64
            In any order.

        Returns
        -------
        (d,) float64, in the unit of the values
        """
        return weighted_quantiles(values, weights, np.asarray(self.levels, dtype=np.float64))


Summary = Histogram | Quantiles


def summary_to_json(summary: Summary) -> dict[str, list[float]]:
    """Return ``{"edges": [...]}`` or ``{"levels": [...]}``.

    Parameters
    ----------
    summary : Histogram or Quantiles
        Of a channel.

    Returns
    -------
    dict
        Plain JSON.
    """
    if isinstance(summary, Histogram):
        return {"edges": list(summary.edges)}
    return {"levels": list(summary.levels)}


def summary_from_json(value: Mapping[str, Any]) -> Summary:
    """Return the summary that `summary_to_json` wrote.

    Parameters
    ----------
    value : Mapping
        With "edges" or "levels".

    Returns
    -------
    Histogram or Quantiles

    Raises
    ------
    InvalidRequestError
        There are neither edges nor levels.
    """
    if value.get("edges") is not None:
        return Histogram(tuple(float(edge) for edge in value["edges"]))
    if value.get("levels") is not None:
        return Quantiles(tuple(float(level) for level in value["levels"]))
    raise InvalidRequestError("a distribution has neither edges nor levels, expected one of both")
