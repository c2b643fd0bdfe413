"""A model: views, channels, and how their dissimilarities become one distance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from workers.diffusion.kernels import Kernel
from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array, read_only
from workers.geometry.solution import Solution
from workers.geometry.views import View
from workers.retrieval.channels import Channel, channel_from_json
from workers.retrieval.channels.signatures import Signatures
from workers.retrieval.roughness import RoughnessLimits
from workers.retrieval.windows.matching import WindowMatching

Entry = Channel | RoughnessLimits
"""What has columns of its own in a descriptor."""


@dataclass(frozen=True)
class Model:
    """How shapes are described and compared; never changed once shapes are described under it.

    Attributes
    ----------
    name, method : str
    parameters : Mapping
        Of the method: what was requested.
    views : tuple of View
        The preparations that its channels name.
    channels : tuple of Channel
        Their vectors, one after the other, are the descriptor.
    roughness_limits : tuple of RoughnessLimits
        Of some views; their numbers stand behind the channels' in the descriptor.
    fusion_power : float
        p of the distance Σ weight · (D / scale)^p.
    versions : Mapping of str to str
        What its descriptors depend on.
    typical_distances : Mapping of str to float
        Median distance between different classes by dissimilarity, where it was measured.
    impostor_quantiles : tuple of float
        Distances below which `IMPOSTOR_SHARES` of the pairs of different shapes lay in training.
    windows : WindowMatching or None
        How the nearest shapes, and those with like windows, are compared closely.
    """

    name: str
    method: str
    parameters: Mapping[str, Any]
    views: tuple[View, ...]
    channels: tuple[Channel, ...]
    roughness_limits: tuple[RoughnessLimits, ...] = ()
    fusion_power: float = 1.0
    versions: Mapping[str, str] = field(default_factory=dict)
    typical_distances: Mapping[str, float] = field(default_factory=dict)
    impostor_quantiles: tuple[float, ...] = ()
    windows: WindowMatching | None = None

    def __post_init__(self) -> None:
        """Check that channels have names of their own and views that are there."""
        for mapping in ("parameters", "versions", "typical_distances"):
            object.__setattr__(self, mapping, MappingProxyType(dict(getattr(self, mapping))))
        names = [entry.name for entry in self.entries]
        if not names or len(set(names)) != len(names):
            raise InvalidRequestError(
                f"model {self.name!r} has the channels {names}, expected at least one and all "
                "names different"
            )
        missing = {entry.view for entry in self.entries} - {view.name for view in self.views}
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
    def entries(self) -> tuple[Entry, ...]:
        """All that has columns in a descriptor, in their order: channels, then roughness."""
        return (*self.channels, *self.roughness_limits)

    @property
    def scanned(self) -> tuple[Channel, ...]:
        """Channels by which all rows are compared."""
        return tuple(channel for channel in self.channels if not channel.is_reranked)

    @property
    def reranked(self) -> tuple[Channel, ...]:
        """Channels by which the nearest rows alone are compared: points."""
        return tuple(channel for channel in self.channels if channel.is_reranked)

    def check_dissimilarity(self, name: str) -> None:
        """Refuse a dissimilarity that cannot take the place of the channels' own.

        Parameters
        ----------
        name : str
            That a query asks for.

        Raises
        ------
        InvalidRequestError
            There is none of this name, or it cannot compare a channel that is scanned.
        """
        for channel in self.scanned:
            channel.check_dissimilarity(name)

    @property
    def dimension(self) -> int:
        """Numbers in a descriptor."""
        return sum(entry.dimension for entry in self.entries)

    @property
    def slices(self) -> Mapping[str, slice]:
        """Columns of each entry in the descriptor, by its name."""
        ends = np.cumsum([entry.dimension for entry in self.entries])
        return MappingProxyType(
            {
                entry.name: slice(int(end) - entry.dimension, int(end))
                for entry, end in zip(self.entries, ends, strict=True)
            }
        )

    def to_json(self) -> dict[str, Any]:
        """Everything that `from_json` needs.

        Returns
        -------
        dict
            Plain JSON; roughness stands among the channels, as the API shows it.
        """
        return {
            "name": self.name,
            "method": self.method,
            "parameters": dict(self.parameters),
            "views": [view.to_json() for view in self.views],
            "channels": [entry.to_json() for entry in self.entries],
            "fusion": {"power": self.fusion_power},
            "versions": dict(self.versions),
            "typical_distances": dict(self.typical_distances),
            "impostor_quantiles": list(self.impostor_quantiles),
            **({} if self.windows is None else {"windows": self.windows.to_json()}),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Model":
        """Return the model that `to_json` wrote.

        Parameters
        ----------
        value : Mapping
            Plain JSON.

        Returns
        -------
        Model
            Equal to the one that was written.

        Raises
        ------
        InvalidRequestError
            It is none.
        """
        try:
            channels, roughness_limits = _entries_from_json(value["channels"])
            windows = value.get("windows")
            return cls(
                name=str(value["name"]),
                method=str(value["method"]),
                parameters=value["parameters"],
                views=tuple(View.from_json(view) for view in value["views"]),
                channels=channels,
                roughness_limits=roughness_limits,
                fusion_power=float(value["fusion"]["power"]),
                versions=value["versions"],
                typical_distances=value["typical_distances"],
                impostor_quantiles=tuple(float(d) for d in value["impostor_quantiles"]),
                windows=None if windows is None else WindowMatching.from_json(windows),
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
        Under which it is described.

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
    for entry in model.entries:
        if entry.view not in solutions:
            raise InvalidRequestError(
                f"model {model.name!r} needs the view {entry.view!r}, "
                f"but the shape was prepared as {', '.join(solutions) or 'none'}"
            )
    # What channels of a view share is computed once.
    needed: dict[str, list[tuple[str, Kernel]]] = {entry.view: [] for entry in model.entries}
    for entry in model.entries:
        needed[entry.view] += entry.signatures_needed
    signatures = {view: Signatures(solutions[view], keys) for view, keys in needed.items()}
    vectors = [
        entry.describe(solutions[entry.view], signatures[entry.view]) for entry in model.entries
    ]
    descriptor: Float32Array = read_only(np.concatenate(vectors), np.float32)
    return descriptor


def _entries_from_json(
    values: Sequence[Mapping[str, Any]],
) -> tuple[tuple[Channel, ...], tuple[RoughnessLimits, ...]]:
    """Channels and, behind them all, limits of roughness: the order is that of the columns."""
    is_rough = [value["feature"] == RoughnessLimits.feature for value in values]
    count = is_rough.count(False)
    if any(is_rough[:count]):
        raise InvalidRequestError("roughness stands before a channel, expected it behind them all")
    return (
        tuple(channel_from_json(value) for value in values[:count]),
        tuple(RoughnessLimits.from_json(value) for value in values[count:]),
    )
