"""Files to upload: found below folders, labelled, divided into requests."""

import io
import os
import posixpath
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

BATCH_FILES = 50
BATCH_BYTES = 64 << 20
LARGEST_LOOKED_AT = 256 << 20
"""Bytes of a file that no name tells; a larger one is skipped unread."""


@dataclass(frozen=True)
class UploadFile:
    """One file to send.

    Attributes
    ----------
    path : Path
        Where it is.
    label : str
        The label to send with it; empty where the service reads it from the name.
    size : int
        Bytes.
    name : str
        Under which it is sent, with its folders; the last part of the path by default.
    needs : tuple of UploadFile
        Files that it refers to, which go along in the same request.
    """

    path: Path
    label: str
    size: int
    name: str = ""
    needs: tuple["UploadFile", ...] = ()

    @property
    def sent_name(self) -> str:
        """The name under which it is sent."""
        return self.name or self.path.name

    @property
    def sent_size(self) -> int:
        """Bytes of it and of what it needs."""
        return self.size + sum(file.size for file in self.needs)


@dataclass(frozen=True)
class FoundFiles:
    """What lies below some paths.

    Attributes
    ----------
    files : list of UploadFile
        To be sent.
    skipped : list of (str, str)
        Names of files that are no meshes, and what each is.
    """

    files: list[UploadFile]
    skipped: list[tuple[str, str]]


def find_files(paths: Iterable[Path], *, label: str = "") -> FoundFiles:
    """Find the meshes and archives below the given paths, in order of their names.

    A file given by name is taken, whatever it is. In folders the same files are skipped as the
    service skips in an archive. A name has the folders from the given folder on, that one included:
    as in an archive of it.

    Parameters
    ----------
    paths : iterable of Path
        Files and folders.
    label : str
        The label of all.
    """
    found: dict[Path, UploadFile] = {}
    skipped: dict[Path, tuple[str, str]] = {}
    for path in paths:
        if path.is_file():
            found.setdefault(path.resolve(), UploadFile(path, label, path.stat().st_size))
            continue
        top = path.resolve().name
        for file in _walk(path):
            name = "/".join(part for part in (top, *file.relative_to(path).parts) if part)
            reason = _why_skipped(file, name)
            if reason is not None:
                skipped[file.resolve()] = (name, reason)
                continue
            known = found.get(file.resolve())
            if known is None or not known.name:  # of several paths to a file, one with folders
                found[file.resolve()] = UploadFile(file, label, file.stat().st_size, name)
    files = [_with_needs(file) for file in found.values()]
    needed = {one.path.resolve() for file in files for one in file.needs} | found.keys()
    return FoundFiles(files, [one for place, one in skipped.items() if place not in needed])


def is_archive_name(path: Path) -> bool:
    """Whether a file's name ends as those of archives do."""
    from workers.geometry.formats.containers import has_archive_ending  # it brings numpy

    return has_archive_ending(path.name)


def _walk(folder: Path) -> Iterator[Path]:
    """Iterate over the files below a folder; nothing that is hidden."""
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if not name.startswith(".") and Path(place, name).is_file():
                yield Path(place, name)


def _why_skipped(path: Path, name: str) -> str | None:
    """What a file of a folder is that is no mesh, by the service's own rule."""
    from workers.geometry.formats.containers import (
        archive_kind,
        has_archive_ending,
        has_mesh_ending,
        why_skipped,
        why_skipped_by_name,
    )

    if reason := why_skipped_by_name(name):
        return reason
    if has_mesh_ending(name):
        return None
    with path.open("rb") as file:
        if has_archive_ending(name) and archive_kind(file, name):
            return None
    if path.stat().st_size > LARGEST_LOOKED_AT:
        return "file"
    return why_skipped(name, path.read_bytes())


def _with_needs(file: UploadFile) -> UploadFile:
    """Return a glTF file with the files beside it that it refers to."""
    if file.path.suffix.lower() != ".gltf":
        return file
    from workers.errors import ProteusError
    from workers.geometry.formats.gltf.packing import referenced_files

    try:
        names = referenced_files(file.path.read_bytes())
    except ProteusError:  # the service says what is wrong with it
        return file
    needs = []
    for name in names:
        relative = posixpath.normpath(posixpath.join(posixpath.dirname(file.sent_name), name))
        path = file.path.parent / name
        if not relative.startswith(("/", "../")) and path.is_file():
            needs.append(UploadFile(path, file.label, path.stat().st_size, relative))
    return replace(file, needs=tuple(needs))


def content_with_needs(path: Path) -> bytes:
    """Return a file's content; a glTF file and the files beside it that it refers to as one GLB."""
    content = path.read_bytes()
    needs = _with_needs(UploadFile(path, "", len(content))).needs
    if not needs:
        return content
    from workers.errors import ProteusError
    from workers.geometry.formats.gltf.packing import pack_glb

    try:
        return pack_glb(content, {file.name: file.path.read_bytes() for file in needs})
    except ProteusError:  # the service says what is wrong with it
        return content


def make_batches(files: Sequence[UploadFile]) -> list[list[UploadFile]]:
    """Divide files into requests: of one label each, 50 files and 64 MiB at most.

    A single file that is larger has a request of its own; what a file needs goes along.
    """
    batches: list[list[UploadFile]] = []
    open_batches: dict[str, list[UploadFile]] = {}
    for file in files:
        batch = open_batches.get(file.label)
        full = batch is not None and (
            sum(1 + len(f.needs) for f in [*batch, file]) > BATCH_FILES
            or sum(f.sent_size for f in [*batch, file]) > BATCH_BYTES
        )
        if batch is None or full:
            batch = []
            batches.append(batch)
            open_batches[file.label] = batch
        batch.append(file)
    return batches


class CountingFile(io.BufferedReader):
    """A file that reports how much of it was read; bytes that are read again count once.

    Parameters
    ----------
    path : Path
        The file.
    advance : callable
        Called with the number of bytes that were read for the first time.
    """

    def __init__(self, path: Path, advance: Callable[[int], None]) -> None:
        super().__init__(io.FileIO(path))
        self._advance = advance
        self._furthest = 0

    def read(self, size: int | None = -1, /) -> bytes:
        """Read as any file, and report it."""
        content = super().read(size)
        position = self.tell()
        if position > self._furthest:
            self._advance(position - self._furthest)
            self._furthest = position
        return content
