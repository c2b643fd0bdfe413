"""Immutable bytes under keys, on disk or in any store that fsspec reaches.

Keys are made here alone, from content hashes and view keys: no name that a client gave
ever becomes part of a path. What is stored in a folder survives a power cut once ``put`` has
returned; what is stored elsewhere is as safe as that store says.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

from workers.errors import BlobNotFoundError
from workers.storage.durable_folder import DurableFolder, sync_path

MESHES, ARCHIVES, CLEANED, THUMBNAILS = "meshes", "archives", "cleaned", "thumbnails"
SPECTRA, EVALUATIONS, CORRESPONDENCES = "spectra", "evaluations", "correspondences"
MODIFIED = ("mtime", "LastModified", "last_modified", "updated", "created")
"""Names under which file systems say when a file was last written."""


def mesh_key(sha256: str) -> str:
    """Key of a mesh as it was uploaded.

    Parameters
    ----------
    sha256 : str
        Of its bytes, 64 hexadecimal digits.

    Returns
    -------
    ``meshes/ab/abcd…``
    """
    return f"{MESHES}/{sha256[:2]}/{sha256}"


def archive_key(sha256: str) -> str:
    """Key of an uploaded zip, kept until it is unpacked and pruned.

    Parameters
    ----------
    sha256 : str
        Of its bytes.

    Returns
    -------
    ``archives/ab/abcd…``
    """
    return f"{ARCHIVES}/{sha256[:2]}/{sha256}"


def cleaned_key(sha256: str) -> str:
    """Key of the cleaned mesh (npz).

    Parameters
    ----------
    sha256 : str
        Of the uploaded mesh.

    Returns
    -------
    ``cleaned/ab/abcd….npz``
    """
    return f"{CLEANED}/{sha256[:2]}/{sha256}.npz"


def thumbnail_key(sha256: str) -> str:
    """Key of the thumbnail (PNG).

    Parameters
    ----------
    sha256 : str
        Of the uploaded mesh.

    Returns
    -------
    ``thumbnails/ab/abcd….png``
    """
    return f"{THUMBNAILS}/{sha256[:2]}/{sha256}.png"


def spectrum_key(sha256: str, view_key: str) -> str:
    """Key of the working mesh and its spectrum under one view (npz).

    Parameters
    ----------
    sha256 : str
        Of the uploaded mesh, or of one that a training made.
    view_key : str
        Digest of the view and of the solver's version.

    Returns
    -------
    ``spectra/ab/abcd….<view key>.npz``
    """
    return f"{SPECTRA}/{sha256[:2]}/{sha256}.{view_key}.npz"


def correspondence_key(first: str, second: str, digest: str) -> str:
    """Key of the correspondence of two meshes (npz).

    Parameters
    ----------
    first, second : str
        SHA-256 of the uploaded meshes.
    digest : str
        Of the versions that it depends on.

    Returns
    -------
    ``correspondences/ab/abcd….ef01….<digest>.npz``
    """
    return f"{CORRESPONDENCES}/{first[:2]}/{first}.{second}.{digest}.npz"


def frame_key(evaluation_id: str, digest: str) -> str:
    """Key of the shapes that an evaluation compares, by their digest (JSON).

    Parameters
    ----------
    evaluation_id : str
        Id of the evaluation.
    digest : str
        Of the shapes.

    Returns
    -------
    ``evaluations/<id>/<digest>.json``
    """
    return f"{EVALUATIONS}/{evaluation_id}/{digest}.json"


def ranking_key(evaluation_id: str, digest: str, number: int, start: int) -> str:
    """Key of what some queries of an evaluation found under one model (JSON).

    Parameters
    ----------
    evaluation_id : str
        Id of the evaluation.
    digest : str
        Of the shapes that are compared.
    number : int
        Place of the model in the evaluation, from 0.
    start : int
        Place of the first query.

    Returns
    -------
    ``evaluations/<id>/<digest>.<number>.<start>.json``
    """
    return f"{EVALUATIONS}/{evaluation_id}/{digest}.{number}.{start}.json"


def training_key(kind: str, digest: str) -> str:
    """Key of what a training keeps of a pair (its moments) or a variant (descriptor, windows).

    Parameters
    ----------
    kind : {"pair", "variant"}
        Of which it is kept.
    digest : str
        Of all that it depends on.

    Returns
    -------
    ``pairs/ab/abcd….npz`` or ``variants/ab/abcd….npz``
    """
    return f"{kind}s/{digest[:2]}/{digest}.npz"


def failure_key(kind: str, digest: str) -> str:
    """Key of the reason why there is nothing of a pair or variant (JSON).

    Parameters
    ----------
    kind : {"pair", "variant"}
        Of which it is kept.
    digest : str
        Of all that it depends on.

    Returns
    -------
    ``pairs/ab/abcd….failure.json`` or ``variants/ab/abcd….failure.json``
    """
    return f"{kind}s/{digest[:2]}/{digest}.failure.json"


@dataclass(frozen=True)
class StoredBlob:
    """A blob as a listing shows it.

    Attributes
    ----------
    key : str
    size : int
        Bytes.
    modified : float
        When it was last stored, in seconds since 1970.
    """

    key: str
    size: int
    modified: float


class BlobStore:
    """Bytes under keys; a key's bytes appear whole or not at all.

    Parameters
    ----------
    url : str
        An fsspec URL such as ``file:///var/lib/proteus`` or ``s3://bucket/prefix``.
    sync : callable
        Waits until a file or folder is on the disk; used where the URL is that of a folder.
    """

    def __init__(self, url: str, *, sync: Callable[[Path], None] = sync_path) -> None:
        self._files, root = fsspec.core.url_to_fs(url)
        self._root: str = root.rstrip("/")
        local = isinstance(self._files, LocalFileSystem)
        self._folder = DurableFolder(Path(self._root), sync) if local else None

    def put(self, key: str, data: bytes) -> None:
        """Store these bytes, replacing what was there; its age starts anew.

        Parameters
        ----------
        key : str
            Made by a function of this module.
        data : bytes
            What is stored.
        """
        if self._folder is None:
            self._files.pipe_file(self._path(key), data)
        else:
            self._folder.write(key, data)

    def put_file(self, key: str, source: Path) -> None:
        """Store a file's bytes, replacing what was there; its age starts anew.

        Parameters
        ----------
        key : str
            Made by a function of this module.
        source : Path
            It stays where it is. On the same disk it may share its bytes with the blob, so it
            must not be written to afterwards.
        """
        if self._folder is None:
            self._files.put_file(str(source), self._path(key))
        else:
            self._folder.write_file(key, source)

    def get(self, key: str) -> bytes:
        """Return the bytes under this key.

        Parameters
        ----------
        key : str
            Made by a function of this module.

        Returns
        -------
        The bytes as they were stored.

        Raises
        ------
        BlobNotFoundError
            There are none.
        """
        try:
            data: bytes = self._files.cat_file(self._path(key))
        except FileNotFoundError:
            raise BlobNotFoundError(f"no blob is stored under {key}") from None
        return data

    def fetch(self, key: str, target: Path) -> None:
        """Copy the bytes under this key into a file.

        Parameters
        ----------
        key : str
            Made by a function of this module.
        target : Path
            The file; what was in it is replaced.

        Raises
        ------
        BlobNotFoundError
            There are none.
        """
        try:
            self._files.get_file(self._path(key), str(target))
        except FileNotFoundError:
            raise BlobNotFoundError(f"no blob is stored under {key}") from None

    def exists(self, key: str) -> bool:
        """Whether there are bytes under this key.

        Parameters
        ----------
        key : str
            Made by a function of this module.

        Returns
        -------
        True if there are.
        """
        return bool(self._files.exists(self._path(key)))

    def delete(self, key: str) -> None:
        """Delete the bytes under this key, if there are any.

        Parameters
        ----------
        key : str
            Made by a function of this module.
        """
        try:
            self._files.rm_file(self._path(key))
        except FileNotFoundError:
            return

    def remove_folder(self, prefix: str) -> None:
        """Remove a folder on disk if it is empty; other stores have none beside their blobs.

        Parameters
        ----------
        prefix : str
            Of the keys.
        """
        if self._folder is not None:
            self._folder.remove(prefix)

    def info(self, key: str) -> StoredBlob | None:
        """Return size and age of a blob as they are now.

        Parameters
        ----------
        key : str
            Made by a function of this module.

        Returns
        -------
        None if there is no such blob.
        """
        self._files.invalidate_cache()  # a store that remembers listings would say what was
        try:
            found = self._files.info(path := self._path(key))
        except FileNotFoundError:
            return None
        return StoredBlob(key, int(found["size"] or 0), self._modified(path, found))

    def folders(self, prefix: str) -> list[str]:
        """Folders below a prefix: listing one after another keeps the memory bounded.

        Parameters
        ----------
        prefix : str
            First part of keys, such as ``MESHES``.

        Returns
        -------
        Prefixes such as ``meshes/ab``, in order.
        """
        found = self._entries(prefix)
        return sorted(self._key(entry["name"]) for entry in found if entry["type"] == "directory")

    def blobs(self, prefix: str) -> Iterator[StoredBlob]:
        """List the blobs in a folder, partial ones of interrupted writes too.

        Parameters
        ----------
        prefix : str
            A folder, such as ``meshes/ab``; what lies deeper is not listed.

        Yields
        ------
        Each blob, in the order of keys.
        """
        if self._folder is not None:
            for path, state in self._folder.files(prefix):
                yield StoredBlob(self._key(path), state.st_size, state.st_mtime)
            return
        for entry in sorted(self._entries(prefix), key=lambda entry: str(entry["name"])):
            if entry["type"] == "file":
                path = entry["name"]
                modified = self._modified(path, entry)
                yield StoredBlob(self._key(path), int(entry["size"] or 0), modified)

    def _entries(self, prefix: str) -> list[dict[str, Any]]:
        self._files.invalidate_cache()
        try:
            found: list[dict[str, Any]] = self._files.ls(self._path(prefix), detail=True)
        except FileNotFoundError:
            return []
        return found

    def _modified(self, path: str, entry: Mapping[str, Any]) -> float:
        """When a file was last written, from its entry or else by asking the store."""
        for name in MODIFIED:
            if isinstance(when := entry.get(name), datetime):
                return when.timestamp()
            if isinstance(when, int | float):
                return float(when)
        asked: datetime = self._files.modified(path)
        return asked.timestamp()

    def _path(self, key: str) -> str:
        return f"{self._root}/{key}"

    def _key(self, path: str) -> str:
        return path.removeprefix(f"{self._root}/").removeprefix(f"{self._root.lstrip('/')}/")
