"""Numbers and polygons in text files: OFF, OBJ, ASCII PLY and STL share these."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray

LARGEST_INTEGER = 2.0**53


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces of any number of corners.

    Attributes
    ----------
    counts : (p,) int64
        Number of corners a polygon.
    corners : (sum of counts,) int64
        Vertex indices, polygon after polygon.
    """

    counts: IntArray
    corners: IntArray


def quoted(token: bytes) -> str:
    """Quote a token for a message.

    Parameters
    ----------
    token : bytes
        Whatever the file has there.

    Returns
    -------
    str
        In quotes, printable, of at most 24 characters and an ellipsis.
    """
    text = token[:24].decode("ascii", "replace")
    printable = "".join(c if c.isprintable() else "?" for c in text)
    return f"'{printable}{'…' if len(token) > 24 else ''}'"


def floats(text: bytes) -> FloatArray:
    """Read all numbers of a text; NaN and infinity are numbers here.

    Parameters
    ----------
    text : bytes
        Tokens between blanks or line ends.

    Returns
    -------
    (count,) float64
        One for each token.

    Raises
    ------
    InvalidMeshError
        A token is no number.
    """
    tokens = text.split()
    try:
        return np.array(tokens, dtype=np.float64)
    except ValueError:
        raise InvalidMeshError(f"expected a number, found {_first_bad(tokens)}") from None


def integers(text: bytes) -> IntArray:
    """Read all numbers of a text as integers: "3.0" counts as 3, "3.5" does not.

    Parameters
    ----------
    text : bytes
        Tokens between blanks or line ends.

    Returns
    -------
    (count,) int64
        One for each token.

    Raises
    ------
    InvalidMeshError
        A token is no integer.
    """
    try:
        return np.array(text.split(), dtype=np.int64)
    except (ValueError, OverflowError):
        return integral(floats(text))


def integral(values: FloatArray) -> IntArray:
    """Turn floats into integers.

    Parameters
    ----------
    values : (n,) float64
        Whole numbers below 2**53.

    Returns
    -------
    (n,) int64
        The same numbers.

    Raises
    ------
    InvalidMeshError
        One is no integer.
    """
    good = (np.abs(values) < LARGEST_INTEGER) & (values == np.rint(values))
    if not good.all():
        found = values[np.argmin(good)]
        raise InvalidMeshError(f"expected a count or a vertex index, found {found:g}")
    return values.astype(np.int64)


def polygon_lines(lines: Sequence[bytes]) -> Polygons:
    """Read polygons that stand each on its own line as ``count index index … [anything]``.

    Parameters
    ----------
    lines : sequence of bytes
        None of them blank.

    Returns
    -------
    Polygons
        One for each line.

    Raises
    ------
    InvalidMeshError
        A line with fewer numbers than it declares, or a token that is no number.
    """
    if not lines:
        return Polygons(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    text = b"\n".join(lines)
    width = len(lines[0].split())
    tokens: IntArray | FloatArray
    try:
        tokens = np.array(text.split(), dtype=np.int64)
    except (ValueError, OverflowError):
        tokens = floats(text)  # colours of the faces may have a decimal point
    if len(tokens) == width * len(lines):
        table = tokens.reshape(len(lines), width)
        n_corners = int(integral(table[:1, 0].astype(np.float64))[0])
        if 0 < n_corners < width and (table[:, 0] == n_corners).all():
            corners = _as_integers(table[:, 1 : n_corners + 1].ravel())
            return Polygons(np.full(len(lines), n_corners), corners)
    lengths = np.array([len(line.split()) for line in lines])  # (p,)
    return _ragged_polygons(tokens, lengths)


def places_in_runs(counts: IntArray) -> IntArray:
    """Count within runs: 0 … counts[0] - 1, then 0 … counts[1] - 1, and so on.

    Parameters
    ----------
    counts : (p,) int64
        Length of each run, from 0.

    Returns
    -------
    (sum of counts,) int64
        Place of each element in its run.
    """
    before = np.cumsum(counts) - counts  # (p,)
    return np.arange(int(counts.sum())) - np.repeat(before, counts)


def _ragged_polygons(tokens: IntArray | FloatArray, lengths: IntArray) -> Polygons:
    """Polygons of lines with so many tokens each."""
    starts = np.cumsum(lengths) - lengths  # (p,)
    counts = _as_integers(tokens[starts])
    bad = (counts < 0) | (counts >= lengths)
    if bad.any():
        face = int(np.argmax(bad))
        raise InvalidMeshError(
            f"face {face} declares {counts[face]} corners, but {lengths[face] - 1} numbers follow"
        )
    corners = tokens[np.repeat(starts + 1, counts) + places_in_runs(counts)]
    return Polygons(counts, _as_integers(corners))


def _as_integers(values: IntArray | FloatArray) -> IntArray:
    """Values as int64, checked where they are floats."""
    if values.dtype == np.int64:
        return values.astype(np.int64, copy=False)
    return integral(values.astype(np.float64))


def _first_bad(tokens: list[bytes]) -> str:
    """Return the first token that is no number, quoted."""
    for token in tokens:
        try:
            float(token)
        except ValueError:
            return quoted(token)
    return "something else"
