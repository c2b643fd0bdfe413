"""The distribution of diffusion distances, eq. (6)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from workers.diffusion.distances import pairwise_diffusion_distances
from workers.diffusion.distributions import product_measure
from workers.geometry.arrays import FloatArray
from workers.geometry.sampling import SAMPLES
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum
from workers.retrieval.channels.distribution import DistributionChannel


@dataclass(frozen=True, kw_only=True)
class DistanceChannel(DistributionChannel):
    """Distribution of diffusion distances between sampled points, by area, eq. (6).

    Attributes
    ----------
    samples : int
        Points between which distances are taken.
    """

    feature: ClassVar[str] = "distance-distribution"
    samples: int = SAMPLES

    def __post_init__(self) -> None:
        """Check the number of points too."""
        super().__post_init__()
        if self.samples < 1:
            raise self.invalid(f"{self.samples} samples asked for, expected at least 1")

    def values(self, solution: Solution, spectrum: Spectrum) -> tuple[FloatArray, FloatArray]:
        """Distances of all pairs of sampled points, each with the product of their areas.

        Parameters
        ----------
        solution : Solution
            Has the sample.
        spectrum : Spectrum
            Normalised.

        Returns
        -------
        values, weights : (s (s + 1) / 2,) float64, see `product_measure`
        """
        sample = solution.sample(self.samples)
        distances = pairwise_diffusion_distances(spectrum, self.kernel, sample.indices)
        return product_measure(distances, sample.weights)

    def to_json(self) -> dict[str, Any]:
        """As it is stored, with the number of points.

        Returns
        -------
        dict
        """
        return super().to_json() | {"samples": self.samples}

    @classmethod
    def _fields_from_json(cls, value: Mapping[str, Any]) -> dict[str, Any]:
        return super()._fields_from_json(value) | {"samples": int(value["samples"])}
