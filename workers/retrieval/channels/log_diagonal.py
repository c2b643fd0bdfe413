"""The distribution of ln k(x,x): how things are around each point, whatever their size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from workers.diffusion.distances import diagonal_signature
from workers.diffusion.distributions import weighted_mean
from workers.diffusion.kernels import Kernel
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Part, Solution
from workers.geometry.spectrum import Spectrum
from workers.retrieval.channels.base import NO_CENTRE
from workers.retrieval.channels.distribution import DistributionChannel, mixture
from workers.retrieval.channels.normalisation import part_spectra

CENTRES = (NO_CENTRE, "mean", "log-mean")
LOG_FLOOR = 1e-9  # keeps the logarithm finite where a kernel leaves nothing, at area 1


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

    def values(self, solution: Solution, spectrum: Spectrum) -> tuple[FloatArray, FloatArray]:
        """Values ln k(x,x) without their centre, each with the area of its vertex.

        Parameters
        ----------
        solution : Solution
            Not used: all vertices count.
        spectrum : Spectrum
            Normalised.

        Returns
        -------
        values, weights : (n,) float64
        """
        return log_diagonal(spectrum, self.kernel, self.centre), spectrum.areas

    def combined(self, parts: Sequence[Part]) -> FloatArray:
        """Summary of ln k(x,x) of all components, less the centre of them all.

        Parameters
        ----------
        parts : sequence of Part
            All of them.

        Returns
        -------
        (d,) float64
        """
        spectra = part_spectra(parts, self.normalisation)
        found = [(log_diagonal(one, self.kernel) + rest, one.areas) for one, rest in spectra]
        logarithms, weights = mixture(parts, found)
        if self.centre == "mean":
            logarithms = logarithms - np.log(weighted_mean(np.exp(logarithms), weights))
        elif self.centre == "log-mean":
            logarithms = logarithms - weighted_mean(logarithms, weights)
        return self._summary(logarithms, weights)

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


def log_diagonal(spectrum: Spectrum, kernel: Kernel, centre: str = NO_CENTRE) -> FloatArray:
    """Logarithm of k(x,x) at every vertex, less its centre.

    Parameters
    ----------
    spectrum : Spectrum
        In the unit that the kernel was made for.
    kernel : Kernel
        Gives K²(λ) >= 0.
    centre : str
        See `LogDiagonalChannel`.

    Returns
    -------
    (n,) float64; k is raised by 10⁻⁹ / area, so that the logarithm is finite.

    Raises
    ------
    KernelDomainError
        The kernel is not finite, or negative, on the spectrum's eigenvalues.
    """
    values = diagonal_signature(spectrum, kernel)  # (n,)
    logarithms = np.log(values + LOG_FLOOR / spectrum.area)
    if centre == "mean":
        mean = weighted_mean(values, spectrum.areas)
        logarithms -= np.log(mean + LOG_FLOOR / spectrum.area)
    elif centre == "log-mean":
        logarithms -= weighted_mean(logarithms, spectrum.areas)
    centred: FloatArray = logarithms
    return centred
