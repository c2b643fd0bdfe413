"""The exact scan: distances of one query to all rows, their order, and what they mean."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array, FloatArray, IntArray
from workers.retrieval.calibration import impostor_share, typical_distance
from workers.retrieval.fusion import fuse
from workers.retrieval.model import Model
from workers.retrieval.query_weights import weighted_for

RERANKED = 100
"""How many of the nearest rows are compared by points too, where a model has them (decision 9)."""

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

    Weights are those for this query, see `weighted_for`. Channels that are reranked are left out:
    `rerank` adds them. A row's distance is the same, bit for bit, whatever other rows stand around
    it and in whatever order. Memory beside the result stays at some megabytes for any matrix.

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
    if dissimilarity is not None:
        model.check_dissimilarity(dissimilarity)
    slices, scanned = model.slices, weighted_for(query, model).scanned
    columns = [slices[channel.name] for channel in scanned]
    vector = np.asarray(query, dtype=np.float64)  # (d,)
    n, rows = len(matrix), max(1, CHUNK_BYTES // (4 * model.dimension))
    result = np.empty(n)
    for start in range(0, n, rows):
        block = matrix[start : start + rows]  # (c, d)
        found = [
            channel.compare(vector[own], block[:, own], dissimilarity=dissimilarity)
            for channel, own in zip(scanned, columns, strict=True)
        ]
        result[start : start + rows] = fuse(found, scanned, power=model.fusion_power)
    return result


def rerank(
    query: Float32Array | FloatArray,
    fetch: Callable[[IntArray], NDArray[Any]],
    scanned: FloatArray,
    model: Model,
    *,
    dissimilarity: str | None = None,
    depth: int = RERANKED,
) -> FloatArray:
    """Distances to which the channels are added that compare the nearest rows alone: points.

    They are the ``depth`` nearest rows, and those level with the last of them. All other rows get
    the largest term there is, so that none of them comes before a row that was compared.

    Parameters
    ----------
    query : (d,) float32
        Descriptor.
    fetch : callable
        From places (m,) in ``scanned``, ascending, to their rows (m, d).
    scanned : (n,) float64
        What `distances` gave.
    model : Model
        Under which all were described.
    dissimilarity : str, optional
        The one that `distances` was given: under another than its own a point counts nothing.
    depth : int
        At least 1.

    Returns
    -------
    (n,) float64; ``scanned`` itself where the model has no such channels.
    """
    if not model.reranked or dissimilarity or len(scanned) == 0:
        return scanned
    last = min(depth, len(scanned)) - 1
    places: IntArray = np.flatnonzero(scanned <= np.partition(scanned, last)[last])
    channels = weighted_for(query, model).reranked
    largest = [np.full(len(scanned), np.inf) for _ in channels]
    found = scanned + fuse(largest, channels, power=model.fusion_power)
    found[places] = with_points(query, fetch, scanned, model, places)
    return found


def with_points(
    query: Float32Array | FloatArray,
    fetch: Callable[[IntArray], NDArray[Any]],
    scanned: FloatArray,
    model: Model,
    places: IntArray,
) -> FloatArray:
    """Distances of chosen rows, with the channels that compare few rows alone: points.

    Parameters
    ----------
    query : (d,) float32
        Descriptor.
    fetch : callable
        From places (m,) in ``scanned``, ascending, to their rows (m, d).
    scanned : (n,) float64
        What `distances` gave.
    model : Model
        Under which all were described.
    places : (m,) int64
        The chosen rows, ascending.

    Returns
    -------
    (m,) float64
        The same for a row, whatever others are chosen.
    """
    if not model.reranked:
        return scanned[places]
    channels = weighted_for(query, model).reranked
    rows = fetch(places)  # (m, d)
    added = []
    for channel in channels:
        own = model.slices[channel.name]
        added.append(channel.compare(query[own], rows[:, own]))
    return scanned[places] + fuse(added, channels, power=model.fusion_power)


def nearest(distances: FloatArray, ids: Sequence[str], limit: int) -> IntArray:
    """Places of the ``limit`` nearest rows, ordered by distance and, where equal, by id.

    Parameters
    ----------
    distances : (n,) float64
        Of the rows.
    ids : sequence of n str
        Of the rows, all different.
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

    For a bank it is 1 minus the share of impostor pairs that came closer in training. An impostor
    pair is a copy and a shape that it is no copy of. For any other model, or under a dissimilarity
    that the bank was not calibrated for, it is 2^(-d/s). There s is the median distance between
    creatures of different species (`calibration`), or the model's own scale where it was not
    calibrated. So 0.5 is "as far apart as two different kinds of creature usually are".

    Parameters
    ----------
    distances : (n,) float64
        What `distances` gave.
    model : Model
        Under which they are.
    dissimilarity : str, optional
        The one that `distances` was given.

    Returns
    -------
    (n,) float64, falling with the distance
    """
    if model.impostor_quantiles and dissimilarity is None:
        return 1.0 - impostor_share(distances, model.impostor_quantiles)
    scale = typical_distance(model, dissimilarity)
    similar: FloatArray = np.exp2(-np.asarray(distances, dtype=np.float64) / scale)
    return similar
