"""How far apart different kinds of creature are: what a distance is measured by.

``python -m benchmarks.calibrate`` prints the table: medians over pairs of creatures of different
species under the built-in models. Behind each stands the similarity of two poses of one individual
that follows from it. Nothing in it is random.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.retrieval.model import Model

TYPICAL_DISTANCES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "heat": {
            "l1": 0.573,  # poses: 0.98
            "l2": 0.521,  # poses: 0.97
            "linf": 0.837,  # poses: 0.96
            "normalised-l1": 0.287,  # poses: 0.98
            "normalised-l2": 0.3,  # poses: 0.97
            "kullback-leibler": 0.39,  # poses: 1.00
            "jensen-shannon": 0.283,  # poses: 0.97
            "bhattacharyya": 0.097,  # poses: 1.00
            "hellinger": 0.305,  # poses: 0.98
            "chi-squared": 0.138,  # poses: 1.00
            "earth-movers": 0.192,  # poses: 0.99
            "kolmogorov-smirnov": 0.232,  # poses: 0.99
        },
        "commute-time": {
            "l1": 0.54,  # poses: 0.98
            "l2": 0.552,  # poses: 0.98
            "linf": 1.07,  # poses: 0.98
            "normalised-l1": 0.27,  # poses: 0.98
            "normalised-l2": 0.279,  # poses: 0.98
            "kullback-leibler": 0.349,  # poses: 1.00
            "jensen-shannon": 0.267,  # poses: 0.98
            "bhattacharyya": 0.0827,  # poses: 1.00
            "hellinger": 0.282,  # poses: 0.98
            "chi-squared": 0.124,  # poses: 1.00
            "earth-movers": 0.174,  # poses: 0.99
            "kolmogorov-smirnov": 0.25,  # poses: 0.99
        },
        "biharmonic": {
            "l1": 0.546,  # poses: 0.98
            "l2": 0.497,  # poses: 0.97
            "linf": 0.82,  # poses: 0.96
            "normalised-l1": 0.273,  # poses: 0.98
            "normalised-l2": 0.27,  # poses: 0.97
            "kullback-leibler": 0.342,  # poses: 1.00
            "jensen-shannon": 0.259,  # poses: 0.97
            "bhattacharyya": 0.0796,  # poses: 1.00
            "hellinger": 0.277,  # poses: 0.97
            "chi-squared": 0.119,  # poses: 1.00
            "earth-movers": 0.171,  # poses: 0.99
            "kolmogorov-smirnov": 0.22,  # poses: 0.99
        },
        "shape-dna": {
            "l1": 6.3,  # poses: 0.98
            "l2": 1.9,  # poses: 0.98
            "linf": 1.02,  # poses: 0.98
        },
    }
)
"""Median distance between different species, by method and dissimilarity."""

IMPOSTOR_SHARES = (
    *(0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05),
    *(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0),
)
"""Where the distances of impostor pairs are written down: closely where answers are decided."""


def typical_distance(model: Model, dissimilarity: str | None = None) -> float:
    """Distance between two different kinds of creature under a model.

    Parameters
    ----------
    model : Model
        Any.
    dissimilarity : str, optional
        Instead of the channels' own.

    Returns
    -------
    float
        The median that was measured when the model was learned, or that of the table for a plain
        model of one channel whose method is there. For any other Σ weight: its distance where
        every channel's dissimilarity is at that channel's scale.
    """
    if len(model.channels) == 1:
        (channel,) = model.channels
        plain = channel.scale == channel.weight == model.fusion_power == 1.0
        row = model.typical_distances or TYPICAL_DISTANCES.get(model.method, {})
        measured = row.get(dissimilarity or channel.dissimilarity)
        if plain and measured is not None:
            return measured
    return sum(channel.weight for channel in model.channels) or 1.0


def impostor_quantiles(distances: FloatArray) -> tuple[float, ...]:
    """Distances below which `IMPOSTOR_SHARES` of the impostor pairs lie.

    Parameters
    ----------
    distances : (i,) float64
        Of pairs of a copy and a shape that it is no copy of.

    Returns
    -------
    tuple of float
        To five digits; empty if there are no pairs.
    """
    if len(distances) == 0:
        return ()
    found = np.quantile(distances, IMPOSTOR_SHARES)
    return tuple(float(f"{distance:.5g}") for distance in found)


def impostor_share(distances: FloatArray, quantiles: tuple[float, ...]) -> FloatArray:
    """Share of impostor pairs that come closer than each distance, linear between quantiles.

    Parameters
    ----------
    distances : (n,) float64
        Under the model that was calibrated.
    quantiles : tuple of float
        Of `impostor_quantiles`.

    Returns
    -------
    (n,) float64: 0 at distance 0, 1 from the farthest impostor on.
    """
    places = np.concatenate([[0.0], quantiles])
    shares = np.concatenate([[0.0], IMPOSTOR_SHARES])
    closer: FloatArray = np.interp(distances, places, shares)
    return closer
