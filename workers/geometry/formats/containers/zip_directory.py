"""The directory of a zip archive: where its files lie, and what they are called.

It is read here rather than by `zipfile`, which refuses a whole archive for one name that is not
UTF-8 and reads a directory of any length into memory.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import BinaryIO

from workers.errors import UploadTooLargeError
from workers.geometry.formats.containers.members import ArchiveLimits, unreadable

LOCAL, CENTRAL, END = b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06"
LONG_LOCATOR, LONG_END = b"PK\x06\x07", b"PK\x06\x06"
END_RECORD = struct.Struct("<4s4H2LH")
LOCATOR_RECORD = struct.Struct("<4sLQL")
LONG_END_RECORD = struct.Struct("<4sQ2H2L4Q")
ENTRY = struct.Struct("<4s4B4H3L5H2L")
SEARCHED = END_RECORD.size + 65_535 + 1024  # the comment, and some rubbish behind it
BYTES_AN_ENTRY = 1024  # of the directory
UTF8, ENCRYPTED = 0x800, 0x1
LONG = 0xFFFFFFFF


@dataclass(frozen=True)
class ZipEntry:
    """An entry of the directory; `offset` counts from the beginning of the file."""

    path: str
    flags: int
    method: int
    checksum: int
    packed: int
    size: int
    mode: int
    offset: int

    @property
    def is_folder(self) -> bool:
        """Whether its name ends as those of folders do."""
        return self.path.endswith("/")


def read_directory(file: BinaryIO, limits: ArchiveLimits) -> list[ZipEntry]:
    """Read the directory of a zip archive.

    Parameters
    ----------
    file : BinaryIO
        The archive; something may stand before it, as in one that unpacks itself.
    limits : ArchiveLimits
        Most entries, by which the directory's length is limited too.

    Returns
    -------
    list of ZipEntry
        Files and folders in the order of the directory; one more than the limit at most.

    Raises
    ------
    UnsupportedFormatError
        It has no directory, or a damaged one.
    UploadTooLargeError
        The directory is too long.
    """
    start, length, shift = _find_directory(file)
    allowed = limits.entries * BYTES_AN_ENTRY
    if length > allowed:
        raise UploadTooLargeError(
            f"the archive's directory has {length} bytes, allowed are {allowed}"
        )
    file.seek(start)
    return list(islice(_entries(file.read(length), shift), limits.entries + 1))


def _find_directory(file: BinaryIO) -> tuple[int, int, int]:
    """Start and length of the directory, and how far all offsets are off.

    The end record stands last, before a comment that may hold anything, even end records.
    """
    size = file.seek(0, 2)
    before = max(0, size - SEARCHED)
    file.seek(before)
    tail = file.read()
    at = tail.rfind(END)
    if at < 0:
        raise unreadable("zip", "it has no directory; it may be cut off")
    while at >= 0:
        if len(tail) - at >= END_RECORD.size:
            found = _read_end(file, before + at, tail[at : at + END_RECORD.size])
            if found is not None:
                return found
        at = tail.rfind(END, 0, at)
    raise unreadable("zip", "its directory is not where it should be; it may be cut off")


def _read_end(file: BinaryIO, at: int, record: bytes) -> tuple[int, int, int] | None:
    """Read an end record, and the longer one before it if there is one."""
    _, disk, _, _, entries, length, offset, _ = END_RECORD.unpack(record)
    end = at
    file.seek(max(0, at - LOCATOR_RECORD.size))
    locator = file.read(LOCATOR_RECORD.size)
    if at >= LOCATOR_RECORD.size and locator.startswith(LONG_LOCATOR):
        declared = LOCATOR_RECORD.unpack(locator)[2]
        for place in (at - LOCATOR_RECORD.size - LONG_END_RECORD.size, declared):
            file.seek(max(0, min(place, at)))
            record = file.read(LONG_END_RECORD.size)
            if len(record) == LONG_END_RECORD.size and record.startswith(LONG_END):
                _, _, _, _, disk, _, _, entries, length, offset = LONG_END_RECORD.unpack(record)
                end = min(place, at)
                break
    if disk not in (0, 0xFFFF):
        raise unreadable("zip", "it is one piece of a split archive; join the pieces")
    if entries == 0 and length == 0:
        return end, 0, 0
    for start in (end - length, offset):
        if 0 <= start < end:
            file.seek(start)
            if file.read(4) == CENTRAL:
                return start, length, start - offset
    return None


def _entries(directory: bytes, shift: int) -> Iterator[ZipEntry]:
    """Entries of a directory; what is no entry ends it."""
    at = 0
    while at + ENTRY.size <= len(directory):
        fields = ENTRY.unpack_from(directory, at)
        if fields[0] != CENTRAL:
            break
        flags, method = fields[5:7]
        checksum, packed, size = fields[9:12]
        name_length, extra_length, comment_length = fields[12:15]
        attributes, offset = fields[17:19]
        at += ENTRY.size
        name = directory[at : at + name_length]
        extra = directory[at + name_length : at + name_length + extra_length]
        at += name_length + extra_length + comment_length
        if at > len(directory):
            raise unreadable("zip", "its directory is cut off")
        size, packed, offset = _long_fields(extra, size, packed, offset)
        path = _decode(name, flags, extra).replace("\\", "/")
        if attributes & 0x10 and not size and not path.endswith("/"):
            path += "/"
        mode = attributes >> 16
        yield ZipEntry(path, flags, method, checksum, packed, size, mode, offset + shift)
    if at == 0 and directory:
        raise unreadable("zip", "its directory is damaged")


def _extra_fields(extra: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + 4 <= len(extra):
        kind, length = struct.unpack_from("<HH", extra, at)
        yield kind, extra[at + 4 : at + 4 + length]
        at += 4 + length


def _long_fields(extra: bytes, size: int, packed: int, offset: int) -> tuple[int, int, int]:
    """Sizes and offset, those that do not fit 32 bits from the extra field."""
    values = [size, packed, offset]
    for kind, content in _extra_fields(extra):
        if kind == 1:
            whole = content[: len(content) // 8 * 8]
            numbers = (number for (number,) in struct.iter_unpack("<Q", whole))
            values = [next(numbers, value) if value == LONG else value for value in values]
            break
    return values[0], values[1], values[2]


def _decode(name: bytes, flags: int, extra: bytes) -> str:
    """Name of an entry: UTF-8 where it is that, flagged or not; or else as DOS wrote it."""
    for kind, content in _extra_fields(extra):
        if kind == 0x7075 and content[1:5] == zlib.crc32(name).to_bytes(4, "little"):
            name, flags = content[5:], flags | UTF8
    name = name.partition(b"\0")[0]
    try:
        text = name.decode("utf-8")
    except UnicodeDecodeError:
        return name.decode("cp437")
    if text.isascii():
        return text
    try:  # UTF-8 that was taken for DOS and written as UTF-8 again
        return text.encode("cp437").decode("utf-8")
    except UnicodeError:
        return text
