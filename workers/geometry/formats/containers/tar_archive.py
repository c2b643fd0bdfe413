"""Tar archives: v7, ustar, GNU and pax headers, read in bounded memory.

`tarfile` reads a header's extension whole, however long it is.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

from workers.errors import (
    InvalidMeshError,
    InvalidRequestError,
    ProteusError,
    UnsupportedFormatError,
    UploadTooLargeError,
)
from workers.geometry.formats.containers.members import (
    ArchiveLimits,
    Member,
    check_whole,
    refuse_path,
    refuse_size,
    unreadable,
)

BLOCK = 512
LONGEST_EXTENSION = 1 << 20  # bytes of a long name or of a pax header
FOLDERS = b"5D"
LINKS_AND_DEVICES = b"12346"
LONG_NAME, LONG_LINK, PAX, PAX_OF_ALL, VOLUME, SPARSE = b"L", b"K", b"xX", b"g", b"VM", b"S"


@dataclass
class _Extensions:
    """What stands before a header, and holds for it."""

    name: str | None = None
    pax: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Entry:
    path: str
    size: int
    kind: bytes
    offset: int


def is_tar(head: bytes) -> bool:
    """Whether a file begins with a header of tar.

    Parameters
    ----------
    head : bytes
        Its first 512 bytes.

    Returns
    -------
    bool
        By the header's check sum.
    """
    return len(head) >= BLOCK and head[0] != 0 and _checks(head[:BLOCK])


class TarArchive:
    """A tar archive that is open.

    Parameters
    ----------
    file : BinaryIO
        The archive, unpacked; it is read while members are.
    limits : ArchiveLimits
        The limits.
    packed : int
        Bytes that it was unpacked from.
    is_spooled : bool
        Whether it was compressed.

    Raises
    ------
    UnsupportedFormatError, UploadTooLargeError
        It cannot be read, or passes a limit.
    """

    def __init__(
        self, file: BinaryIO, limits: ArchiveLimits, *, packed: int, is_spooled: bool
    ) -> None:
        self._file = file
        self._length = file.seek(0, 2)
        self.is_spooled = is_spooled
        entries = list(self._read_headers(limits))
        self._entries = [e for e in entries if e.kind not in FOLDERS and not e.path.endswith("/")]
        self.members: Sequence[Member] = [
            Member(entry.path, entry.size, self._refusal(entry, limits)) for entry in self._entries
        ]
        check_whole(self.members, limits, entries=len(entries), packed=packed)

    def read(self, number: int) -> bytes:
        """Return the bytes of a member.

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
        InvalidMeshError
            The archive is cut off.
        """
        entry = self._entries[number]
        self._file.seek(entry.offset)
        data = self._file.read(entry.size)
        if len(data) < entry.size:
            raise InvalidMeshError("the entry is cut off with the end of the archive")
        return data

    def _read_headers(self, limits: ArchiveLimits) -> Iterator[_Entry]:
        """Headers from the first to the one of zeros, or to where the file is cut off."""
        at, count, extensions = 0, 0, _Extensions()
        while at + BLOCK <= self._length:
            self._file.seek(at)
            header = self._file.read(BLOCK)
            if not header.strip(b"\0"):
                return
            if not _checks(header):
                raise unreadable("tar", f"it is damaged at byte {at:,}")
            count += 1
            if count > 4 * limits.entries:
                raise UploadTooLargeError(f"the archive has over {4 * limits.entries} headers")
            size, kind = _number(header[124:136]), header[156:157]
            if size < 0:
                raise unreadable("tar", f"it is damaged at byte {at:,}")
            at = self._after_sparse(at, header) if kind == SPARSE else at + BLOCK
            if kind in LONG_NAME + LONG_LINK + PAX + PAX_OF_ALL:
                self._extend(extensions, kind, size)
            elif kind not in VOLUME:
                entry = _entry(header, extensions, size, kind, at)
                size, extensions = entry.size, _Extensions()
                yield entry
            has_data = kind not in LINKS_AND_DEVICES + FOLDERS
            at += -(-size // BLOCK) * BLOCK if has_data else 0

    def _after_sparse(self, at: int, header: bytes) -> int:
        """Where the data of a sparse file begins: its map may go on in further blocks."""
        at += BLOCK
        more = header[482]
        while more and at + BLOCK <= self._length:
            self._file.seek(at)
            more = self._file.read(BLOCK)[504]
            at += BLOCK
        return at

    def _extend(self, extensions: _Extensions, kind: bytes, size: int) -> None:
        """Read what holds for the next header; what holds for all of them names no file."""
        if size > LONGEST_EXTENSION:
            raise UploadTooLargeError(
                f"a header of the archive has {size} bytes, allowed are {LONGEST_EXTENSION}"
            )
        data = self._file.read(size)
        if kind == LONG_NAME:
            extensions.name = _text(data)
        elif kind in PAX:
            extensions.pax.update(_pax(data))

    def _refusal(self, entry: _Entry, limits: ArchiveLimits) -> ProteusError | None:
        if entry.kind in LINKS_AND_DEVICES:
            return InvalidRequestError("the entry is a link or a device, expected a regular file")
        if entry.kind == SPARSE:
            return UnsupportedFormatError("the entry is a sparse file, which is not read")
        return refuse_path(entry.path) or refuse_size(entry.size, limits)


def _entry(header: bytes, extensions: _Extensions, size: int, kind: bytes, at: int) -> _Entry:
    """Read a header with what stood before it."""
    name = _text(header[:100])
    if header[257:263] == b"ustar\0" and header[345] and kind not in SPARSE:
        name = f"{_text(header[345:500])}/{name}"
    name = extensions.pax.get("path") or extensions.name or name
    given = extensions.pax.get("size", "")
    if given.isascii() and given.isdecimal() and len(given) < 19:
        size = int(given)
    if "GNU.sparse.major" in extensions.pax or "GNU.sparse.map" in extensions.pax:
        kind = SPARSE
    if kind in LINKS_AND_DEVICES + FOLDERS:
        size = 0
    return _Entry(name.replace("\\", "/"), size, kind, at)


def _checks(header: bytes) -> bool:
    """Whether the check sum is right, of bytes with or without a sign, as writers have it."""
    declared = _number(header[148:156])
    counted = header[:148] + b" " * 8 + header[156:]
    unsigned = sum(counted)
    return declared in (unsigned, unsigned - 256 * sum(byte > 127 for byte in counted))


def _number(data: bytes) -> int:
    """Read an octal number, or a binary one where the first bit is set; -1 for anything else."""
    if data[0] & 0x80:
        return (
            -1 if data[0] & 0x40 else int.from_bytes(data, "big") & ~(0x80 << 8 * (len(data) - 1))
        )
    digits = data.partition(b"\0")[0].strip()
    if not digits:
        return 0
    return int(digits, 8) if digits.isdigit() and not set(digits) & set(b"89") else -1


def _pax(data: bytes) -> Iterator[tuple[str, str]]:
    """Records of a pax header: length, key and value; damage ends them."""
    at = 0
    while at < len(data):
        digits, space, _ = data[at : at + 12].partition(b" ")
        length = int(digits) if space and digits.isdigit() else 0
        record = data[at + len(digits) + 1 : at + length]
        if length < 5 or not record.endswith(b"\n"):
            return
        key, _, value = record[:-1].partition(b"=")
        yield _text(key), _text(value)
        at += length


def _text(data: bytes) -> str:
    """Text up to the first zero: UTF-8, or else Latin-1."""
    data = data.partition(b"\0")[0]
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")
