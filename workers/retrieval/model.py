"""A model: views, channels, and how their dissimilarities become one distance."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from workers.diffusion.kernels import BoundedKernel, TabulatedKernel, evaluate
from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array, FloatArray, read_only
from workers.geometry.preparation import View
from workers.geometry.solution import Solution
from workers.retrieval.channels import Channel, describe_channel
from workers.retrieval.dissimilarity import find_dissimilarity

CURVE_POINTS = 100
CURVE_END = {"area": 1300.0}  # 4π · 100: the hundredth eigenvalue of a surface of area 1 (Weyl)


@dataclass(frozen=True)
class Model:
    """How shapes are described and compared; never changed once shapes are described under it.

    Attributes
    ----------
    name, method : str
    parameters : Mapping
        Of the method: what the model was asked for with.
    views : tuple of View
        The preparations that its channels name.
    channels : tuple of Channel
        Their vectors, one after the other, are the descriptor. A channel of roughness says what
        the others of its view count for a query (`trust`).
    fusion_power : float
        p of the distance Σ weight · (D / scale)^p.
    versions : Mapping of str to str
        What its descriptors depend on.
    typical_distances : Mapping of str to float
        Median distance between different classes by dissimilarity, where it was measured.
    impostor_quantiles : tuple of float
        Distances below which `IMPOSTOR_SHARES` of the pairs of different shapes lay in training.
    """

    name: str
    method: str
    parameters: Mapping[str, Any]
    views: tuple[View, ...]
    channels: tuple[Channel, ...]
    fusion_power: float = 1.0
    versions: Mapping[str, str] = field(default_factory=dict)
    typical_distances: Mapping[str, float] = field(default_factory=dict)
    impostor_quantiles: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check that channels have names of their own and views that are there."""
        for mapping in ("parameters", "versions", "typical_distances"):
            object.__setattr__(self, mapping, MappingProxyType(dict(getattr(self, mapping))))
        names = [channel.name for channel in self.channels]
        if not names or len(set(names)) != len(names):
            raise InvalidRequestError(
                f"model {self.name!r} has the channels {names}, expected at least one and all "
                "names different"
            )
        missing = {channel.view for channel in self.channels} - {view.name for view in self.views}
        if missing:
            raise InvalidRequestError(
                f"model {self.name!r} has no view {sorted(missing)[0]!r}, which a channel needs"
            )
        if not self.scanned:
            raise InvalidRequestError(
                f"model {self.name!r} has no channel that is scanned, but points or roughness alone"
            )
        if not (np.isfinite(self.fusion_power) and self.fusion_power > 0.0):
            raise InvalidRequestError(f"fusion power is {self.fusion_power}, expected > 0")

    @property
    def scanned(self) -> tuple[Channel, ...]:
        """Channels by which all rows are compared."""
        return tuple(
            channel
            for channel in self.channels
            if not (channel.is_of_points or channel.is_of_roughness)
        )

    @property
    def matched(self) -> tuple[Channel, ...]:
        """Channels of points, by which the nearest rows are compared."""
        return tuple(channel for channel in self.channels if channel.is_of_points)

    @property
    def compared(self) -> tuple[Channel, ...]:
        """Channels that are `scanned` or `matched`: all but those of roughness."""
        return tuple(channel for channel in self.channels if not channel.is_of_roughness)

    def check_dissimilarity(self, name: str) -> None:
        """Refuse a dissimilarity that cannot be asked for instead of the channels' own.

        Raises
        ------
        InvalidRequestError
            There is none of this name, or it compares nothing that a channel has.
        """
        for channel in self.scanned:
            find_dissimilarity(name, distribution=channel.is_distribution)

    @property
    def dimension(self) -> int:
        """Numbers in a descriptor."""
        return sum(channel.dimension for channel in self.channels)

    @property
    def slices(self) -> Mapping[str, slice]:
        """Where each channel's vector stands in the descriptor, by the channel's name."""
        ends = np.cumsum([channel.dimension for channel in self.channels])
        return MappingProxyType(
            {
                channel.name: slice(int(end) - channel.dimension, int(end))
                for channel, end in zip(self.channels, ends, strict=True)
            }
        )

    def to_json(self) -> dict[str, Any]:
        """Everything that `from_json` needs, as plain JSON."""
        return {
            "name": self.name,
            "method": self.method,
            "parameters": dict(self.parameters),
            "views": [view.to_json() for view in self.views],
            "channels": [channel.to_json() for channel in self.channels],
            "fusion": {"power": self.fusion_power},
            "versions": dict(self.versions),
            "typical_distances": dict(self.typical_distances),
            "impostor_quantiles": list(self.impostor_quantiles),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Model":
        """Return the model that `to_json` wrote; InvalidRequestError if it is none."""
        try:
            return cls(
                name=str(value["name"]),
                method=str(value["method"]),
                parameters=value["parameters"],
                views=tuple(View.from_json(view) for view in value["views"]),
                channels=tuple(Channel.from_json(channel) for channel in value["channels"]),
                fusion_power=float(value["fusion"]["power"]),
                versions=value["versions"],
                typical_distances=value.get("typical_distances", {}),
                impostor_quantiles=tuple(float(d) for d in value.get("impostor_quantiles", ())),
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InvalidRequestError(f"the model cannot be read: {error!r}") from error


def describe(solutions: Mapping[str, Solution], model: Model) -> Float32Array:
    """Descriptor of a shape under a model.

    Parameters
    ----------
    solutions : Mapping
        By the view's name, for each of ``model.views``.
    model : Model

    Returns
    -------
    (model.dimension,) float32, read-only; the same bytes for the same arguments.

    Raises
    ------
    SpectrumError
        There are fewer eigenpairs than a channel needs.
    KernelDomainError
        A kernel is not finite, or negative, on a spectrum.
    InvalidRequestError
        A view is missing.
    """
    vectors = []
    for channel in model.channels:
        if channel.view not in solutions:
            raise InvalidRequestError(
                f"model {model.name!r} needs the view {channel.view!r}, "
                f"but the shape was prepared as {', '.join(solutions) or 'none'}"
            )
        vectors.append(describe_channel(solutions[channel.view], channel))
    descriptor: Float32Array = read_only(np.concatenate(vectors), np.float32)
    return descriptor


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
    """K²(λ) of each channel that has a kernel, over the range that spectra have in its unit."""
    curves = []
    for channel in model.channels:
        kernel = channel.kernel
        if kernel is None:
            continue
        if isinstance(kernel, TabulatedKernel):
            eigenvalues = kernel.eigenvalues
        elif isinstance(kernel, BoundedKernel):
            eigenvalues = np.geomspace(*kernel.domain, CURVE_POINTS)
        else:
            end = CURVE_END.get(channel.normalisation, 200.0)
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
