"""Files of the data directory that can be made again or were left behind: no blobs, no rows."""

import hashlib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import select

from workers.storage.database import Database
from workers.storage.models import Collection, TrainedModel
from workers.storage.retention import Amount
from workers.storage.trained_models import model_fingerprint

CACHE, UPLOADS = "cache", "uploads"
"""Folders of the data directory: of search indexes as files, and of uploads that are received."""

WINDOWS = "windows"
"""Folder below that of the search indexes: for those of signatures."""

ENDING, PARTIAL = ".index", ".partial"
"""Endings of the file of a search index, and of one that is being written."""

SHOWN_DIGITS = 16


def model_tag(model: str) -> str:
    """Return what stands for a model's name in the names of files.

    Parameters
    ----------
    model : str
        Name of the model; it may hold characters that a file's name cannot.

    Returns
    -------
    16 hexadecimal digits.
    """
    return hashlib.sha256(model.encode()).hexdigest()[:SHOWN_DIGITS]


def index_file_name(collection_id: str, model: str, fingerprint: str) -> str:
    """Name of the file that caches the search index of a collection under a model.

    Parameters
    ----------
    collection_id : str
        Id of the collection.
    model : str
        Name of the model.
    fingerprint : str
        Of the model, as ``model_fingerprint`` gives it.

    Returns
    -------
    A name that no other collection and no other model has.
    """
    return f"{collection_id}.{model_tag(model)}.{fingerprint[:SHOWN_DIGITS]}{ENDING}"


@dataclass(frozen=True)
class StaleFiles:
    """Where files that were left behind are looked for.

    Attributes
    ----------
    database : Database
    folder : Path
        The data directory of this machine.
    before : float
        Younger files are left alone, in seconds since 1970.
    """

    database: Database
    folder: Path
    before: float

    def indexes(self) -> Iterator[Path]:
        """Cached search indexes of collections or models that are gone, and broken writes.

        Yields
        ------
        Paths of files.
        """
        with self.database.read() as session:
            collections = session.scalars(select(Collection.id)).all()
            models = [
                (row.name, model_fingerprint(row)) for row in session.scalars(select(TrainedModel))
            ]
        current = {index_file_name(one, *model) for one in collections for model in models}
        for path in (*self._old(CACHE), *self._old(f"{CACHE}/{WINDOWS}")):
            if path.suffix == PARTIAL or (path.suffix == ENDING and path.name not in current):
                yield path

    def uploads(self) -> Iterator[Path]:
        """Folders of uploads whose process was killed while it received them.

        Returns
        -------
        Paths of folders.
        """
        return self._old(UPLOADS)

    def delete(self, path: Path) -> Amount:
        """Delete a file or folder, if it is still there.

        Parameters
        ----------
        path : Path
            What one of the methods above lists.

        Returns
        -------
        What was freed.
        """
        amount = size_of(path)
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
        return amount

    def _old(self, name: str) -> Iterator[Path]:
        for path in sorted((self.folder / name).glob("*")):
            try:
                modified = path.lstat().st_mtime
            except FileNotFoundError:  # it went meanwhile
                continue
            if modified < self.before:
                yield path


def size_of(path: Path) -> Amount:
    """Bytes of a file, or of all files in a folder.

    Parameters
    ----------
    path : Path
        Of the file or folder.

    Returns
    -------
    One thing with so many bytes; nothing if it is gone.
    """
    try:
        files = list(path.rglob("*")) if path.is_dir() else [path]
        return Amount(1, sum(one.lstat().st_size for one in files))
    except FileNotFoundError:
        return Amount()
