"""Which files are archives, and opening one."""

import io
from collections.abc import Callable
from typing import BinaryIO

from workers.errors import ProteusError, UploadTooLargeError
from workers.geometry.formats.amf.package import is_amf
from workers.geometry.formats.containers.clutter import ending_of
from workers.geometry.formats.containers.compression import (
    HEAD,
    compression_of,
    unpacked_head,
    unpacked_pieces,
)
from workers.geometry.formats.containers.members import SLACK, Archive, ArchiveLimits
from workers.geometry.formats.containers.tar_archive import BLOCK, TarArchive, is_tar
from workers.geometry.formats.containers.zip_archive import ZipArchive
from workers.geometry.formats.containers.zip_directory import END, LOCAL, read_directory
from workers.geometry.formats.refusals.refusal import refused_content
from workers.geometry.formats.threemf import is_3mf

LOOKED_AT = 1 << 13
NAMES_LOOKED_AT = 4096
SPANNED = b"PK\x07\x08PK\x03\x04"  # an archive that was to be split, and was not
_DOCUMENTS = "docx xlsx pptx odt ods odp epub jar apk usdz fcstd f3d f3z 3dxml sketch kra ora npz"
ZIPPED_DOCUMENTS = frozenset(_DOCUMENTS.split())
Spool = Callable[[], BinaryIO]


def archive_kind(file: BinaryIO, filename: str = "") -> str | None:
    """Say which kind of archive a file is.

    Formats that are zip archives themselves, as 3MF is one with a model inside, are none here. A
    zip archive whose directory cannot be read is one: opening it says why.

    Parameters
    ----------
    file : BinaryIO
        Only its beginning and end are read.
    filename : str
        Its ending matters for documents, and for lzma.

    Returns
    -------
    str or None
        "zip", "tar", or how a tar archive is compressed: "gzip", "bzip2", "xz" or "lzma".
    """
    file.seek(0)
    head = file.read(LOOKED_AT)
    if head.startswith((LOCAL, END, SPANNED)):
        return "zip" if _is_zip_of_files(file, head, filename) else None
    if is_tar(head[:BLOCK]):
        return "tar"
    compression = compression_of(head[:HEAD], filename)
    if compression is not None:
        file.seek(0)
        if is_tar(unpacked_head(file, compression, BLOCK)):
            return compression
    return None


def open_archive(
    file: BinaryIO, kind: str, limits: ArchiveLimits, *, spool: Spool = io.BytesIO
) -> Archive:
    """Open an archive within its limits.

    Parameters
    ----------
    file : BinaryIO
        The archive.
    kind : str
        As `archive_kind` has it.
    limits : ArchiveLimits
        The limits.
    spool : function
        Makes the file that a compressed archive is unpacked to.

    Returns
    -------
    Archive
        With its members.

    Raises
    ------
    UnsupportedFormatError, InvalidMeshError
        It cannot be read.
    UploadTooLargeError
        It passes a limit.
    """
    if kind == "zip":
        return ZipArchive(file, limits)
    packed = file.seek(0, 2)
    if kind == "tar":
        return TarArchive(file, limits, packed=packed, is_spooled=False)
    file.seek(0)
    allowed = min(limits.unpacked + BLOCK * 4 * limits.entries, limits.ratio * packed + SLACK)
    unpacked = spool()
    try:
        for piece in unpacked_pieces(file, kind, allowed):
            unpacked.write(piece)
    except UploadTooLargeError:
        raise UploadTooLargeError(
            f"the archive unpacks to more than {allowed:,} bytes, which is the most for its size"
        ) from None
    return TarArchive(unpacked, limits, packed=packed, is_spooled=True)


def _is_zip_of_files(file: BinaryIO, head: bytes, filename: str) -> bool:
    """Whether a zip archive is no format of its own."""
    if ending_of(filename) in ZIPPED_DOCUMENTS:
        return False
    file.seek(max(0, file.seek(0, 2) - LOOKED_AT))
    if refused_content(head + file.read(), filename):
        return False
    try:
        entries = read_directory(file, ArchiveLimits(entries=NAMES_LOOKED_AT))
    except ProteusError:
        return True
    names = [entry.path.lower() for entry in entries if not entry.is_folder]
    if any(name.endswith(".model") for name in names):
        return False
    if not any(name.endswith((".amf", ".rels")) for name in names):
        return True
    file.seek(0)
    data = file.read()
    return not (is_amf(data) or is_3mf(data))
