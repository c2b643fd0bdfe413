"""A place in a legacy VTK file, and the blocks of numbers that begin there."""

import re
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.text.tokens import floats, integers, quoted

SIZES = {
    **{"char": "i1", "signed_char": "i1", "unsigned_char": "u1", "short": "i2"},
    **{"unsigned_short": "u2", "int": "i4", "unsigned_int": "u4", "vtkidtype": "i4"},
    **{"float": "f4", "double": "f8", "long": "i8", "unsigned_long": "u8"},
    **{"vtktypeint64": "i8", "vtktypeuint64": "u8", "vtktypeint32": "i4", "vtktypeint8": "i1"},
    **{"vtktypeuint32": "u4", "vtktypeint16": "i2", "vtktypeuint16": "u2", "vtktypeuint8": "u1"},
    **{"vtktypefloat32": "f4", "vtktypefloat64": "f8", "long_long": "i8"},
}
WORD = re.compile(rb"\s*(\S+)")
LINE_END = re.compile(rb"[^\n]*\n?")
# No number, and none begins with I, as infinity does. Letters first: the search is 5 times faster.
KEYWORD = re.compile(rb"[A-HJ-Za-hj-z_](?<=\s.)[A-Za-z_]{3,}")


class Cursor:
    """Reads words, lines and blocks from a place in the file onward.

    Parameters
    ----------
    data : bytes
        The whole file; the lines of a text end in a line feed.
    position : int
        Where to begin.
    byte_order : str
        ">" or "<", or "" for text.
    """

    def __init__(self, data: bytes, position: int, byte_order: str) -> None:
        self.data = data
        self.position = position
        self.byte_order = byte_order

    def word(self) -> str:
        """Read the next word.

        Returns
        -------
        str
            In lower case; empty at the end of the file.
        """
        found = WORD.match(self.data, self.position, self.position + 4096)
        if found is None:
            rest = self.data[self.position : self.position + 4096]
            self.position += len(rest)
            return self.word() if len(rest) == 4096 else ""
        self.position = found.end()
        return found[1].decode("latin-1").lower()

    def next_is(self, word: str) -> bool:
        """Look at the next word.

        Parameters
        ----------
        word : str
            In lower case.

        Returns
        -------
        bool
            Whether it is this one; the cursor stays where it is.
        """
        before = self.position
        found = self.word() == word
        self.position = before
        return found

    def count(self, of_what: str) -> int:
        """Read a count.

        Parameters
        ----------
        of_what : str
            Keyword it belongs to, for the message.

        Returns
        -------
        int
            From 0 to 10¹⁵.

        Raises
        ------
        InvalidMeshError
            The next word is no count.
        """
        word = self.word()
        if not (word.isascii() and word.isdigit() and len(word) <= 15):
            raise InvalidMeshError(
                f"expected a count after {of_what.upper()}, found {quoted(word.encode())}"
            )
        return int(word)

    def end_line(self) -> None:
        """Go to the next line in a binary file; in a text, numbers may follow at once."""
        if self.byte_order:
            self.skip_line()

    def skip_line(self) -> None:
        """Go to the next line."""
        found = LINE_END.match(self.data, self.position)
        self.position = found.end() if found else len(self.data)

    def skip_words(self, count: int) -> None:
        """Go on behind so many words.

        Parameters
        ----------
        count : int
            How many; fewer where the file ends.
        """
        for found in islice(WORD.finditer(self.data, self.position), count):
            self.position = found.end()

    def type(self) -> str:
        """Read the name of a type of number, and end the line.

        Returns
        -------
        str
            numpy's code, such as "f4".

        Raises
        ------
        InvalidMeshError
            It is no type of VTK.
        """
        word = self.word()
        self.end_line()
        if word not in SIZES:
            raise InvalidMeshError(f"expected a type such as float, found {quoted(word.encode())}")
        return SIZES[word]

    def text_block(self) -> bytes:
        """Take the text up to the next keyword.

        Returns
        -------
        bytes
            Numbers, as they stand in the file.
        """
        found = KEYWORD.search(self.data, self.position)
        end = found.start() if found else len(self.data)
        block = self.data[self.position : end]
        self.position = end
        return block

    def floats(self, count: int, type: str, of_what: str) -> FloatArray:
        """Read a block of floats.

        Parameters
        ----------
        count : int
            How many there should be; a text may have more or fewer.
        type : str
            numpy's code.
        of_what : str
            Keyword it belongs to, for the message.

        Returns
        -------
        (count or what the text has,) float64

        Raises
        ------
        InvalidMeshError
            A binary file that ends before, or a token that is no number.
        """
        if not self.byte_order:
            return floats(self.text_block())
        return as_floats(self._binary(count, type, of_what))

    def integers(self, count: int, type: str, of_what: str) -> IntArray:
        """Read a block of integers.

        Parameters
        ----------
        count : int
            How many there should be; a text may have more or fewer.
        type : str
            numpy's code.
        of_what : str
            Keyword it belongs to, for the message.

        Returns
        -------
        (count or what the text has,) int64

        Raises
        ------
        InvalidMeshError
            A binary file that ends before, or a token that is no integer.
        """
        if not self.byte_order:
            return integers(self.text_block())
        return self._binary(count, type, of_what).astype(np.int64)

    def _binary(self, count: int, type: str, of_what: str) -> NDArray[Any]:
        """Numbers from here on, as they are in the file."""
        size = count * int(type[1])
        if self.position + size > len(self.data):
            raise InvalidMeshError(
                f"the {of_what.upper()} of the VTK file take {size:,} bytes, but only "
                f"{len(self.data) - self.position:,} follow: it is truncated or damaged"
            )
        values = np.frombuffer(self.data, self.byte_order + type, count, self.position)
        self.position += size
        return values
