"""What all archives have in common: limits, members, and which members are refused."""

import re
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from workers.errors import (
    InvalidRequestError,
    ProteusError,
    UnsupportedFormatError,
    UploadTooLargeError,
)

SMALL = 4096  # bytes that a member may unpack to, whatever its ratio
SLACK = 64 << 20  # bytes that an archive may unpack to, whatever its ratio
_DRIVE = re.compile(r"[A-Za-z]:(?:/|$)")


@dataclass(frozen=True)
class ArchiveLimits:
    """How much an archive may hold, all that is in it together.

    Attributes
    ----------
    entries : int
        Most files and folders.
    unpacked : int
        Most bytes of all files.
    entry : int
        Most bytes of one file.
    ratio : int
        Most times that a file, or the whole, may be larger than what it is unpacked from.
    """

    entries: int = 20_000
    unpacked: int = 8 << 30
    entry: int = 256 << 20
    ratio: int = 200


@dataclass(frozen=True)
class Member:
    """A file of an archive.

    Attributes
    ----------
    path : str
        As the archive has it, with ``/`` between names.
    size : int
        Bytes that it unpacks to, as declared.
    refusal : ProteusError or None
        Why it is not read.
    """

    path: str
    size: int
    refusal: ProteusError | None = None


class Archive(Protocol):
    """An archive that is open; its folders are no members."""

    @property
    def members(self) -> Sequence[Member]:
        """In the order of the archive."""

    @property
    def is_spooled(self) -> bool:
        """Whether all of it had to be unpacked to read its first member."""

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


def refuse_path(path: str) -> ProteusError | None:
    """Refuse a path that leads out of the archive.

    Parameters
    ----------
    path : str
        As the archive has it.

    Returns
    -------
    ProteusError or None
        The reason, if there is one.
    """
    if path.startswith("/") or ".." in path.split("/") or _DRIVE.match(path):
        return InvalidRequestError("the entry's path leads out of the archive")
    return None


def refuse_mode(mode: int) -> ProteusError | None:
    """Refuse what is no regular file.

    Parameters
    ----------
    mode : int
        As Unix has it; 0 if it is not known.

    Returns
    -------
    ProteusError or None
        The reason, if there is one.
    """
    if stat.S_IFMT(mode) and not stat.S_ISREG(mode):
        return InvalidRequestError("the entry is a link or a device, expected a regular file")
    return None


def refuse_size(
    size: int, limits: ArchiveLimits, *, packed: int | None = None
) -> ProteusError | None:
    """Refuse a file that is too large, or too large for what it is unpacked from.

    Parameters
    ----------
    size : int
        Bytes that it unpacks to.
    limits : ArchiveLimits
        The limits.
    packed : int, optional
        Bytes that it is unpacked from.

    Returns
    -------
    ProteusError or None
        The reason, if there is one.
    """
    if size > limits.entry:
        return UploadTooLargeError(f"the entry has {size} bytes, allowed are {limits.entry}")
    if packed is not None and size > limits.ratio * max(packed, 1) + SMALL:
        return UploadTooLargeError(
            f"the entry unpacks to {size // max(packed, 1)} times its packed size, allowed is "
            f"{limits.ratio}"
        )
    return None


def check_whole(
    members: Sequence[Member], limits: ArchiveLimits, *, entries: int, packed: int
) -> None:
    """Check an archive's limits before anything of it is unpacked.

    Parameters
    ----------
    members : sequence of Member
        All files.
    limits : ArchiveLimits
        The limits.
    entries : int
        Number of files and folders.
    packed : int
        Bytes of the archive.

    Raises
    ------
    UploadTooLargeError
        More entries or bytes than the limits, or too many bytes for the archive's size: entries
        may lie over each other, and one alone would pass.
    """
    if entries > limits.entries:
        raise UploadTooLargeError(
            f"the archive has more entries than the {limits.entries} that are allowed"
        )
    total = sum(member.size for member in members)
    if total > limits.unpacked:
        raise UploadTooLargeError(
            f"the archive unpacks to {total} bytes, allowed are {limits.unpacked}"
        )
    read = sum(member.size for member in members if member.refusal is None)
    if read > limits.ratio * packed + SLACK:
        raise UploadTooLargeError(
            f"the archive unpacks to more than {limits.ratio} times its size, which is the most"
        )


def unreadable(kind: str, reason: str) -> UnsupportedFormatError:
    """Make the error of an archive that cannot be read at all.

    Parameters
    ----------
    kind : str
        "zip" or "tar".
    reason : str
        What was found.

    Returns
    -------
    UnsupportedFormatError
        To be raised.
    """
    return UnsupportedFormatError(f"the {kind} archive cannot be read: {reason}")
