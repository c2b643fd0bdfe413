"""Files to upload: found below folders, labelled, divided into requests."""

import io
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ENDINGS = frozenset({".off", ".obj", ".ply", ".stl", ".glb", ".gltf", ".3mf", ".zip"})
BATCH_FILES = 50
BATCH_BYTES = 64 << 20
_LABELLED_NAME = re.compile(r"^[^.]+\.[^.\d][^.]*\.\d{1,3}\.[^.]+$")


@dataclass(frozen=True)
class UploadFile:
    """One file to send.

    Attributes
    ----------
    path : Path
        Where it is; its last part is sent as its name.
    label : str
        The label to send with it; empty for none.
    size : int
        Bytes.
    """

    path: Path
    label: str
    size: int


def find_files(
    paths: Iterable[Path], *, label: str = "", labels_from_folders: bool = True
) -> list[UploadFile]:
    """Find the meshes and archives below the given paths, in order of their names.

    A file given by name is taken, whatever its ending. In folders only files with the ending of
    a mesh or zip are taken, and nothing hidden.

    Parameters
    ----------
    paths : iterable of Path
        Files and folders.
    label : str
        The label of all.
    labels_from_folders : bool
        Without ``label``, take the name of the parent folder. Three kinds of files have none:
        files directly in a given folder, archives (the service takes labels from the folders in
        them), and names of the form ``label.transformation.strength.ending``.
    """
    found: dict[Path, UploadFile] = {}
    for path in paths:
        files = [path] if path.is_file() else _walk(path)
        for file in files:
            folder = "" if file.parent == path or file == path else file.parent.name
            own = folder if labels_from_folders and not _has_own_label(file) else ""
            chosen = UploadFile(file, label or own, file.stat().st_size)
            known = found.get(file.resolve())
            if (
                known is None or not known.label
            ):  # of several paths to a file, one that gives a label
                found[file.resolve()] = chosen
    return list(found.values())


def _has_own_label(file: Path) -> bool:
    return file.suffix.lower() == ".zip" or bool(_LABELLED_NAME.match(file.name))


def _walk(folder: Path) -> Iterator[Path]:
    """Iterate over the meshes and archives below a folder."""
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if not name.startswith(".") and Path(name).suffix.lower() in ENDINGS:
                yield Path(place, name)


def make_batches(files: Sequence[UploadFile]) -> list[list[UploadFile]]:
    """Divide files into requests: of one label each, 50 files and 64 MiB at most.

    A single file that is larger has a request of its own.
    """
    batches: list[list[UploadFile]] = []
    open_batches: dict[str, list[UploadFile]] = {}
    for file in files:
        batch = open_batches.get(file.label)
        full = batch is not None and (
            len(batch) >= BATCH_FILES or sum(f.size for f in batch) + file.size > BATCH_BYTES
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
