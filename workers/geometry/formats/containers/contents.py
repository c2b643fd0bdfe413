"""What an archive holds, file by file: meshes, what is refused, and what is skipped."""

import io
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from workers.errors import InvalidMeshError, ProteusError, UploadTooLargeError
from workers.geometry.formats.containers.clutter import summarise
from workers.geometry.formats.containers.companions import Neighbours, with_its_files
from workers.geometry.formats.containers.judging import (
    has_archive_ending,
    has_mesh_ending,
    why_skipped,
    why_skipped_by_name,
)
from workers.geometry.formats.containers.members import Archive, ArchiveLimits, Member
from workers.geometry.formats.containers.opening import Spool, archive_kind, open_archive
from workers.geometry.formats.detect import EXPECTED

TOO_DEEP = "an archive within an archive within an archive: unpack it before uploading"


@dataclass(frozen=True)
class Found:
    """A file that is to be read as a mesh.

    Attributes
    ----------
    path : str
        As the archive has it; that of an inner archive stands before it.
    data : bytes
        Its content, for glTF with the files that it refers to.
    """

    path: str
    data: bytes


@dataclass(frozen=True)
class Refused:
    """A file that would be a mesh, and why it is not read."""

    path: str
    error: ProteusError


@dataclass(frozen=True)
class Skipped:
    """A file that is no mesh, and in short what it is."""

    path: str
    detail: str


Item = Found | Refused | Skipped


class Contents:
    """The files of an archive and of the archives in it, one level deep.

    Parameters
    ----------
    archive : Archive
        It is open.
    limits : ArchiveLimits
        Of all that is in it together.
    spool : function
        Makes the files that compressed archives are unpacked to.
    """

    def __init__(
        self, archive: Archive, limits: ArchiveLimits, *, spool: Spool = io.BytesIO
    ) -> None:
        self.archive = archive
        self._limits = limits
        self._spool = spool
        self._packed = 0  # bytes of glTF files that were joined with what they refer to

    def weights(self) -> list[int]:
        """Count the files under each place of the archive, those of inner archives too.

        Returns
        -------
        list of int
            1 for a file, and the number of its files for an archive.

        Raises
        ------
        UploadTooLargeError
            All of them together pass a limit.
        """
        members = self.archive.members
        weights, size = [1] * len(members), sum(member.size for member in members)
        for number, member in enumerate(members):
            inner = self._open(number, member)
            if inner is None or isinstance(inner, ProteusError):
                continue
            weights[number] = max(len(inner.members), 1)
            size += sum(one.size for one in inner.members)
            self._check(sum(weights), size)
        return weights

    def names_a_mesh(self) -> bool:
        """Whether the name of a file says that it is a mesh.

        Returns
        -------
        bool
            False where only reading them all would tell; inner archives are not opened.
        """
        return any(
            has_mesh_ending(member.path) and not why_skipped_by_name(member.path)
            for member in self.archive.members
        )

    def items(self, start: int = 0, stop: int | None = None) -> Iterator[Item]:
        """Read the files.

        Parameters
        ----------
        start, stop : int
            Place of the first member, and of the one after the last; all by default.

        Yields
        ------
        Found, Refused or Skipped
            In the order of the archive, each file once.
        """
        neighbours = Neighbours(self.archive.members)
        for number in range(len(self.archive.members))[start:stop]:
            member = self.archive.members[number]
            inner = self._open(number, member)
            if isinstance(inner, ProteusError):
                yield Refused(member.path, inner)
            elif inner is None:
                yield self._item(self.archive, number, neighbours)
            else:
                beside = Neighbours(inner.members)
                for place in range(len(inner.members)):
                    item = self._item(inner, place, beside)
                    yield replace(item, path=f"{member.path}/{item.path}")

    def _open(self, number: int, member: Member) -> Archive | ProteusError | None:
        """Open an archive within the archive; None where the member is none."""
        path = member.path
        if member.refusal or why_skipped_by_name(path) or not has_archive_ending(path):
            return None
        try:
            file = io.BytesIO(self.archive.read(number))
            kind = archive_kind(file, path)
            if kind is None:
                return None
            return open_archive(file, kind, self._limits, spool=self._spool)
        except ProteusError as error:
            return error

    def _item(self, archive: Archive, number: int, neighbours: Neighbours) -> Item:
        """One file; an archive that was not opened is one too many within another."""
        member = archive.members[number]
        path = member.path
        if clutter := why_skipped_by_name(path):
            return Skipped(path, clutter)
        try:
            if member.refusal is not None:
                raise member.refusal
            data = archive.read(number)
            if has_archive_ending(path) and archive_kind(io.BytesIO(data), path):
                return Skipped(path, TOO_DEEP)
            reason = why_skipped(path, data)
            return Skipped(path, reason) if reason else self._found(archive, path, data, neighbours)
        except ProteusError as error:
            is_wanted = has_mesh_ending(path) or has_archive_ending(path)
            return Refused(path, error) if is_wanted else Skipped(path, str(error))

    def _found(self, archive: Archive, path: str, data: bytes, neighbours: Neighbours) -> Found:
        """A mesh, for glTF with the files that it refers to."""
        packed = with_its_files(path, data, neighbours, archive.read, largest=self._limits.entry)
        if packed is None:
            return Found(path, data)
        self._packed += len(packed)
        if self._packed > self._limits.unpacked:
            raise UploadTooLargeError(
                f"the glTF files and what they refer to have over {self._limits.unpacked} bytes"
            )
        return Found(path, packed)

    def _check(self, entries: int, size: int) -> None:
        if entries > self._limits.entries:
            raise UploadTooLargeError(
                f"the archive and those within have {entries} entries, allowed are "
                f"{self._limits.entries}"
            )
        if size > self._limits.unpacked:
            raise UploadTooLargeError(
                f"the archive and those within unpack to {size} bytes, allowed are "
                f"{self._limits.unpacked}"
            )


def no_mesh(skipped: Iterable[str]) -> InvalidMeshError:
    """Make the error of an archive without any mesh.

    Parameters
    ----------
    skipped : iterable of str
        What each of its files is.

    Returns
    -------
    InvalidMeshError
        It says what was there.
    """
    held = summarise(skipped)
    return InvalidMeshError(
        f"the archive holds no mesh, only {held}; {EXPECTED}"
        if held
        else (f"the archive is empty; {EXPECTED}")
    )
