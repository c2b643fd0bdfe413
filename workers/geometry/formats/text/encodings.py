"""Text in UTF-16, UTF-32 or behind a byte order mark, as the bytes that text readers expect.

Windows saves text so when a program's output is redirected into a file. Readers of text know
ASCII and let pass what is above it. Here the text becomes UTF-8.
"""

import codecs
import re
from dataclasses import dataclass

import numpy as np

LOOKED_AT = 4096  # characters from the beginning
SHORTEST = 16  # characters; below that, nothing is said without a byte order mark
# Part of the characters that must be plain ASCII text, so that binary data is not taken for text.
MARKED, UNMARKED = 0.5, 0.8
UTF_8 = b"\xef\xbb\xbf"
MARKS = (  # those of four bytes first: two of them begin like those of two
    *((codecs.BOM_UTF32_LE, "utf-32-le"), (codecs.BOM_UTF32_BE, "utf-32-be")),
    *((codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be")),
)
UNITS = {"utf-32-le": "<u4", "utf-32-be": ">u4", "utf-16-le": "<u2", "utf-16-be": ">u2"}
DECLARED = re.compile(
    rb"""\A(\s*<\?xml[^>]{0,200}?encoding\s*=\s*["'])utf-?(?:16|32)[^"']*""", re.I
)
WIDEST = 4  # bytes of a character


@dataclass(frozen=True)
class Readable:
    """Bytes that the readers know.

    Attributes
    ----------
    data : bytes
        Text as UTF-8 without a byte order mark, or the file's own bytes.
    repairs : tuple of str
        What was done, in a sentence for people; empty if nothing.
    """

    data: bytes
    repairs: tuple[str, ...] = ()


def readable(data: bytes) -> Readable:
    """Turn text of wide characters into UTF-8, and leave out a byte order mark.

    Parameters
    ----------
    data : bytes
        The whole file. Binary data is given back as it is.

    Returns
    -------
    Readable
        The bytes, and what was done to them.
    """
    if data.startswith(UTF_8):
        return Readable(
            data[_length_of_marks(data) :], ("left out the byte order mark before the text",)
        )
    for mark, encoding in MARKS:
        if data.startswith(mark) and _plain_part(data[len(mark) :], encoding) >= MARKED:
            return _decoded(data[len(mark) :], encoding)
    if b"\0" not in data[: WIDEST * LOOKED_AT]:  # as every text of wide characters has
        return Readable(data)
    for encoding in UNITS:
        if _plain_part(data, encoding, at_least=SHORTEST) >= UNMARKED:
            return _decoded(data, encoding)
    return Readable(data)


def _length_of_marks(data: bytes) -> int:
    """Bytes of the UTF-8 marks in front of a text; a file may have nothing else."""
    length = len(data) - len(data.lstrip(UTF_8))
    length -= length % len(UTF_8)
    several = UTF_8 * (length // len(UTF_8))
    return length if data.startswith(several) else len(UTF_8)


def _plain_part(data: bytes, encoding: str, *, at_least: int = 1) -> float:
    """Part of the first characters that are ASCII text.

    It is 0 where one is no character at all, or where the very first is not ASCII.
    """
    kind = np.dtype(UNITS[encoding])
    count = min(LOOKED_AT, len(data) // kind.itemsize)
    units = np.trim_zeros(np.frombuffer(data, kind, count=count), "b")
    if len(units) < at_least or (units == 0).any() or (units > 0x10FFFF).any():
        return 0.0
    is_plain = (units < 0x7F) & ((units >= 0x20) | ((units >= 9) & (units <= 13)))
    return float(is_plain.mean()) if is_plain[:1].all() else 0.0


def _decoded(data: bytes, encoding: str) -> Readable:
    """Text in UTF-8; what is no character becomes a question mark."""
    kind = np.dtype(UNITS[encoding])
    units = np.frombuffer(data, kind, count=len(data) // kind.itemsize)
    if (units < 0x80).all():
        text = units.astype(np.uint8).tobytes()
    else:
        characters = units.tobytes().decode(encoding, "replace").replace("\ufeff", "")
        text = characters.encode("utf-8", "replace")
    name = encoding.upper().removesuffix("-LE").removesuffix("-BE")
    return Readable(
        DECLARED.sub(rb"\1utf-8", text), (f"read the text as {name}, not as plain text",)
    )
