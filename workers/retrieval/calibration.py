"""How far apart different kinds of creature are: what a distance is measured by.

The table is made by ``python -m benchmarks.calibrate``, which prints it: medians over pairs of
creatures of different species, described by the built-in models. Nothing in it is random.
"""

from collections.abc import Mapping
from types import MappingProxyType

from workers.retrieval.model import Model

TYPICAL_DISTANCES: Mapping[str, Mapping[str, float]] = MappingProxyType({})
"""Median distance between different species, by method and dissimilarity."""


def typical_distance(model: Model, dissimilarity: str | None = None) -> float:
    """Distance between two different kinds of creature under a model.

    Parameters
    ----------
    model : Model
    dissimilarity : str, optional
        Asked for instead of the channels' own.

    Returns
    -------
    float
        The measured median for a plain model of one channel whose method is in the table. For any
        other Σ weight: its distance where every channel's dissimilarity is at that channel's scale.
    """
    if len(model.channels) == 1:
        (channel,) = model.channels
        plain = channel.scale == channel.weight == model.fusion_power == 1.0
        row = TYPICAL_DISTANCES.get(model.method, {})
        measured = row.get(dissimilarity or channel.dissimilarity)
        if plain and measured is not None:
            return measured
    return sum(channel.weight for channel in model.channels) or 1.0
