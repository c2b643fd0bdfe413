"""Zip archives: stored, deflated, bzip2 and LZMA; sizes are those of the directory."""

import bz2
import lzma
import struct
import zlib
from collections.abc import Sequence
from typing import BinaryIO

from workers.errors import (
    InvalidMeshError,
    ProteusError,
    UnsupportedFormatError,
    UploadTooLargeError,
)
from workers.geometry.formats.containers.compression import BROKEN, Decoder, RawDeflate
from workers.geometry.formats.containers.members import (
    ArchiveLimits,
    Member,
    check_whole,
    refuse_mode,
    refuse_path,
    refuse_size,
)
from workers.geometry.formats.containers.zip_directory import (
    ENCRYPTED,
    LOCAL,
    ZipEntry,
    read_directory,
)

CHUNK = 1 << 16
STORED, DEFLATED, BZIP2, LZMA = 0, 8, 12, 14
NAMES = {9: "Deflate64", 93: "Zstandard", 95: "xz", 98: "PPMd", 99: "AES encryption"}
LARGEST_DICTIONARY = 64 << 20


class ZipArchive:
    """A zip archive that is open.

    Parameters
    ----------
    file : BinaryIO
        The archive; it is read while members are.
    limits : ArchiveLimits
        The limits.

    Raises
    ------
    UnsupportedFormatError, UploadTooLargeError
        It cannot be read, or passes a limit.
    """

    is_spooled = False

    def __init__(self, file: BinaryIO, limits: ArchiveLimits) -> None:
        self._file = file
        entries = read_directory(file, limits)
        self._entries = [entry for entry in entries if not entry.is_folder]
        self.members: Sequence[Member] = [
            Member(entry.path, entry.size, _refusal(entry, limits)) for entry in self._entries
        ]
        check_whole(self.members, limits, entries=len(entries), packed=file.seek(0, 2))

    def read(self, number: int) -> bytes:
        """Unpack a member.

        Parameters
        ----------
        number : int
            Its place among the members; it must not be refused.

        Returns
        -------
        bytes
            As many as it declares.

        Raises
        ------
        InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
            It is damaged, packed in a way that is not read, or larger than it declares.
        """
        entry = self._entries[number]
        try:
            left = self._begin(entry)
            decoder, left = self._decoder(entry, left)
            data = self._unpack(entry, decoder, left)
        except BROKEN:
            raise InvalidMeshError("the entry cannot be unpacked: it is damaged") from None
        if len(data) < entry.size:
            raise InvalidMeshError("the entry cannot be unpacked: it ends early")
        if zlib.crc32(data) != entry.checksum:
            raise InvalidMeshError("the entry cannot be unpacked: its check sum is wrong")
        return data

    def _begin(self, entry: ZipEntry) -> int:
        """Go to the entry's data; how many packed bytes there are."""
        self._file.seek(max(0, entry.offset))
        header = self._file.read(30)
        if len(header) < 30 or not header.startswith(LOCAL):
            raise InvalidMeshError("the entry cannot be unpacked: it is not where it should be")
        self._file.seek(sum(struct.unpack_from("<HH", header, 26)), 1)
        return entry.packed

    def _decoder(self, entry: ZipEntry, left: int) -> tuple[Decoder | None, int]:
        """Return what unpacks the entry, and how many bytes it takes."""
        if entry.method == STORED:
            return None, left
        if entry.method == DEFLATED:
            return RawDeflate(), left
        if entry.method == BZIP2:
            return bz2.BZ2Decompressor(), left
        if entry.method == LZMA:
            header = self._file.read(4)
            length = int.from_bytes(header[2:4], "little")
            return _lzma(self._file.read(length)), left - 4 - length
        name = NAMES.get(entry.method, f"method {entry.method}")
        raise UnsupportedFormatError(
            f"the entry is packed by {name}, which is not read; pack it with deflate"
        )

    def _unpack(self, entry: ZipEntry, decoder: Decoder | None, left: int) -> bytes:
        """Unpack so many bytes at most, and never more than declared."""
        if decoder is None:
            return self._file.read(min(left, entry.size))
        data = bytearray()
        while not decoder.eof:
            fed = b""
            if decoder.needs_input and left > 0:
                fed = self._file.read(min(CHUNK, left))
                left = left - len(fed) if fed else 0
            piece = decoder.decompress(fed, entry.size + 1 - len(data))
            data += piece
            if len(data) > entry.size:
                raise UploadTooLargeError(
                    f"the entry unpacks to more than the {entry.size} bytes that it declares"
                )
            if not piece and not fed:
                break
        return bytes(data)


def _lzma(properties: bytes) -> Decoder:
    """Decoder of raw LZMA, as the properties of the entry describe it."""
    if len(properties) < 5:
        raise InvalidMeshError("the entry cannot be unpacked: it is damaged")
    rest, lc = divmod(properties[0], 9)
    pb, lp = divmod(rest, 5)
    dictionary = int.from_bytes(properties[1:5], "little")
    if dictionary > LARGEST_DICTIONARY:
        raise UploadTooLargeError(
            f"the entry takes a dictionary of {dictionary:,} bytes to unpack, allowed are "
            f"{LARGEST_DICTIONARY:,}"
        )
    chain = {"id": lzma.FILTER_LZMA1, "dict_size": max(dictionary, 4096)}
    filters = [{**chain, "lc": lc, "lp": lp, "pb": pb}]
    return lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=filters)


def _refusal(entry: ZipEntry, limits: ArchiveLimits) -> ProteusError | None:
    if entry.flags & ENCRYPTED:
        return UnsupportedFormatError("the entry is encrypted; pack it without a password")
    return (
        refuse_path(entry.path)
        or refuse_mode(entry.mode)
        or refuse_size(entry.size, limits, packed=entry.packed)
    )
