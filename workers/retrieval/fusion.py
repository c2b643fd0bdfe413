"""One distance of several channels."""

from collections.abc import Sequence

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.retrieval.channels import Channel


def fuse(
    dissimilarities: Sequence[FloatArray], channels: Sequence[Channel], *, power: float
) -> FloatArray:
    """Σ weight · (D / scale)^power over channels, in their order.

    With a power of at most 1 the sum of metrics is a metric. A small power keeps one channel that
    fails altogether from outvoting the others. No statistics of the gallery enter.

    Parameters
    ----------
    dissimilarities : sequence of (n,) float64
        D of every channel, not negative.
    channels : sequence of Channel
        With their scales and weights.
    power : float
        p > 0.

    Returns
    -------
    (n,) float64; 0 exactly where every D with a weight is.
    """
    total: FloatArray = np.zeros(len(dissimilarities[0]))
    for values, channel in zip(dissimilarities, channels, strict=True):
        total += channel.weight * channel.term(values, power=power)
    return total
