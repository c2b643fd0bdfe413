"""Binary numbers, and records of unequal length in one run of them: polygons, cells, elements."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.text.tokens import Polygons, places_in_runs

LOOKED_AT_ONCE = 1 << 18  # numbers; as Python integers they take four times their room


def as_floats(values: NDArray[Any]) -> FloatArray:
    """Turn numbers of a binary file into floats; signalling NaN become plain NaN.

    Parameters
    ----------
    values : (n,) array
        Of any type and byte order.

    Returns
    -------
    (n,) float64
        A copy.
    """
    with np.errstate(invalid="ignore"):  # a signalling NaN
        return values.astype(np.float64)


def record_starts(lengths: IntArray, limit: int) -> tuple[IntArray, int]:
    """Follow records, each beginning where the one before ends.

    Parameters
    ----------
    lengths : (n,) int64
        How long a record would be that begins at each place. What is below 1 counts as 1.
    limit : int
        Most records that are followed.

    Returns
    -------
    starts : (r,) int64
        Where each record begins.
    end : int
        Where the last one ends; more than n where it is cut short.
    """
    starts: list[int] = []
    position = 0
    for base in range(0, len(lengths), LOOKED_AT_ONCE):
        chunk = np.maximum(lengths[base : base + LOOKED_AT_ONCE], 1).tolist()
        stop = base + len(chunk)
        while position < stop and len(starts) < limit:
            starts.append(position)
            position += chunk[position - base]
        if len(starts) >= limit:
            break
    return np.array(starts, dtype=np.int64), position


def counted_polygons(values: IntArray, limit: int, noun: str = "polygon") -> tuple[Polygons, int]:
    """Read polygons ``count index index …`` that follow each other.

    Parameters
    ----------
    values : (n,) int64
        Polygon after polygon, perhaps with something else behind the last.
    limit : int
        How many there should be. Fewer come back where the values end before.
    noun : str
        What they are, for the message.

    Returns
    -------
    polygons : Polygons
        At most ``limit``.
    end : int
        How many of the values they take.

    Raises
    ------
    InvalidMeshError
        A polygon that begins but does not end, or with a count below 0.
    """
    width = int(values[0]) + 1 if len(values) else 1
    if width > 1 and limit * width <= len(values):
        table = values[: limit * width].reshape(limit, width)
        if (table[:, 0] == width - 1).all():
            return Polygons(np.full(limit, width - 1), table[:, 1:].ravel()), limit * width
    room = len(values) + 1  # a larger count is cut short anyway, and must not overflow
    starts, end = record_starts(np.minimum(values, room) + 1, limit)
    counts = values[starts]
    if (counts < 0).any():
        bad = int(np.argmax(counts < 0))
        raise InvalidMeshError(f"{noun} {bad} declares {counts[bad]} corners")
    if end > len(values):
        raise InvalidMeshError(
            f"{noun} {len(starts) - 1} declares {counts[-1]} corners, "
            f"but {len(values) - starts[-1] - 1} numbers follow"
        )
    return Polygons(counts, values[np.repeat(starts + 1, counts) + places_in_runs(counts)]), end


def polygons_by_offsets(offsets: IntArray, connectivity: IntArray) -> Polygons:
    """Cut a run of indices at offsets.

    Parameters
    ----------
    offsets : (p,) int64
        Where each polygon ends. A 0 in front makes a polygon without corners.
    connectivity : (c,) int64
        Vertex indices, polygon after polygon.

    Returns
    -------
    Polygons
        One for each offset.

    Raises
    ------
    InvalidMeshError
        Offsets that fall, or that end after the indices.
    """
    counts = np.diff(offsets, prepend=0)
    if (counts < 0).any() or (np.abs(offsets) > len(connectivity)).any():
        where = int(np.argmax((counts < 0) | (offsets > len(connectivity))))
        raise InvalidMeshError(
            f"offset {where} of the cells is {offsets[where]:,}; expected it to rise, "
            f"up to the {len(connectivity):,} indices there are"
        )
    return Polygons(counts, connectivity[: int(counts.sum())])
