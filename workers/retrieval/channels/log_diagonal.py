"""The distribution of ln k(x,x): how things are around each point, whatever their size."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from workers.diffusion.distributions import weighted_mean
from workers.diffusion.kernels import Kernel
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Solution
from workers.retrieval.channels.base import NO_CENTRE
from workers.retrieval.channels.distribution import DistributionChannel
from workers.retrieval.channels.signatures import Signatures

CENTRES = (NO_CENTRE, "mean", "log-mean")


@dataclass(frozen=True, kw_only=True)
class LogDiagonalChannel(DistributionChannel):
    """Distribution of ln k(x,x) over all vertices, by area.

    Attributes
    ----------
    centre : str
        What is subtracted: "none"; "mean", the logarithm of the mean of k(x,x); "log-mean", the
        mean of ln k(x,x).
    """

    feature: ClassVar[str] = "log-diagonal-distribution"
    centre: str = NO_CENTRE

    def __post_init__(self) -> None:
        """Check the centre too."""
        super().__post_init__()
        if self.centre not in CENTRES:
            raise self.invalid(f"there is no centre {self.centre!r}; there are {CENTRES}")

    @property
    def signatures_needed(self) -> tuple[tuple[str, Kernel], ...]:
        """That of its kernel."""
        return ((self.normalisation, self.kernel),)

    def values(
        self, solution: Solution, signatures: Signatures
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Values ln k(x,x), each with the area of its vertex.

        Parameters
        ----------
        solution : Solution
            Not used: all vertices count.
        signatures : Signatures
            Of this solution.

        Returns
        -------
        list of (values, weights), (n,) float64 each
            Of every component, or of the surface alone where it is connected.
        """
        found = signatures.of(self.normalisation, self.kernel)
        return [(one.logarithms + one.rest, one.areas) for one in found]

    def to_json(self) -> dict[str, Any]:
        """As it is stored, with the centre.

        Returns
        -------
        dict
        """
        return super().to_json() | {"centre": self.centre}

    @classmethod
    def _fields_from_json(cls, value: Mapping[str, Any]) -> dict[str, Any]:
        return super()._fields_from_json(value) | {"centre": str(value["centre"])}

    def _summary(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Histogram or quantiles of the values less their centre, (d,)."""
        if self.centre == "mean":
            values = values - np.log(weighted_mean(np.exp(values), weights))
        elif self.centre == "log-mean":
            values = values - weighted_mean(values, weights)
        return super()._summary(values, weights)
