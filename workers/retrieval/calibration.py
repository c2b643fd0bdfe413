"""How far apart different kinds of creature are: what a distance is measured by.

The table is made by ``python -m benchmarks.calibrate``, which prints it: medians over pairs of
creatures of different species, described by the built-in models, and behind each the similarity
of two poses of one individual that follows from it. Nothing in it is random.
"""

from collections.abc import Mapping
from types import MappingProxyType

from workers.retrieval.model import Model

TYPICAL_DISTANCES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "heat": {
            "l1": 0.565,  # poses: 0.98
            "l2": 0.516,  # poses: 0.97
            "linf": 0.834,  # poses: 0.96
            "normalised-l1": 0.282,  # poses: 0.98
            "normalised-l2": 0.296,  # poses: 0.97
            "kullback-leibler": 0.38,  # poses: 1.00
            "jensen-shannon": 0.279,  # poses: 0.97
            "bhattacharyya": 0.0938,  # poses: 1.00
            "hellinger": 0.301,  # poses: 0.98
            "chi-squared": 0.135,  # poses: 1.00
            "earth-movers": 0.189,  # poses: 0.99
            "kolmogorov-smirnov": 0.227,  # poses: 0.99
        },
        "commute-time": {
            "l1": 0.532,  # poses: 0.98
            "l2": 0.55,  # poses: 0.98
            "linf": 1.06,  # poses: 0.98
            "normalised-l1": 0.266,  # poses: 0.98
            "normalised-l2": 0.274,  # poses: 0.98
            "kullback-leibler": 0.34,  # poses: 1.00
            "jensen-shannon": 0.261,  # poses: 0.98
            "bhattacharyya": 0.0799,  # poses: 1.00
            "hellinger": 0.278,  # poses: 0.98
            "chi-squared": 0.121,  # poses: 1.00
            "earth-movers": 0.172,  # poses: 0.99
            "kolmogorov-smirnov": 0.247,  # poses: 0.99
        },
        "biharmonic": {
            "l1": 0.539,  # poses: 0.98
            "l2": 0.495,  # poses: 0.97
            "linf": 0.819,  # poses: 0.96
            "normalised-l1": 0.27,  # poses: 0.98
            "normalised-l2": 0.268,  # poses: 0.97
            "kullback-leibler": 0.334,  # poses: 1.00
            "jensen-shannon": 0.257,  # poses: 0.97
            "bhattacharyya": 0.0781,  # poses: 1.00
            "hellinger": 0.275,  # poses: 0.97
            "chi-squared": 0.117,  # poses: 1.00
            "earth-movers": 0.168,  # poses: 0.99
            "kolmogorov-smirnov": 0.22,  # poses: 0.99
        },
        "shape-dna": {
            "l1": 6.3,  # poses: 0.98
            "l2": 1.9,  # poses: 0.98
            "linf": 1.0,  # poses: 0.98
        },
    }
)
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
