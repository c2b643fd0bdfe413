"""The numbers of a text and its lines: OFF and ASCII PLY share these."""

import re
from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.text.tokens import floats_before_word

COMMENT = re.compile(rb"#(?!(?:QNAN|SNAN|IND|INF)\b)[^\r\n]*", re.IGNORECASE)  # not "1.#QNAN"


@dataclass(frozen=True, eq=False)
class NumberText:
    """Numbers, and the lines they stand in.

    Attributes
    ----------
    values : (n,) float64
        All numbers before the first word that is none.
    lines : (l + 1,) int64
        Which number each line that is not blank begins with, then n.
    word : bytes or None
        The first word that is no number.
    """

    values: FloatArray
    lines: IntArray
    word: bytes | None

    @property
    def data(self) -> memoryview:
        """The numbers as bytes."""
        return self.values.view(np.uint8).data

    @property
    def n_lines(self) -> int:
        """Lines that are not blank."""
        return len(self.lines) - 1


def read_numbers(text: bytes) -> NumberText:
    """Read the numbers of a text.

    Parameters
    ----------
    text : bytes
        Without comments.

    Returns
    -------
    NumberText
        NaN and infinity are numbers here, however they are spelled.
    """
    values, word = floats_before_word(text)
    every_byte = np.frombuffer(text, dtype=np.uint8)
    filled = (every_byte != ord(" ")) & ((every_byte < ord("\t")) | (every_byte > ord("\r")))
    starts_word = filled.copy()
    starts_word[1:] &= ~filled[:-1]
    words = np.flatnonzero(starts_word)  # (n,), in bytes
    breaks = np.flatnonzero((every_byte == ord("\n")) | (every_byte == ord("\r")))
    lines = np.concatenate([[0], np.searchsorted(words, breaks)])  # sorted; blank lines repeat
    inside = lines[np.append(lines[1:] != lines[:-1], True) & (lines < len(values))]
    return NumberText(values, np.append(inside, len(values)), word)


def without_comments(text: bytes) -> bytes:
    """Take out what stands between ``#`` and the end of its line.

    Parameters
    ----------
    text : bytes
        A text file.

    Returns
    -------
    bytes
        The text with its line ends.
    """
    return COMMENT.sub(b"", text) if b"#" in text else text
