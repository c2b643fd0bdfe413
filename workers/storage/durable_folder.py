"""A folder whose files are on the disk, with their names, once they were written.

A file is written under another name, synchronised, and renamed into place; then its folder is
synchronised, for it is the folder that holds the name.
"""

import contextlib
import os
import shutil
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path


def sync_path(path: Path) -> None:
    """Wait until a file's bytes, or a folder's entries, are on the disk.

    Parameters
    ----------
    path : Path
        A file or a folder.

    Raises
    ------
    OSError
        It cannot be opened or synchronised.
    """
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class DurableFolder:
    """Files under a root, whole or not at all, and there after a power cut.

    Parameters
    ----------
    root : Path
        The folder; made with the first file.
    sync : callable
        Waits until a file or folder is on the disk.
    """

    def __init__(self, root: Path, sync: Callable[[Path], None] = sync_path) -> None:
        self._root = root
        self._sync = sync
        self._durable: set[Path] = set()  # folders whose own entries were synchronised

    def write(self, name: str, data: bytes) -> None:
        """Write a file, replacing what was there.

        Parameters
        ----------
        name : str
            Path below the root.
        data : bytes
            What it holds.

        Raises
        ------
        OSError
            It cannot be written.
        """
        target = self._root / name
        partial = self._partial(target)
        partial.write_bytes(data)
        self._replace(partial, target)

    def write_file(self, name: str, source: Path) -> None:
        """Write a file with the bytes of another, replacing what was there.

        Parameters
        ----------
        name : str
            Path below the root.
        source : Path
            It stays, and may share its bytes with the new file.

        Raises
        ------
        OSError
            The bytes cannot be read or written.
        """
        target = self._root / name
        partial = self._partial(target)
        try:
            os.link(source, partial)
        except OSError:  # another disk, or one without links
            shutil.copyfile(source, partial)
        os.utime(partial)
        self._replace(partial, target)

    def files(self, name: str) -> Iterator[tuple[str, os.stat_result]]:
        """List the files in a folder: several times as fast as through fsspec.

        Parameters
        ----------
        name : str
            Path of the folder below the root.

        Yields
        ------
        Path and state of each file, in the order of names.
        """
        try:
            entries = sorted(os.scandir(self._root / name), key=lambda entry: entry.name)
        except FileNotFoundError:
            return
        for entry in entries:
            with contextlib.suppress(FileNotFoundError):  # it was deleted since
                if entry.is_file(follow_symlinks=False):
                    yield entry.path, entry.stat(follow_symlinks=False)

    def remove(self, name: str) -> None:
        """Remove a folder if it is empty.

        Parameters
        ----------
        name : str
            Path of the folder below the root.
        """
        with contextlib.suppress(OSError):
            (self._root / name).rmdir()

    def _partial(self, target: Path) -> Path:
        """Return the name of a new file beside the target, in a folder that a power cut spares."""
        self._make_folder(target.parent)
        return target.with_name(f".{target.name}.{uuid.uuid4().hex}")

    def _replace(self, partial: Path, target: Path) -> None:
        """Give a file its name, so that after a power cut it has it, with all its bytes."""
        self._sync(partial)
        os.replace(partial, target)
        self._sync(target.parent)

    def _make_folder(self, folder: Path) -> None:
        """Make a folder and those above it.

        Each folder's entry is synchronised at its first use in this process, whoever made it.
        Another process may have made it just now, and not have synchronised it yet.
        """
        if folder.is_dir() and (folder in self._durable or not folder.is_relative_to(self._root)):
            return
        self._make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        if os.access(folder.parent, os.R_OK):  # else it is not ours, nor is what stands in it
            self._sync(folder.parent)
        self._durable.add(folder)
