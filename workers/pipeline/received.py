"""Which of several received files are meshes, which are archives, and which are skipped."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

from workers.errors import ProteusError
from workers.geometry.formats.containers import (
    ArchiveLimits,
    Member,
    Neighbours,
    archive_kind,
    has_mesh_ending,
    why_skipped,
    why_skipped_by_name,
    with_its_files,
)
from workers.geometry.formats.naming import clean_path
from workers.settings import Settings
from workers.storage.jobs import Skipped


@dataclass(frozen=True)
class Received:
    """A file that was received, on disk.

    Attributes
    ----------
    name : str
        As its client gave it, perhaps with folders.
    path : Path
        Where it is.
    sha256 : str
        Of its content.
    size : int
        Bytes.
    """

    name: str
    path: Path
    sha256: str
    size: int


@dataclass(frozen=True)
class Sorted:
    """The files of an upload by what becomes of them."""

    meshes: list[Received] = field(default_factory=list)
    archives: list[Received] = field(default_factory=list)
    skipped: list[Skipped] = field(default_factory=list)


def archive_limits(settings: Settings) -> ArchiveLimits:
    """Return the limits of archives.

    Parameters
    ----------
    settings : Settings
        Of the service.

    Returns
    -------
    ArchiveLimits
        As the settings have them.
    """
    return ArchiveLimits(
        entries=settings.max_zip_entries,
        unpacked=settings.max_zip_bytes,
        entry=settings.max_upload_bytes,
        ratio=settings.max_zip_ratio,
    )


def is_archive(file: Received) -> bool:
    """Whether a file is an archive of meshes, and no format that is one itself.

    Parameters
    ----------
    file : Received
        The file.

    Returns
    -------
    bool
        True also for one whose directory cannot be read: unpacking it says why.
    """
    with file.path.open("rb") as content:
        return archive_kind(content, file.name) is not None


def sort_received(files: Sequence[Received], settings: Settings) -> Sorted:
    """Sort the files of one upload.

    A glTF file and the files that it refers to become one file, a GLB, which is written beside
    them. Files that are no meshes are skipped if there is any mesh or archive. Otherwise, and where
    a file comes alone, all are tried: they fail with their reasons.

    Parameters
    ----------
    files : sequence of Received
        In the order in which they came.
    settings : Settings
        They limit bytes.

    Returns
    -------
    Sorted
        Each kind in the order of the files.
    """
    found = Sorted()
    reasons = dict(_reasons(files)) if len(files) > 1 else {}
    neighbours = Neighbours([Member(clean_path(file.name), file.size) for file in files])
    joined: set[int] = set()
    for number, file in enumerate(files):
        if number in reasons:
            continue
        if is_archive(file):
            found.archives.append(file)
        else:
            found.meshes.append(_joined(file, files, neighbours, settings, joined))
    if not found.meshes and not found.archives:
        return Sorted(meshes=list(files))
    for number, reason in reasons.items():
        if number not in joined:
            found.skipped.append(Skipped(clean_path(files[number].name), reason))
    return found


def _reasons(files: Sequence[Received]) -> Iterator[tuple[int, str]]:
    """Places of the files that are no meshes, and what they are."""
    for number, file in enumerate(files):
        path = clean_path(file.name)
        reason = why_skipped_by_name(path)
        if reason is None and not has_mesh_ending(path) and not is_archive(file):
            reason = why_skipped(path, file.path.read_bytes())
        if reason is not None:
            yield number, reason


def _joined(
    file: Received,
    files: Sequence[Received],
    neighbours: Neighbours,
    settings: Settings,
    joined: set[int],
) -> Received:
    """Return the file, or the GLB of it and of the files that it refers to."""

    def read(number: int) -> bytes:
        read_now.add(number)
        return files[number].path.read_bytes()

    if len(files) == 1 or not file.name.lower().endswith((".gltf", ".glb")):
        return file
    read_now: set[int] = set()
    document = file.path.read_bytes()
    path, largest = clean_path(file.name), settings.max_upload_bytes
    try:
        packed = with_its_files(path, document, neighbours, read, largest=largest)
    except ProteusError:  # too large: it is read alone, which says what it lacks
        packed = None
    if packed is None:
        return file
    joined |= read_now
    target = file.path.with_name(f"{file.path.name}.glb")
    target.write_bytes(packed)
    digest = sha256(packed).hexdigest()
    return replace(file, path=target, sha256=digest, size=len(packed))
