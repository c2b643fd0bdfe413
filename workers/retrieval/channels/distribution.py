"""What channels of distributions have in common: values with weights become a vector."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from workers.diffusion.distributions import weighted_mean
from workers.errors import KernelDomainError
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Part, Solution
from workers.retrieval.channels.axis import Axis
from workers.retrieval.channels.kernel import KernelChannel
from workers.retrieval.channels.signatures import Signatures
from workers.retrieval.channels.summaries import (
    Histogram,
    Summary,
    summary_from_json,
    summary_to_json,
)


@dataclass(frozen=True, kw_only=True)
class DistributionChannel(KernelChannel):
    """A channel of the distribution of some values.

    Attributes
    ----------
    summary : Histogram or Quantiles
    """

    summary: Summary

    @property
    def dimension(self) -> int:
        """Bins or levels."""
        return self.summary.dimension

    @property
    def is_distribution(self) -> bool:
        """Whether the vector is of probabilities."""
        return isinstance(self.summary, Histogram)

    @cached_property
    def widths(self) -> FloatArray:
        """Widths of the bins, (d,)."""
        return self.summary.widths

    @property
    def axis(self) -> Axis:
        """Edges or levels."""
        if isinstance(self.summary, Histogram):
            return Axis("edges", self.summary.edges)
        return Axis("levels", self.summary.levels)

    @abstractmethod
    def values(
        self, solution: Solution, signatures: Signatures
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Values and their weights.

        Parameters
        ----------
        solution : Solution
            Of the shape under the view.
        signatures : Signatures
            Of this solution.

        Returns
        -------
        list of (values, weights), (n,) float64 each
            Of every component, or of the surface alone where it is connected.
        """

    def vector(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Histogram or quantiles of the values.

        Parameters
        ----------
        solution : Solution
            Of the shape under the view.
        signatures : Signatures
            Of this solution.

        Returns
        -------
        (d,) float64

        Raises
        ------
        KernelDomainError
            The values are to be divided by their mean, which is not above 0.
        """
        ((values, weights),) = self.values(solution, signatures)
        return self._summary(values, weights)

    def combined(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Summary of the values of all components, each with its weight.

        Parameters
        ----------
        solution : Solution
            Of the surface; it has parts.
        signatures : Signatures
            Of this solution.

        Returns
        -------
        (d,) float64
        """
        return self._summary(*mixture(solution.parts, self.values(solution, signatures)))

    def _summary(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Histogram or quantiles, (d,)."""
        if self.normalisation == "mean":
            mean = weighted_mean(values, weights)
            if not mean > 0.0:
                raise KernelDomainError(f"channel {self.name!r}: the kernel vanishes on the shape")
            values = values / mean
        return self.summary.summarise(values, weights)

    def _axis_to_json(self) -> dict[str, list[float]]:
        return summary_to_json(self.summary)

    @classmethod
    def _fields_from_json(cls, value: Mapping[str, Any]) -> dict[str, Any]:
        return super()._fields_from_json(value) | {"summary": summary_from_json(value)}


def mixture(
    parts: Sequence[Part], found: Sequence[tuple[FloatArray, FloatArray]]
) -> tuple[FloatArray, FloatArray]:
    """Values of all components, with weights that sum to each component's.

    Parameters
    ----------
    parts : sequence of Part
        All components of a surface.
    found : sequence of (values, weights)
        Of each of them.

    Returns
    -------
    values, weights : (n,) float64
    """
    values = [values for values, _ in found]
    weights = [part.weight * own / own.sum() for part, (_, own) in zip(parts, found, strict=True)]
    return np.concatenate(values), np.concatenate(weights)
