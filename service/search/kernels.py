"""Kernels as a request names them."""

import json
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from workers.diffusion.kernels import (
    BiharmonicKernel,
    BoundedKernel,
    CommuteTimeKernel,
    HeatKernel,
    Kernel,
    kernel_to_json,
)
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray
from workers.geometry.spectrum import Spectrum
from workers.geometry.views import View
from workers.retrieval.channels import KernelChannel
from workers.retrieval.model import Model

DEFAULT_TIME = 0.15
NAMES = "heat, heat:TIME, commute-time, biharmonic or model:NAME"
OF_MODEL = "model:"


@dataclass(frozen=True)
class RescaledKernel:
    """A kernel of normalised eigenvalues, turned into one of eigenvalues in the file's unit.

    Attributes
    ----------
    kernel : Kernel
        K² as a function of factor · λ.
    factor : float
        1/λ₁ for the normalisation "first-eigenvalue", the area for "area", else 1.
    """

    kind: ClassVar[str] = "rescaled"
    kernel: Kernel
    factor: float

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """Return K²(factor · λ).

        Parameters
        ----------
        eigenvalues : (k,) float64
            λ in the file's unit, 1/area.

        Returns
        -------
        (k,) float64
            Not below 0.
        """
        return self.kernel.squared_transfer(self.factor * np.asarray(eigenvalues))

    @property
    def domain(self) -> tuple[float, float]:
        """Smallest and largest eigenvalue for which the kernel is known."""
        if not isinstance(self.kernel, BoundedKernel):
            return 0.0, np.inf
        low, high = self.kernel.domain
        return low / self.factor, high / self.factor

    @property
    def parameters(self) -> dict[str, Any]:
        """The kernel's parameters and the factor."""
        return {**self.kernel.parameters, "factor": self.factor}


@dataclass(frozen=True)
class ChosenKernel:
    """A kernel and the unit in which it takes eigenvalues."""

    kernel: Kernel
    normalisation: str

    @property
    def key(self) -> str:
        """Text that is different for every other kernel."""
        return f"{self.normalisation} {json.dumps(kernel_to_json(self.kernel), sort_keys=True)}"

    def in_file_units(self, spectrum: Spectrum) -> Kernel:
        """Return the kernel as one of eigenvalues in the file's unit.

        Parameters
        ----------
        spectrum : Spectrum
            Its first eigenvalue and its area give the unit.

        Returns
        -------
        Kernel
            K² as a function of the spectrum's own eigenvalues.
        """
        factors = {
            "first-eigenvalue": lambda: 1.0 / float(spectrum.eigenvalues[0]),
            "area": lambda: float(spectrum.area),
        }
        factor = factors.get(self.normalisation, lambda: 1.0)()
        return RescaledKernel(self.kernel, factor)


def choose_kernel(model: Model, name: str | None) -> tuple[View, ChosenKernel]:
    """Return the kernel that a request names.

    Parameters
    ----------
    model : Model
        Gives the kernel where none is named, and the view.
    name : str or None
        Of a built-in kernel, such as ``heat:0.15``; None for the model's first kernel, or commute
        time if it has none.

    Returns
    -------
    The view to solve under, and the kernel.

    Raises
    ------
    InvalidRequestError
        The name is none of a built-in kernel, or its time is no number above 0.
    """
    if name is None and any(isinstance(one, KernelChannel) for one in model.channels):
        return first_kernel(model)
    kind, _, parameter = (name or CommuteTimeKernel.kind).partition(":")
    if kind == HeatKernel.kind:
        time = HeatKernel(_time(parameter) if parameter else DEFAULT_TIME)
        return model.views[0], ChosenKernel(time, "first-eigenvalue")
    plain: dict[str, Kernel] = {k.kind: k for k in (CommuteTimeKernel(), BiharmonicKernel())}
    if kind not in plain or parameter:
        raise InvalidRequestError(f"there is no kernel {name!r}, expected {NAMES}")
    return model.views[0], ChosenKernel(plain[kind], "none")


def first_kernel(model: Model) -> tuple[View, ChosenKernel]:
    """Return the first kernel of a model.

    Parameters
    ----------
    model : Model
        The model.

    Returns
    -------
    The view that the kernel was made for, and the kernel.

    Raises
    ------
    InvalidRequestError
        The model has none.
    """
    views = {view.name: view for view in model.views}
    for channel in model.channels:
        if isinstance(channel, KernelChannel):
            return views[channel.view], ChosenKernel(channel.kernel, channel.normalisation)
    raise InvalidRequestError(f"the model {model.name!r} has no kernel")


def _time(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InvalidRequestError(
            f"the heat kernel's time is {text!r}, expected a number"
        ) from None
