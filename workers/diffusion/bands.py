"""Kernels that let a band of the spectrum through: details of one size."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray

WAVE_WIDTH = 0.35  # in ln λ; from a study before the first model, not measured since


@dataclass(frozen=True)
class MexicanHatKernel:
    """K²(λ) = (tλ)² exp(-2tλ): a wavelet, largest at λ = 1/t.

    Attributes
    ----------
    time : float
        t > 0, in the inverse unit of λ.
    """

    kind: ClassVar[str] = "mexican-hat"
    time: float

    def __post_init__(self) -> None:
        """Check the time."""
        if not (np.isfinite(self.time) and self.time > 0.0):
            raise InvalidRequestError(
                f"Mexican hat time is {self.time}, expected a finite number > 0"
            )

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ) = (tλ)² exp(-2tλ).

        Parameters
        ----------
        eigenvalues : (k,) float64
            In the inverse unit of the time.

        Returns
        -------
        (k,) float64, not negative
        """
        scaled = self.time * np.asarray(eigenvalues, dtype=np.float64)
        squared: FloatArray = np.square(scaled) * np.exp(-2.0 * scaled)
        return squared

    @property
    def parameters(self) -> dict[str, Any]:
        """The time."""
        return {"time": self.time}


@dataclass(frozen=True)
class WaveKernel:
    """K²(λ) = exp(-(e - ln λ)² / 2σ²): a quantum particle's energy (Aubry and others 2011).

    Their wave kernel signature divides by the sum over the spectrum. A channel does so where its
    centre is "mean".

    Attributes
    ----------
    energy : float
        e, as a logarithm of eigenvalues.
    width : float
        σ > 0.
    """

    kind: ClassVar[str] = "wave"
    energy: float
    width: float = WAVE_WIDTH

    def __post_init__(self) -> None:
        """Check energy and width."""
        if not (np.isfinite(self.energy) and np.isfinite(self.width) and self.width > 0.0):
            raise InvalidRequestError(
                f"wave energy is {self.energy} and width {self.width}, expected finite numbers, "
                "the width > 0"
            )

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ) = exp(-(e - ln λ)² / 2σ²), 0 at λ = 0.

        Parameters
        ----------
        eigenvalues : (k,) float64
            In the unit of exp(energy).

        Returns
        -------
        (k,) float64, not negative
        """
        with np.errstate(divide="ignore"):
            distance = (self.energy - np.log(np.asarray(eigenvalues))) / self.width
        squared: FloatArray = np.exp(-0.5 * np.square(distance))
        return squared

    @property
    def parameters(self) -> dict[str, Any]:
        """Energy and width."""
        return {"energy": self.energy, "width": self.width}
