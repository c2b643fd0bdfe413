"""Numbers and polygons in text files: OFF, OBJ, ASCII PLY and STL share these."""

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.text.numerals import respelled

LARGEST_INTEGER = 2.0**53
PIECE = 1 << 22  # bytes of text that are split at a time
BLANK = re.compile(rb"\s")


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
    values, word = floats_before_word(text)
    if word is not None:
        raise InvalidMeshError(f"expected a number, found {quoted(word)}")
    return values


def floats_before_word(text: bytes) -> tuple[FloatArray, bytes | None]:
    """Read the numbers of a text up to the first word that is none.

    All spellings of `respelled` are numbers.

    Parameters
    ----------
    text : bytes
        Tokens between blanks or line ends.

    Returns
    -------
    values : (count,) float64
        One for each token.
    word : bytes or None
        The token that is no number; None where there is none.
    """
    parts: list[FloatArray] = [np.zeros(0)]
    for piece in _pieces(text):
        tokens = piece.split()
        try:
            parts.append(np.array(tokens, dtype=np.float64))
        except ValueError:
            values, word = _one_by_one(tokens)
            parts.append(values)
            if word is not None:
                return np.concatenate(parts), word
    return np.concatenate(parts), None


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


def _pieces(text: bytes) -> Iterator[bytes]:
    """Cut a long text at blanks, so that only a few words are held at a time."""
    start = 0
    while start < len(text):
        blank = BLANK.search(text, start + PIECE)
        end = blank.start() if blank else len(text)
        yield text[start:end]
        start = end


def _one_by_one(tokens: list[bytes]) -> tuple[FloatArray, bytes | None]:
    """Numbers before the first token that is none, and that token."""
    values: list[float] = []
    for token in tokens:
        value = _number(token)
        if value is None:
            return np.array(values), token
        values.append(value)
    return np.array(values), None


def _number(token: bytes) -> float | None:
    """Number of one token in any of the spellings."""
    for spelling in (token, respelled(token)):
        with contextlib.suppress(ValueError):
            return float(spelling)
    return None
