"""Logarithms of eigenvalues: ShapeDNA (Reuter, Wolter, Peinecke 2005)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum
from workers.retrieval.channels.axis import Axis
from workers.retrieval.channels.base import Channel
from workers.retrieval.channels.normalisation import length_factor, part_factors
from workers.retrieval.channels.signatures import Signatures


@dataclass(frozen=True, kw_only=True)
class EigenvalueChannel(Channel):
    """Logarithms of some eigenvalues.

    Attributes
    ----------
    numbers : (d,) tuple of int
        Which ones, 1 being the first that is not zero.
    """

    feature: ClassVar[str] = "eigenvalues"
    numbers: tuple[int, ...]

    def __post_init__(self) -> None:
        """Check the numbers too."""
        super().__post_init__()
        if not self.numbers or min(self.numbers) < 1:
            raise self.invalid(
                f"numbers of eigenvalues are {self.numbers}, expected at least one, from 1 on"
            )

    @property
    def dimension(self) -> int:
        """Number of eigenvalues."""
        return len(self.numbers)

    @property
    def axis(self) -> Axis:
        """Their numbers."""
        return Axis("index", tuple(float(number) for number in self.numbers))

    @property
    def eigenpairs_needed(self) -> int:
        """The highest number."""
        return max(self.numbers)

    def vector(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Logarithms of the eigenvalues in the unit of the normalisation.

        Parameters
        ----------
        solution : Solution
            Of the shape under the view.
        signatures : Signatures
            Not used.

        Returns
        -------
        (d,) float64
        """
        spectrum = solution.spectrum
        return self._logarithms(spectrum, length_factor(spectrum, self.normalisation))

    def combined(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Mean of the components' logarithms, by weight.

        Parameters
        ----------
        solution : Solution
            Of the surface; it has parts.
        signatures : Signatures
            Not used.

        Returns
        -------
        (d,) float64
        """
        parts = solution.parts
        found = zip(parts, part_factors(parts, self.normalisation), strict=True)
        logarithms = [
            self._logarithms(part.solution.spectrum, factor) + rest
            for part, (factor, rest) in found
        ]  # (d,) each
        mean: FloatArray = np.average(logarithms, axis=0, weights=[p.weight for p in parts])
        return mean

    def _logarithms(self, spectrum: Spectrum, factor: float) -> FloatArray:
        """Logarithms of the eigenvalues that are wanted, (d,), in a scale."""
        numbers: IntArray = np.array(self.numbers, dtype=np.int64) - 1
        eigenvalues = spectrum.eigenvalues[numbers] / factor**2  # (d,)
        if self.normalisation == "mean":
            eigenvalues = eigenvalues / eigenvalues.mean()
        logarithms: FloatArray = np.log(eigenvalues)
        return logarithms

    def _axis_to_json(self) -> dict[str, list[float]]:
        return {"levels": [float(number) for number in self.numbers]}

    @classmethod
    def _fields_from_json(cls, value: Mapping[str, Any]) -> dict[str, Any]:
        numbers = tuple(int(level) for level in value["levels"])
        if list(numbers) != list(value["levels"]):
            raise ValueError(f"numbers of eigenvalues are {value['levels']}, expected whole ones")
        return super()._fields_from_json(value) | {"numbers": numbers}
