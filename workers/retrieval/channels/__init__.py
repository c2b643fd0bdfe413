"""Channels: what is described of a surface, one type a module, and how two are compared.

=====================  ==========================================================================
`DistanceChannel`      distribution of diffusion distances between sampled points, eq. (6)
`DiagonalChannel`      distribution of k(x,x) over the surface
`LogDiagonalChannel`   distribution of ln k(x,x) over the surface
`PointsChannel`        ln k(x,x) at sampled points, at several times
`EigenvalueChannel`    logarithms of eigenvalues
`AreaChannel`          logarithm of the area
=====================  ==========================================================================

A distribution is described by a `Histogram` or by `Quantiles`.
"""

from workers.retrieval.channels.area import AreaChannel
from workers.retrieval.channels.axis import Axis
from workers.retrieval.channels.base import Channel
from workers.retrieval.channels.diagonal import DiagonalChannel
from workers.retrieval.channels.distances import DistanceChannel
from workers.retrieval.channels.eigenvalues import EigenvalueChannel
from workers.retrieval.channels.kernel import KernelChannel
from workers.retrieval.channels.log_diagonal import LogDiagonalChannel
from workers.retrieval.channels.points import PointsChannel
from workers.retrieval.channels.stored import channel_from_json
from workers.retrieval.channels.summaries import Histogram, Quantiles

__all__ = [
    "AreaChannel",
    "Axis",
    "Channel",
    "DiagonalChannel",
    "DistanceChannel",
    "EigenvalueChannel",
    "Histogram",
    "KernelChannel",
    "LogDiagonalChannel",
    "PointsChannel",
    "Quantiles",
    "channel_from_json",
]
