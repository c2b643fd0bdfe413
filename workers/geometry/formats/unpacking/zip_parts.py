"""Files of a zip archive, each read as a stream; all together within limits."""

import io
import zipfile
from collections.abc import Iterator
from types import TracebackType
from typing import Self
from urllib.parse import unquote

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats.limits import MeshLimits

MOST_ENTRIES = 10_000
MOST_READ = 4_096  # of them
LARGEST_RATIO = 200  # unpacked to packed
ENCRYPTED = 1  # of an entry's flags


def part_name(name: str) -> str:
    r"""Write a name so that names of one file are equal.

    Parameters
    ----------
    name : str
        As in the archive or in a reference: "/3D/a%20b.model" or "3d\\A b.model".

    Returns
    -------
    str
        In lower case, with slashes and none before.
    """
    return unquote(name).replace("\\", "/").lstrip("/").lower()


class ZipParts:
    """An open archive.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Say how much may be unpacked.
    format : str
        For messages: "3MF".

    Attributes
    ----------
    names : tuple of str
        All names, as `part_name` writes them, in the order of the archive.

    Raises
    ------
    UploadTooLargeError
        Too many entries.
    """

    def __init__(self, data: bytes, limits: MeshLimits, format: str) -> None:
        self._format = format
        self._packed = len(data)
        self._most_unpacked = limits.unpacked
        self._n_unpacked = self._n_read = 0
        self._archive = zipfile.ZipFile(io.BytesIO(data))
        entries = self._archive.infolist()
        if len(entries) > MOST_ENTRIES:
            raise UploadTooLargeError(f"the {format} archive has too many entries")
        self._entries = {part_name(entry.filename): entry for entry in reversed(entries)}
        self.names = tuple(reversed(self._entries))

    def __enter__(self) -> Self:
        return self

    def __contains__(self, name: str) -> bool:
        return name in self._entries

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._archive.close()

    def read(self, name: str) -> Iterator[bytes]:
        """Unpack one file.

        Entries may lie over each other in the archive, so the whole file counts as packed once.

        Parameters
        ----------
        name : str
            One of ``names``.

        Returns
        -------
        iterator of bytes
            Pieces of the content, never more than the directory declared.

        Raises
        ------
        UnsupportedFormatError
            The entry is encrypted.
        UploadTooLargeError
            All that was read unpacks to too much.
        """
        entry = self._entries[name]
        self._n_read += 1
        self._n_unpacked += entry.file_size
        if self._n_read > MOST_READ:
            raise UploadTooLargeError(f"the {self._format} archive has too many entries")
        if self._n_unpacked > self._most_unpacked:
            raise UploadTooLargeError(
                f"the {self._format} parts unpack to {self._n_unpacked:,} bytes, "
                f"but at most {self._most_unpacked:,} are accepted"
            )
        if self._n_unpacked > LARGEST_RATIO * max(self._packed, 1024):
            raise UploadTooLargeError(
                f"the {self._format} parts unpack to more than {LARGEST_RATIO} times the file's "
                "size"
            )
        if entry.flag_bits & ENCRYPTED:
            raise UnsupportedFormatError(
                f"the {self._format} file is encrypted: send it without a password"
            )
        return self._pieces(entry)

    def _pieces(self, entry: zipfile.ZipInfo) -> Iterator[bytes]:
        """Content of an entry, piece by piece."""
        unpacked = 0
        try:
            with self._archive.open(entry) as stream:
                while piece := stream.read(1 << 16):
                    unpacked += len(piece)
                    if unpacked > entry.file_size:
                        raise UploadTooLargeError(
                            f"a part of the {self._format} file unpacks to more than it declares"
                        )
                    yield piece
        except NotImplementedError as error:
            raise UnsupportedFormatError(
                f"the {self._format} file is packed in a way that is not read ({error}): save it "
                "again, or send it unpacked"
            ) from None
        except zipfile.BadZipFile as error:
            raise InvalidMeshError(f"the {self._format} archive is damaged: {error}") from None
