"""Kernels, each given by its squared transfer function K²(λ) alone.

The paper writes k with K in eq. (2) and with K² from section 3 on; here it is K² everywhere.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from workers.diffusion.bands import MexicanHatKernel, WaveKernel
from workers.diffusion.bounded_kernels import (
    SplineKernel,
    TabulatedKernel,
    check_squared_transfer,
)
from workers.errors import InvalidRequestError, KernelDomainError
from workers.geometry.arrays import FloatArray

__all__ = [
    "BiharmonicKernel",
    "BoundedKernel",
    "CommuteTimeKernel",
    "HeatKernel",
    "Kernel",
    "MexicanHatKernel",
    "SplineKernel",
    "TabulatedKernel",
    "WaveKernel",
    "evaluate",
    "kernel_from_json",
    "kernel_to_json",
]


@runtime_checkable
class Kernel(Protocol):
    """A diffusion kernel k(x,y) = Σ K²(λ) φ(x) φ(y)."""

    kind: ClassVar[str]

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ) of every eigenvalue; `evaluate` checks what comes out.

        Parameters
        ----------
        eigenvalues : (k,) float64
            In the unit that the kernel was made for.

        Returns
        -------
        (k,) float64
        """
        ...

    @property
    def parameters(self) -> dict[str, Any]:
        """What the kernel is made of, as JSON."""
        ...


@runtime_checkable
class BoundedKernel(Kernel, Protocol):
    """A kernel that is known on a range of eigenvalues only, and NaN outside."""

    @property
    def domain(self) -> tuple[float, float]:
        """Smallest and largest eigenvalue."""
        ...


@dataclass(frozen=True)
class HeatKernel:
    """K²(λ) = exp(-2tλ), section 2.2: K is the heat operator's own transfer function.

    Attributes
    ----------
    time : float
        t > 0, in the inverse unit of λ: area for a raw spectrum, 1/λ₁ under the normalisation
        "first-eigenvalue".
    """

    kind: ClassVar[str] = "heat"
    time: float

    def __post_init__(self) -> None:
        """Check the time."""
        if not (np.isfinite(self.time) and self.time > 0.0):
            raise InvalidRequestError(f"heat time is {self.time}, expected a finite number > 0")

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ) = exp(-2tλ).

        Parameters
        ----------
        eigenvalues : (k,) float64
            In the inverse unit of the time.

        Returns
        -------
        (k,) float64, not negative
        """
        squared: FloatArray = np.exp(-2.0 * self.time * eigenvalues)
        return squared

    @property
    def parameters(self) -> dict[str, Any]:
        """The time."""
        return {"time": self.time}


@dataclass(frozen=True)
class CommuteTimeKernel:
    """K²(λ) = 1/λ, eq. (5): the one kernel whose distances do not see scale."""

    kind: ClassVar[str] = "commute-time"

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ) = 1/λ.

        Parameters
        ----------
        eigenvalues : (k,) float64
            In any unit: distances do not see scale.

        Returns
        -------
        (k,) float64, infinite at 0
        """
        return _inverse(eigenvalues)

    @property
    def parameters(self) -> dict[str, Any]:
        """None."""
        return {}


@dataclass(frozen=True)
class BiharmonicKernel:
    """K²(λ) = 1/λ² (Lipman, Rustamov, Funkhouser 2010); its distances are lengths."""

    kind: ClassVar[str] = "biharmonic"

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ) = 1/λ².

        Parameters
        ----------
        eigenvalues : (k,) float64
            In any unit.

        Returns
        -------
        (k,) float64, infinite at 0
        """
        return _inverse(eigenvalues) ** 2

    @property
    def parameters(self) -> dict[str, Any]:
        """None."""
        return {}


def evaluate(kernel: Kernel, eigenvalues: FloatArray) -> FloatArray:
    """K²(λ), checked: every user of a kernel goes through here.

    Parameters
    ----------
    kernel : Kernel
        Gives K².
    eigenvalues : (k,) float64
        Nonzero eigenvalues, in the unit that the kernel was made for.

    Returns
    -------
    (k,) float64, finite, no entry below 0.

    Raises
    ------
    KernelDomainError
        K² is not finite, or negative, at one of the eigenvalues.
    """
    squared = np.asarray(kernel.squared_transfer(eigenvalues), dtype=np.float64)  # (k,)
    if isinstance(kernel, BoundedKernel) and np.isnan(squared).any():
        low, high = kernel.domain
        raise KernelDomainError(
            f"the {kernel.kind} kernel is known for eigenvalues from {low:g} to {high:g}, "
            f"but the spectrum has {eigenvalues[np.isnan(squared)][0]:g}"
        )
    check_squared_transfer(eigenvalues, squared)
    return squared


def kernel_to_json(kernel: Kernel) -> dict[str, Any]:
    """Kernel as plain JSON.

    Parameters
    ----------
    kernel : Kernel
        Of any kind below.

    Returns
    -------
    dict
        ``{"kind": ..., "parameters": {...}}``, which `kernel_from_json` reads.
    """
    return {"kind": kernel.kind, "parameters": kernel.parameters}


def kernel_from_json(value: Mapping[str, Any]) -> Kernel:
    """Return the kernel that `kernel_to_json` wrote.

    Parameters
    ----------
    value : Mapping
        ``{"kind": ..., "parameters": {...}}``.

    Returns
    -------
    Kernel
        Of this kind.

    Raises
    ------
    InvalidRequestError
        The kind is unknown, or its parameters are not what it needs.
    """
    kind, parameters = value.get("kind"), value.get("parameters", {})
    try:
        match kind:
            case HeatKernel.kind:
                return HeatKernel(float(parameters["time"]))
            case CommuteTimeKernel.kind:
                return CommuteTimeKernel()
            case BiharmonicKernel.kind:
                return BiharmonicKernel()
            case MexicanHatKernel.kind:
                return MexicanHatKernel(float(parameters["time"]))
            case WaveKernel.kind:
                return WaveKernel(float(parameters["energy"]), float(parameters["width"]))
            case TabulatedKernel.kind:
                return TabulatedKernel(
                    np.asarray(parameters["eigenvalues"], dtype=np.float64),
                    np.asarray(parameters["squared_transfer"], dtype=np.float64),
                )
            case SplineKernel.kind:
                low, high = parameters["domain"]
                return SplineKernel(
                    float(parameters["low"]),
                    float(parameters["high"]),
                    int(parameters["degree"]),
                    np.asarray(parameters["coefficients"], dtype=np.float64),
                    (float(low), float(high)),
                )
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidRequestError(
            f"parameters of the kernel {kind!r} are not usable: {parameters!r}"
        ) from error
    raise InvalidRequestError(
        f"there is no kernel {kind!r}; there are heat, commute-time, biharmonic, mexican-hat, "
        "wave, tabulated and spline"
    )


def _inverse(eigenvalues: FloatArray) -> FloatArray:
    """1/λ, infinite at 0 without a warning."""
    with np.errstate(divide="ignore", over="ignore"):
        inverse: FloatArray = 1.0 / np.asarray(eigenvalues, dtype=np.float64)
    return inverse
