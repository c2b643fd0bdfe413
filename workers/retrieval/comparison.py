"""What the distance of two shapes is made of, channel by channel."""

from dataclasses import dataclass

from workers.geometry.arrays import Float32Array
from workers.retrieval.channels import Channel
from workers.retrieval.fusion import fuse
from workers.retrieval.model import Model
from workers.retrieval.query_weights import weighted_for
from workers.retrieval.scan import distances, rerank, similarity


@dataclass(frozen=True, eq=False)
class ComparedChannel:
    """What one channel says of two shapes.

    Attributes
    ----------
    channel : Channel
        With the weight that it has for this query.
    dissimilarity : str
        By which it was compared: its own, or the one requested.
    distance : float
        D, as far as it counts.
    share : float
        weight · (D / scale)^power, what it adds to the distance.
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
    """Distance of a match from a query, as the scan gives it, and what each channel adds to it.

    Points are compared, as on the nearest rows of a scan.

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
    rows = match[None]  # (1, d)
    scanned = distances(query, rows, model, dissimilarity=dissimilarity)
    found = rerank(query, rows.__getitem__, scanned, model, dissimilarity=dissimilarity)
    weighted = weighted_for(query, model)
    counted = weighted.channels if dissimilarity is None else weighted.scanned
    compared = [_compared(query, match, model, channel, dissimilarity) for channel in counted]
    return Comparison(
        distance=float(found[0]),
        similarity=float(similarity(found, model, dissimilarity=dissimilarity)[0]),
        channels=tuple(sorted(compared, key=lambda one: -one.share)),
    )


def _compared(
    query: Float32Array,
    match: Float32Array,
    model: Model,
    channel: Channel,
    dissimilarity: str | None,
) -> ComparedChannel:
    own = model.slices[channel.name]
    found = channel.compare(query[own], match[None, own], dissimilarity=dissimilarity)
    return ComparedChannel(
        channel=channel,
        dissimilarity=dissimilarity or channel.dissimilarity,
        distance=min(float(found[0]), channel.farthest * channel.scale),
        share=float(fuse([found], [channel], power=model.fusion_power)[0]),
        query=query[own],
        match=match[own],
    )
