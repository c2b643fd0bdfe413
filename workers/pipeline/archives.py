"""What an uploaded zip holds, entry by entry; nothing in it is trusted."""

import stat
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from workers.errors import UnsupportedFormatError, UploadTooLargeError
from workers.settings import Settings
from workers.storage.parts import Failure

PICTURES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".mtl", ".bin"})
TEXTS = frozenset({".txt", ".md", ".csv", ".json", ".xml", ".html", ".pdf", ".ini", ".log"})
TABLES = frozenset({".vert", ".xyz", ".cor", ".map", ".db"})
ANCILLARY = PICTURES | TEXTS | TABLES
CHUNK = 1 << 20
END_RECORD, LONG_END_RECORD = b"PK\x05\x06", b"PK\x06\x06"
END_SEARCHED = 22 + 65_535 + 20 + 56 + 1024  # record, comment, locator, long record, some more
DIRECTORY_BYTES_AN_ENTRY = 1024


@dataclass(frozen=True)
class Entry:
    """A file of an archive that may be a mesh."""

    name: str
    data: bytes


def count_entries(path: Path, settings: Settings) -> int:
    """Count the entries of an archive that may be meshes.

    Parameters
    ----------
    path : Path
        The archive.
    settings : Settings
        They limit entries and bytes.

    Returns
    -------
    int
        How many entries `read_archive` yields.

    Raises
    ------
    UnsupportedFormatError
        It cannot be read as a zip archive at all.
    UploadTooLargeError
        It holds more entries or bytes than the settings allow.
    """
    with _opened(path, settings) as (_, candidates):
        return len(candidates)


def read_archive(
    path: Path, settings: Settings, *, start: int = 0, stop: int | None = None
) -> Iterator[Entry | Failure]:
    """Yield the meshes of an archive, and why an entry cannot be one.

    Folders, pictures, texts and what operating systems leave behind are passed over. Sizes are
    taken from the directory first, then counted again while unpacking.

    Parameters
    ----------
    path : Path
        The archive.
    settings : Settings
        They limit entries and bytes.
    start, stop : int
        Place of the first entry that is read, and of the one after the last; all by default.

    Yields
    ------
    Entry or Failure
        In the order of the archive's directory.

    Raises
    ------
    UnsupportedFormatError
        It cannot be read as a zip archive at all.
    UploadTooLargeError
        It holds more entries or bytes than the settings allow.
    """
    with _opened(path, settings) as (archive, candidates):
        for info in candidates[start:stop]:
            yield _read_entry(archive, info, settings)


@contextmanager
def _opened(
    path: Path, settings: Settings
) -> Iterator[tuple[zipfile.ZipFile, list[zipfile.ZipInfo]]]:
    """Open an archive within its limits; with the entries that may be meshes."""
    try:
        _check_end_record(path, settings)
        with zipfile.ZipFile(path) as archive:
            _check_directory(archive.infolist(), settings)
            yield archive, [info for info in archive.infolist() if not _is_passed_over(info)]
    except zipfile.BadZipFile as error:
        raise UnsupportedFormatError(f"the zip archive cannot be read: {error}") from None


def _check_end_record(path: Path, settings: Settings) -> None:
    """Refuse a directory that is too long before anything reads it into memory.

    The end record has its length. For archives of more than 4 GB or 65,535 entries, another record
    before it does.
    """
    with path.open("rb") as file:
        start = max(0, path.stat().st_size - END_SEARCHED)
        file.seek(start)
        tail = file.read()
    at = tail.rfind(END_RECORD)
    if at < 0 or len(tail) < at + 22:
        raise zipfile.BadZipFile("it has no directory")
    length = int.from_bytes(tail[at + 12 : at + 16], "little")
    if length == 0xFFFFFFFF:
        at = tail.rfind(LONG_END_RECORD)
        length = int.from_bytes(tail[at + 40 : at + 48], "little") if at >= 0 else 0
    allowed = settings.max_zip_entries * DIRECTORY_BYTES_AN_ENTRY
    if length > allowed:
        raise UploadTooLargeError(
            f"the archive's directory has {length} bytes, allowed are {allowed}"
        )


def _check_directory(entries: list[zipfile.ZipInfo], settings: Settings) -> None:
    if len(entries) > settings.max_zip_entries:
        raise UploadTooLargeError(
            f"the archive has {len(entries)} entries, allowed are {settings.max_zip_entries}"
        )
    total = sum(info.file_size for info in entries)
    if total > settings.max_zip_bytes:
        raise UploadTooLargeError(
            f"the archive unpacks to {total} bytes, allowed are {settings.max_zip_bytes}"
        )


def _is_passed_over(info: zipfile.ZipInfo) -> bool:
    path = PurePosixPath(info.filename.replace("\\", "/"))
    hidden = path.name.startswith(".") or "__MACOSX" in path.parts
    return info.is_dir() or hidden or path.suffix.lower() in ANCILLARY


def _read_entry(
    archive: zipfile.ZipFile, info: zipfile.ZipInfo, settings: Settings
) -> Entry | Failure:
    reason = _refusal(info, settings)
    if reason is not None:
        return Failure(info.filename[:255], *reason)
    limit = min(info.file_size, settings.max_upload_bytes)
    data = bytearray()
    try:
        with archive.open(info) as file:
            while chunk := file.read(CHUNK):
                data += chunk
                if len(data) > limit:
                    detail = f"the entry unpacks to more than the {limit} bytes it may have"
                    return Failure(info.filename[:255], "upload-too-large", detail)
    except (zipfile.BadZipFile, EOFError, OSError, NotImplementedError, ValueError) as error:
        detail = f"the entry cannot be unpacked: {error}"
        return Failure(info.filename[:255], "unsupported-format", detail[:500])
    except Exception as error:  # zlib.error, lzma.LZMAError and their like share no base class
        detail = f"the entry cannot be unpacked: {type(error).__name__}"
        return Failure(info.filename[:255], "unsupported-format", detail)
    if data[:4] == b"PK\x03\x04" and b"3D/" not in data[:65536]:
        detail = "the entry is an archive within the archive; unpack it before uploading"
        return Failure(info.filename[:255], "unsupported-format", detail)
    return Entry(info.filename, bytes(data))


def _refusal(info: zipfile.ZipInfo, settings: Settings) -> tuple[str, str] | None:
    path = PurePosixPath(info.filename.replace("\\", "/"))
    mode = info.external_attr >> 16
    if path.is_absolute() or ".." in path.parts or ":" in path.parts[0]:
        return "invalid-request", "the entry's path leads out of the archive"
    if mode and not stat.S_ISREG(mode) and stat.S_IFMT(mode):
        return "invalid-request", "the entry is a link or a device, expected a regular file"
    if info.flag_bits & 0x1:
        return "unsupported-format", "the entry is encrypted"
    if info.file_size > settings.max_upload_bytes:
        allowed = settings.max_upload_bytes
        return "upload-too-large", f"the entry has {info.file_size} bytes, allowed are {allowed}"
    if info.file_size > settings.max_zip_ratio * max(info.compress_size, 1) + 4096:
        ratio = info.file_size // max(info.compress_size, 1)
        return (
            "upload-too-large",
            f"the entry unpacks to {ratio} times its packed size, allowed is "
            f"{settings.max_zip_ratio}",
        )
    return None
