"""The exact scan: distances of one query to all rows, their order, and what they mean."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array, FloatArray, IntArray
from workers.retrieval.calibration import impostor_share, typical_distance
from workers.retrieval.channels import Channel
from workers.retrieval.dissimilarity import Dissimilarity, find_dissimilarity
from workers.retrieval.fusion import fuse
from workers.retrieval.model import Model
from workers.retrieval.points import unfound_points
from workers.retrieval.trust import trusted

RERANKED = 100
"""How many of the nearest rows are looked at more closely, where a model has points."""

FARTHEST = 16.0
"""D / scale of points at most, and of all rows that are not looked at: so they stay behind."""

CHUNK_BYTES = 1 << 20
"""Bytes of the matrix that all channels pass over before the next ones are read."""


def distances(
    query: Float32Array | FloatArray,
    matrix: NDArray[Any],
    model: Model,
    *,
    dissimilarity: str | None = None,
) -> FloatArray:
    """Distances Σ weight · (D / scale)^power of a query to every row, exactly.

    Weights are those that channels have for this query, see `trusted`. Channels of points are left
    out: `with_points` adds them. A row's distance is the same, bit for
    bit, whatever other rows stand around it and in whatever order; memory beside the result stays
    at some megabytes for a matrix of any length.

    Parameters
    ----------
    query : (d,) float32
        Descriptor; first argument of dissimilarities that are not symmetric.
    matrix : (n, d) float32
        Descriptors, in any memory order, may be memory-mapped.
    model : Model
        Under which both were described.
    dissimilarity : str, optional
        For every channel, instead of its own.

    Returns
    -------
    (n,) float64, not negative, 0 for a row equal to the query.

    Raises
    ------
    InvalidRequestError
        The dissimilarity is unknown or does not apply to a channel, or a size is wrong.
    """
    if query.shape != (model.dimension,) or matrix.shape[1:] != (model.dimension,):
        raise InvalidRequestError(
            f"query of shape {query.shape} and matrix of shape {matrix.shape} do not fit model "
            f"{model.name!r}, whose descriptors have {model.dimension} numbers"
        )
    slices, scanned = model.slices, trusted(query, model).scanned
    plan = [(_comparison(c, dissimilarity), slices[c.name], c.widths) for c in scanned]
    vector = np.asarray(query, dtype=np.float64)  # (d,)
    n, rows = len(matrix), max(1, CHUNK_BYTES // (4 * model.dimension))
    result = np.empty(n)
    for start in range(0, n, rows):
        block = matrix[start : start + rows]  # (c, d)
        parts = [compare(vector[part], block[:, part], widths) for compare, part, widths in plan]
        result[start : start + rows] = fuse(parts, scanned, power=model.fusion_power)
    return result


def with_points(
    query: Float32Array | FloatArray,
    fetch: Callable[[IntArray], NDArray[Any]],
    far: FloatArray,
    model: Model,
    *,
    dissimilarity: str | None = None,
) -> FloatArray:
    """Distances to which the model's channels of points are added.

    The query's points are looked for on the `RERANKED` nearest rows (and those as far as the last
    of them); on all others they count as not found at all, so that no row that was not looked at
    comes before one that was.

    Parameters
    ----------
    query : (d,) float32
    fetch : callable
        From places (m,) in ``far``, ascending, to their rows (m, d).
    far : (n,) float64
        What `distances` gave.
    model : Model
    dissimilarity : str, optional
        The one that `distances` was asked for with: points do not count then.

    Returns
    -------
    (n,) float64; ``far`` itself where the model has no channels of points.
    """
    if not model.matched or dissimilarity or len(far) == 0:
        return far
    matched = trusted(query, model).matched
    last = min(RERANKED, len(far)) - 1
    places: IntArray = np.flatnonzero(far <= np.partition(far, last)[last])
    rows = fetch(places)  # (m, d)
    unfound = []
    for channel in matched:
        found = np.full(len(far), FARTHEST * channel.scale)
        found[places] = channel_dissimilarities(query, rows, model, channel)
        unfound.append(found)
    return far + fuse(unfound, matched, power=model.fusion_power)


def channel_dissimilarities(
    query: Float32Array | FloatArray,
    matrix: NDArray[Any],
    model: Model,
    channel: Channel,
    *,
    dissimilarity: str | None = None,
) -> FloatArray:
    """D of one channel, (n,), as it counts in `distances` or, for points, in `with_points`.

    Parameters
    ----------
    query : (d,) float32
    matrix : (n, d) float32
    model : Model
        Under which both were described.
    channel : Channel
        One of the model's.
    dissimilarity : str, optional
        Instead of the channel's own; not for points.
    """
    part = model.slices[channel.name]
    if channel.is_of_points:
        unfound = unfound_points(query[part], matrix[:, part], len(channel.levels or ()))
        return np.minimum(unfound, FARTHEST * channel.scale)
    vector = np.asarray(query[part], dtype=np.float64)
    return _comparison(channel, dissimilarity)(vector, matrix[:, part], channel.widths)


def rank(distances: FloatArray, ids: Sequence[str], limit: int) -> IntArray:
    """Indices of the ``limit`` nearest rows, ordered by distance and, where equal, by id.

    Parameters
    ----------
    distances : (n,) float64
    ids : sequence of n str
    limit : int
        At least 0; all rows are ordered if there are fewer.

    Returns
    -------
    (min(limit, n),) int64
    """
    n = len(distances)
    limit = min(limit, n)
    if limit <= 0:
        return np.empty(0, dtype=np.int64)
    candidates = np.arange(n)
    if limit < n:
        worst = np.partition(distances, limit - 1)[limit - 1]
        candidates = np.flatnonzero(distances <= worst)  # more than limit where there are ties
    ordered = sorted(candidates.tolist(), key=lambda i: (distances[i], ids[i]))
    return np.array(ordered[:limit], dtype=np.int64)


def similarity(
    distances: FloatArray, model: Model, *, dissimilarity: str | None = None
) -> FloatArray:
    """Similarity in [0, 1] of distances under a model: 1 is "equal".

    Of a bank it is 1 minus the share of impostor pairs (a copy, and a shape that it is no copy of)
    that came closer in training. Of any other model, or under a dissimilarity that the bank was
    not calibrated for, it is 2^(-d/s), where s is the median distance between creatures of
    different species under this model and dissimilarity (`calibration`), or for a model that was
    not calibrated its own scale: so 0.5 is "as far apart as two different kinds of creature
    usually are".

    Parameters
    ----------
    distances : (n,) float64
        What `distances` gave.
    model : Model
    dissimilarity : str, optional
        The one that `distances` was asked for with.

    Returns
    -------
    (n,) float64
    """
    if model.impostor_quantiles and dissimilarity is None:
        return 1.0 - impostor_share(distances, model.impostor_quantiles)
    scale = typical_distance(model, dissimilarity)
    similar: FloatArray = np.exp2(-np.asarray(distances, dtype=np.float64) / scale)
    return similar


def _comparison(channel: Channel, dissimilarity: str | None) -> Dissimilarity:
    """Return the function that compares a channel."""
    name = dissimilarity or channel.dissimilarity
    return find_dissimilarity(name, distribution=channel.is_distribution)
