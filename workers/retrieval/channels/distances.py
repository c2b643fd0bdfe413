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
from workers.retrieval.channels.normalisation import normalised_spectrum, part_spectra
from workers.retrieval.channels.signatures import Signatures


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

    def values(
        self, solution: Solution, signatures: Signatures
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Distances of all pairs of sampled points, each with the product of their areas.

        Parameters
        ----------
        solution : Solution
            Has the sample.
        signatures : Signatures
            Not used.

        Returns
        -------
        list of (values, weights), (s (s + 1) / 2,) float64 each, see `product_measure`
            Of every component, or of the surface alone where it is connected.
        """
        if solution.parts:
            spectra = [spectrum for spectrum, _ in part_spectra(solution.parts, self.normalisation)]
            parts = [part.solution for part in solution.parts]
            return [self._of_one(*one) for one in zip(parts, spectra, strict=True)]
        spectrum = normalised_spectrum(solution.spectrum, self.normalisation)
        return [self._of_one(solution, spectrum)]

    def _of_one(self, solution: Solution, spectrum: Spectrum) -> tuple[FloatArray, FloatArray]:
        """Distances on a connected surface, given its spectrum in the scale that is wanted."""
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
