"""Data arrays of VTK's XML files: text, base64 or appended bytes, compressed or not."""

from bisect import bisect_right
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.text.tokens import floats, integers, integral, quoted
from workers.geometry.formats.unpacking.encoded import (
    Allowance,
    decode_base64,
    unpack_xz,
    unpack_zlib,
)

TYPES = {
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4"},
    **{"uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8"},
}
UNPACKERS = {"vtkzlibdatacompressor": unpack_zlib, "vtklzmadatacompressor": unpack_xz}


@dataclass(frozen=True)
class Encoding:
    """How the numbers of a file are written.

    Attributes
    ----------
    byte_order : str
        "<" or ">".
    header_type : str
        numpy's code of the sizes in front of an array: "u4" or "u8".
    compressor : str
        In lower case; empty where nothing is compressed.
    """

    byte_order: str = "<"
    header_type: str = "u4"
    compressor: str = ""


@dataclass(frozen=True)
class Appended:
    """The appended section: its bytes, or its base64 text, behind the underscore.

    Attributes
    ----------
    content : memoryview
        Of the file.
    is_base64 : bool
        Whether it is text.
    offsets : tuple of int
        Where arrays begin, in rising order.
    """

    content: memoryview
    is_base64: bool
    offsets: tuple[int, ...]

    def at(self, offset: int) -> bytes | memoryview:
        """Bytes of an array, perhaps with others behind.

        Parameters
        ----------
        offset : int
            Where the array begins.

        Returns
        -------
        bytes or memoryview
            Decoded.

        Raises
        ------
        InvalidMeshError
            Outside of the section.
        """
        if not 0 <= offset < len(self.content):
            raise InvalidMeshError(
                f"an array begins at {offset:,} of the appended data, which has "
                f"{len(self.content):,} bytes: the file is truncated or damaged"
            )
        if not self.is_base64:
            return self.content[offset:]
        following = bisect_right(self.offsets, offset)
        end = self.offsets[following] if following < len(self.offsets) else len(self.content)
        return decode_base64(bytes(self.content[offset:end]))


@dataclass(frozen=True)
class DataArray:
    """One DataArray element: its attributes and its text."""

    attributes: dict[str, str]
    text: str

    @property
    def format(self) -> str:
        """Where the numbers are: "ascii", "binary" or "appended"."""
        return self.attributes.get("format", "ascii").lower()

    @property
    def offset(self) -> int:
        """Where an appended array begins; -1 where it does not say so."""
        text = self.attributes.get("offset", "").strip()
        return int(text) if text.isascii() and text.isdigit() and len(text) <= 15 else -1


@dataclass(frozen=True)
class ArrayReader:
    """Reads arrays of one file.

    Attributes
    ----------
    encoding : Encoding
        Of the file.
    appended : Appended
        Section behind the elements.
    allowance : Allowance
        For what is decoded: an array may be named any number of times.
    """

    encoding: Encoding
    appended: Appended
    allowance: Allowance

    def floats(self, array: DataArray) -> FloatArray:
        """Numbers of an array.

        Parameters
        ----------
        array : DataArray
            Of any type and format.

        Returns
        -------
        (n,) float64

        Raises
        ------
        InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
            Damaged, of an unknown encoding, or too large.
        """
        if array.format == "ascii":
            return floats(array.text.encode())
        return as_floats(self._decoded(array))

    def integers(self, array: DataArray) -> IntArray:
        """Whole numbers of an array.

        Parameters
        ----------
        array : DataArray
            Of any type and format.

        Returns
        -------
        (n,) int64

        Raises
        ------
        InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
            Damaged, of an unknown encoding, or too large.
        """
        if array.format == "ascii":
            return integers(array.text.encode())
        values = self._decoded(array)
        if values.dtype.kind == "f":
            return integral(as_floats(values))
        return values.astype(np.int64)

    def _decoded(self, array: DataArray) -> NDArray[Any]:
        """Numbers of a binary array as they are in the file."""
        name = array.attributes.get("type", "")
        if name.lower() not in TYPES:
            raise InvalidMeshError(
                f"expected a type such as Float32, found {quoted(name.encode())}"
            )
        content: bytes | memoryview
        if array.format == "binary":
            content = decode_base64(array.text.encode())
        elif array.format == "appended":
            content = self.appended.at(array.offset)
        else:
            found = quoted(array.format.encode())
            raise InvalidMeshError(f"expected ascii, binary or appended, found {found}")
        values = _values(content, self.encoding, self.allowance)
        type = self.encoding.byte_order + TYPES[name.lower()]
        return np.frombuffer(values, type, len(values) // int(type[2]))


def _values(
    content: bytes | memoryview, encoding: Encoding, allowance: Allowance
) -> bytes | memoryview:
    """Bytes of an array behind its sizes, unpacked."""
    if not content:
        return b""
    type = encoding.byte_order + encoding.header_type
    if not encoding.compressor:
        size = _sizes(content, type, 0, 1)[0]
        start = int(type[2])
        if size > len(content) - start:
            raise InvalidMeshError(
                f"an array of the VTK file takes {size:,} bytes, but only "
                f"{len(content) - start:,} follow: it is truncated or damaged"
            )
        allowance.take(size)
        return content[start : start + size]
    if encoding.compressor not in UNPACKERS:
        raise UnsupportedFormatError(
            f"the arrays of the VTK file are packed by {quoted(encoding.compressor.encode())}; "
            "save it with ZLib compression or without"
        )
    n_blocks = _sizes(content, type, 0, 1)[0]
    if n_blocks == 0:
        return b""
    block, last = _sizes(content, type, 1, 2)
    packed = _sizes(content, type, 3, n_blocks)
    unpack = UNPACKERS[encoding.compressor]
    position = (3 + n_blocks) * int(type[2])
    pieces = []
    for number, size in enumerate(packed):
        whole = last if last and number == n_blocks - 1 else block
        pieces.append(unpack(bytes(content[position : position + size]), whole, allowance))
        position += size
    return b"".join(pieces)


def _sizes(content: bytes | memoryview, type: str, first: int, count: int) -> list[int]:
    """Sizes in front of an array."""
    width = int(type[2])
    if (first + count) * width > len(content):
        raise InvalidMeshError("an array of the VTK file ends within its sizes: it is truncated")
    sizes: list[int] = np.frombuffer(content, type, count, first * width).tolist()
    return sizes
