"""Transfer functions of a model's kernels, to be drawn."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from workers.diffusion.kernels import BoundedKernel, TabulatedKernel, evaluate
from workers.geometry.arrays import FloatArray, read_only
from workers.retrieval.channels import KernelChannel
from workers.retrieval.model import Model

CURVE_POINTS = 100
CURVE_END = {"area": 1300.0}  # 4π · 100: the hundredth eigenvalue of a surface of area 1 (Weyl)
OTHER_CURVE_END = 200.0  # in units of λ₁ a hundredth eigenvalue is seldom larger


@dataclass(frozen=True, eq=False)
class KernelCurve:
    """A kernel's transfer function, to be drawn.

    Attributes
    ----------
    name : str
        Of the channel.
    kind : str
    parameters : Mapping
    normalisation : str
        Of the channel: the unit of the eigenvalues.
    eigenvalues, squared_transfer : (r,) float64
        λ, evenly in its logarithm, and K² there.
    """

    name: str
    kind: str
    parameters: Mapping[str, Any]
    normalisation: str
    eigenvalues: FloatArray
    squared_transfer: FloatArray


def kernel_curves(model: Model) -> tuple[KernelCurve, ...]:
    """K²(λ) of each channel that has a kernel, over the range that spectra have in its unit.

    Parameters
    ----------
    model : Model
        Any.

    Returns
    -------
    tuple of KernelCurve
        In the order of the channels.
    """
    curves = []
    for channel in model.channels:
        if not isinstance(channel, KernelChannel):
            continue
        kernel = channel.kernel
        if isinstance(kernel, TabulatedKernel):
            eigenvalues = kernel.eigenvalues
        elif isinstance(kernel, BoundedKernel):
            eigenvalues = np.geomspace(*kernel.domain, CURVE_POINTS)
        else:
            end = CURVE_END.get(channel.normalisation, OTHER_CURVE_END)
            eigenvalues = np.geomspace(1.0, end, CURVE_POINTS)
        curves.append(
            KernelCurve(
                name=channel.name,
                kind=kernel.kind,
                parameters=kernel.parameters,
                normalisation=channel.normalisation,
                eigenvalues=read_only(eigenvalues, np.float64),
                squared_transfer=read_only(evaluate(kernel, eigenvalues), np.float64),
            )
        )
    return tuple(curves)
