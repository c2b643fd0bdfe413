"""What the distance of two shapes is made of, channel by channel."""

from dataclasses import dataclass

from workers.geometry.arrays import Float32Array
from workers.retrieval.channels import Channel
from workers.retrieval.fusion import fuse
from workers.retrieval.model import Model
from workers.retrieval.scan import (
    channel_dissimilarities,
    distances,
    similarity,
    with_points,
)
from workers.retrieval.trust import trusted


@dataclass(frozen=True, eq=False)
class ComparedChannel:
    """What one channel says of two shapes.

    Attributes
    ----------
    channel : Channel
        With the weight that it has for this query.
    dissimilarity : str
        By which it was compared: its own, or what was asked for.
    distance : float
        D.
    share : float
        weight · (D / scale)^power, its part of the distance.
    query, match : (channel.dimension,) float32
        What was compared.
    """

    channel: Channel
    dissimilarity: str
    distance: float
    share: float
    query: Float32Array
    match: Float32Array


@dataclass(frozen=True, eq=False)
class Comparison:
    """The distance of a match from a query, its similarity, and the channels it is the sum of."""

    distance: float
    similarity: float
    channels: tuple[ComparedChannel, ...]


def compare(
    query: Float32Array, match: Float32Array, model: Model, *, dissimilarity: str | None = None
) -> Comparison:
    """Distance of a match from a query as the scan has it, and what each channel adds to it.

    Points are looked for, as on the nearest rows of a scan.

    Parameters
    ----------
    query, match : (d,) float32
        Descriptors.
    model : Model
        Under which both were described.
    dissimilarity : str, optional
        For every channel, instead of its own; points do not count then and are left out.

    Returns
    -------
    Comparison
        Channels by their shares, the largest first.

    Raises
    ------
    InvalidRequestError
        The dissimilarity is unknown or does not apply to a channel, or a size is wrong.
    """
    matrix = match[None]  # (1, d)
    scanned = distances(query, matrix, model, dissimilarity=dissimilarity)
    far = with_points(query, matrix.__getitem__, scanned, model, dissimilarity=dissimilarity)
    counting = trusted(query, model)
    counted = counting.compared if dissimilarity is None else counting.scanned
    parts = [_compared(query, match, model, channel, dissimilarity) for channel in counted]
    return Comparison(
        distance=float(far[0]),
        similarity=float(similarity(far, model, dissimilarity=dissimilarity)[0]),
        channels=tuple(sorted(parts, key=lambda part: -part.share)),
    )


def _compared(
    query: Float32Array,
    match: Float32Array,
    model: Model,
    channel: Channel,
    dissimilarity: str | None,
) -> ComparedChannel:
    part = model.slices[channel.name]
    found = channel_dissimilarities(query, match[None], model, channel, dissimilarity=dissimilarity)
    return ComparedChannel(
        channel=channel,
        dissimilarity=dissimilarity or channel.dissimilarity,
        distance=float(found[0]),
        share=float(fuse([found], [channel], power=model.fusion_power)[0]),
        query=query[part],
        match=match[part],
    )
