"""One compressed file: gzip, bzip2, xz and lzma, unpacked piece by piece and never past a limit."""

import bz2
import io
import lzma
import re
import zlib
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import BinaryIO, Protocol

from workers.errors import InvalidMeshError, UploadTooLargeError

HEAD = 16  # bytes that say how a file is compressed
CHUNK = 1 << 14  # read at a time; what follows a member is read again, so not more
PIECE = 1 << 20  # unpacked at a time
MOST_MEMBERS = 100_000  # of one file; block gzip has one for each 64 KiB
LARGEST_DICTIONARY = 192 << 20  # bytes of memory that xz may take; xz -9 takes 65 MiB
LZMA_ALONE = re.compile(
    rb"[\x00-\xe0]\x00\x00[\x00-\xff]{2}(?:\xff{8}|[\x00-\xff]{5}\x00{3})", re.S
)
BZIP2 = re.compile(rb"BZh[1-9](?:1AY&SY|\x17rE8P\x90)")
BROKEN = (zlib.error, lzma.LZMAError, OSError, EOFError, ValueError)


class Decoder(Protocol):
    """What bz2 and lzma have in common."""

    @property
    def eof(self) -> bool:
        """Whether the end of the member was reached."""

    @property
    def needs_input(self) -> bool:
        """Whether nothing more comes out until bytes are put in."""

    @property
    def unused_data(self) -> bytes:
        """What follows the member."""

    def decompress(self, data: bytes, max_length: int) -> bytes:
        """Put bytes in, and get bytes out.

        Parameters
        ----------
        data : bytes
            What follows what was put in before.
        max_length : int
            Most bytes that come out.

        Returns
        -------
        bytes
            None where more has to be put in.
        """


class _Gzip:
    """One member of a gzip file, with the interface of the others."""

    def __init__(self, window: int = 31) -> None:
        self._zlib = zlib.decompressobj(window)

    @property
    def eof(self) -> bool:
        return self._zlib.eof

    @property
    def needs_input(self) -> bool:
        return not self._zlib.unconsumed_tail

    @property
    def unused_data(self) -> bytes:
        return self._zlib.unused_data

    def decompress(self, data: bytes, max_length: int) -> bytes:
        return self._zlib.decompress(self._zlib.unconsumed_tail + data, max_length)


def _xz() -> Decoder:
    return lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=LARGEST_DICTIONARY)


def _lzma() -> Decoder:
    return lzma.LZMADecompressor(lzma.FORMAT_ALONE, memlimit=LARGEST_DICTIONARY)


class RawDeflate(_Gzip):
    """A deflate stream without a header, as zip archives have it."""

    def __init__(self) -> None:
        super().__init__(-15)


DECODERS: Mapping[str, Callable[[], Decoder]] = MappingProxyType(
    {"gzip": _Gzip, "bzip2": bz2.BZ2Decompressor, "xz": _xz, "lzma": _lzma}
)


def compression_of(head: bytes, filename: str = "") -> str | None:
    """Say how a file is compressed.

    Parameters
    ----------
    head : bytes
        Its first bytes, ``HEAD`` of them.
    filename : str
        Its ending matters for lzma alone, which begins with no word of its own.

    Returns
    -------
    str or None
        "gzip", "bzip2", "xz" or "lzma"; None for what is compressed in no way that is read.
    """
    if head.startswith(b"\x1f\x8b\x08"):
        return "gzip"
    if head.startswith(b"\xfd7zXZ\0"):
        return "xz"
    if BZIP2.match(head):
        return "bzip2"
    if filename.lower().endswith((".lzma", ".tlz")) and LZMA_ALONE.match(head):
        return "lzma"
    return None


def unpacked_pieces(file: BinaryIO, compression: str, limit: int) -> Iterator[bytes]:
    """Unpack a compressed file from its beginning, all members that follow each other.

    What follows the last member is rubbish and left alone.

    Parameters
    ----------
    file : BinaryIO
        It is read from where it stands.
    compression : str
        As `compression_of` has it.
    limit : int
        Most bytes that may come out.

    Yields
    ------
    bytes
        At most a mebibyte each; of what would pass the limit, nothing.

    Raises
    ------
    InvalidMeshError
        Cut off or damaged.
    UploadTooLargeError
        More comes out than the limit, or unpacking takes too much memory.
    """
    source, total, members = _Source(file), 0, 0
    while members == 0 or compression_of(source.peek(HEAD), f".{compression}") == compression:
        members += 1
        if members > MOST_MEMBERS:
            raise UploadTooLargeError(f"the {compression} file has over {MOST_MEMBERS:,} members")
        for piece in _member(source, DECODERS[compression](), compression):
            total += len(piece)
            if total > limit:
                raise UploadTooLargeError(
                    f"the {compression} file unpacks to more than {limit:,} bytes, which is the "
                    "most that is accepted"
                )
            yield piece


def unpack(data: bytes, compression: str, limit: int) -> bytes:
    """Unpack a compressed file in memory.

    Parameters
    ----------
    data : bytes
        The whole file.
    compression : str
        As `compression_of` has it.
    limit : int
        Most bytes that may come out.

    Returns
    -------
    bytes
        What was compressed.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        See `unpacked_pieces`.
    """
    unpacked = bytearray()
    for piece in unpacked_pieces(io.BytesIO(data), compression, limit):
        unpacked += piece
    return bytes(unpacked)


def unpacked_head(file: BinaryIO, compression: str, length: int) -> bytes:
    """Unpack the beginning of a compressed file; what is damaged ends it.

    Parameters
    ----------
    file : BinaryIO
        It is read from where it stands.
    compression : str
        As `compression_of` has it.
    length : int
        So many bytes are wanted.

    Returns
    -------
    bytes
        That many at most.
    """
    decoder, head = DECODERS[compression](), b""
    try:
        while len(head) < length and not decoder.eof:
            data = file.read(CHUNK) if decoder.needs_input else b""
            if not data and decoder.needs_input:
                break
            head += decoder.decompress(data, length - len(head))
    except BROKEN:
        return head
    return head


def _member(source: "_Source", decoder: Decoder, compression: str) -> Iterator[bytes]:
    """Pieces of one member; what was read beyond its end is given back to the source."""
    try:
        while not decoder.eof:
            data = source.read() if decoder.needs_input else b""
            piece = decoder.decompress(data, PIECE)
            if piece:
                yield piece
            elif not data and decoder.needs_input and not decoder.eof:
                raise InvalidMeshError(f"the {compression} file ends early: it is cut off")
        source.give_back(decoder.unused_data)
    except BROKEN as error:
        if "emory usage limit" in str(error):
            raise UploadTooLargeError(
                f"the {compression} file takes more than {LARGEST_DICTIONARY:,} bytes of memory "
                "to unpack"
            ) from None
        reason = f"the {compression} file is damaged and cannot be unpacked"
        raise InvalidMeshError(reason) from None


class _Source:
    """A file that takes back what was read too much."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._waiting = b""

    def read(self) -> bytes:
        data, self._waiting = self._waiting, b""
        return data or self._file.read(CHUNK)

    def give_back(self, data: bytes) -> None:
        self._waiting = data + self._waiting

    def peek(self, length: int) -> bytes:
        """Next bytes, without the zeros with which members and files are filled up."""
        while True:
            self._waiting = self._waiting.lstrip(b"\0")
            if len(self._waiting) >= length or not (more := self._file.read(CHUNK)):
                return self._waiting[:length]
            self._waiting += more
