"""The signature of a stored shape as a row of bytes: all rows have the same length.

The numbers of the points come first, so that a short look reads the beginning alone.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from workers.retrieval.windows.moments import NUMBERS
from workers.retrieval.windows.signature import (
    FAR_POINTS,
    KINDS,
    STORED_POINTS,
    Signature,
    decoded,
)

PREFIX_POINTS = 64
"""Points of the first look."""

_OF_A_POINT = KINDS * NUMBERS
PREFIX_BYTES = PREFIX_POINTS * _OF_A_POINT
_PAIRS = FAR_POINTS * (FAR_POINTS - 1) // 2
_LAYOUT = (
    ("numbers", np.dtype(np.uint8), (1, STORED_POINTS, KINDS, NUMBERS)),
    ("reaches", np.dtype("<u2"), (1, STORED_POINTS)),
    ("areas", np.dtype("<f2"), (STORED_POINTS,)),
    ("mutual", np.dtype(np.uint8), (_PAIRS,)),
    ("scalars", np.dtype("<f4"), (4,)),
)
ROW_BYTES = sum(kind.itemsize * int(np.prod(shape)) for _, kind, shape in _LAYOUT)


def write_row(signature: Signature) -> bytes:
    """Bytes of a stored signature.

    Parameters
    ----------
    signature : Signature
        Of one scale. A tiny mesh has fewer points, so they are repeated.

    Returns
    -------
    bytes
        `ROW_BYTES` of them.
    """
    arrays = _padded(signature).to_arrays()
    return b"".join(
        np.ascontiguousarray(arrays[name], dtype=kind).reshape(shape).tobytes()
        for name, kind, shape in _LAYOUT
    )


def read_row(row: NDArray[np.uint8]) -> Signature:
    """The signature that `write_row` wrote.

    Parameters
    ----------
    row : (ROW_BYTES,) uint8
        Its bytes.

    Returns
    -------
    Signature
        Rounded as it was stored.
    """
    arrays = {}
    place = 0
    for name, kind, shape in _LAYOUT:
        size = kind.itemsize * int(np.prod(shape))
        part = np.ascontiguousarray(row[place : place + size])
        arrays[name] = part.view(kind).reshape(shape)
        place += size
    return Signature.from_arrays(arrays)


def read_numbers(row: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Numbers of all points.

    Parameters
    ----------
    row : (ROW_BYTES,) uint8
        The bytes of a signature.

    Returns
    -------
    (STORED_POINTS, 7, 7) float32
    """
    codes = row[: STORED_POINTS * _OF_A_POINT]
    return decoded(codes.reshape(STORED_POINTS, KINDS, NUMBERS))


def read_prefixes(rows: NDArray[np.uint8], windows: NDArray[np.intp]) -> NDArray[np.float32]:
    """Numbers of some windows of the first points.

    Parameters
    ----------
    rows : (m, PREFIX_BYTES or more) uint8
        The beginnings of rows.
    windows : (w,) int
        Of 7.

    Returns
    -------
    (m, PREFIX_POINTS, w, 7) float32
    """
    codes = rows[:, :PREFIX_BYTES].reshape(len(rows), PREFIX_POINTS, KINDS, NUMBERS)
    return decoded(codes[:, :, windows])


def _padded(signature: Signature) -> Signature:
    """The signature with points repeated until there are enough; these have no area."""
    count = signature.n_points
    if count >= STORED_POINTS and len(signature.mutual) >= FAR_POINTS:
        return signature
    points = np.resize(np.arange(count), STORED_POINTS)
    far = np.resize(np.arange(len(signature.mutual)), FAR_POINTS)
    areas = np.where(np.arange(STORED_POINTS) < count, signature.areas[points], np.float32(0.0))
    return replace(
        signature,
        numbers=signature.numbers[:, points],
        reaches=signature.reaches[:, points],
        areas=areas,
        mutual=signature.mutual[np.ix_(far, far)],
    )
