"""STL as text whose facets are all written alike, read some megabytes at a time.

That is how programs write it: 21 words a triangle, of which 9 are coordinates. Other files are left
to `workers.geometry.formats.stl.text`, which knows every other way and says what is wrong.
"""

import re
from collections.abc import Iterator

import numpy as np

from workers.geometry.arrays import FloatArray

PIECE = 1 << 20  # bytes that are read at a time
WORDS = (
    *(b"facet", b"normal", b"", b"", b"", b"outer", b"loop"),
    *((b"vertex", b"", b"", b"") * 3),
    *(b"endloop", b"endfacet"),
)
"""The words of a facet; numbers are empty here."""

COORDINATES = tuple(i for i, word in enumerate(WORDS) if not word and i > WORDS.index(b"loop"))
HEADING = re.compile(rb"\s*solid\b[^\r\n]*[\r\n]\s*(?=facet\b)", re.IGNORECASE)
ENDING = re.compile(rb"(?<=endfacet)\s*(?:endsolid\b[^\r\n]*)?\s*\Z", re.IGNORECASE)
LONGEST_ENDING = 4096  # bytes


def read_plain(data: bytes) -> FloatArray | None:
    """Read a file of one solid whose facets are written alike.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    (3m, 3) float64 or None
        Positions, triangle after triangle; None where anything is written otherwise.
    """
    heading = HEADING.match(data)
    ending = ENDING.search(data, max(0, len(data) - LONGEST_ENDING))
    if heading is None or ending is None or b"," in data or b";" in data:
        return None
    first = data[heading.end() : heading.end() + LONGEST_ENDING].split(None, len(WORDS))
    words = first[: len(WORDS)]  # as this file spells them
    if len(words) < len(WORDS) or any(
        expected and word.lower() != expected for word, expected in zip(words, WORDS, strict=True)
    ):
        return None
    parts: list[FloatArray] = []
    for piece in _pieces(data, heading.end(), ending.start(), words[-1]):
        values = _coordinates(piece.split(), words)
        if values is None:
            return None
        parts.append(values)
    return np.concatenate(parts).reshape(-1, 3)


def _pieces(data: bytes, start: int, end: int, last_word: bytes) -> Iterator[bytes]:
    """Cut the facets between two places into pieces of whole ones."""
    while start < end:
        found = data.find(last_word, start + PIECE, end)
        stop = end if found < 0 else found + len(last_word)
        yield data[start:stop]
        start = stop


def _coordinates(found: list[bytes], words: list[bytes]) -> FloatArray | None:
    """Coordinates (m, 9) of facets that all have these words."""
    period = len(WORDS)
    count, rest = divmod(len(found), period)
    if rest:
        return None
    for i, expected in enumerate(WORDS):
        if expected and found[i::period].count(words[i]) != count:
            return None
    values = np.empty((count, len(COORDINATES)))
    try:
        for column, i in enumerate(COORDINATES):
            values[:, column] = np.array(found[i::period], dtype=np.float64)
    except ValueError:
        return None
    return values
