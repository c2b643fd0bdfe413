"""Immutable bytes under keys, on disk or in any store that fsspec reaches.

Keys are made here alone, from content hashes and view keys: no name that a client gave
ever becomes part of a path.
"""

import os
import shutil
import uuid
from pathlib import Path
from typing import Any

import fsspec

from workers.errors import BlobNotFoundError


def mesh_key(sha256: str) -> str:
    """Key of a mesh as it was uploaded."""
    return f"meshes/{sha256[:2]}/{sha256}"


def archive_key(sha256: str) -> str:
    """Key of an uploaded zip, kept until it is unpacked."""
    return f"archives/{sha256[:2]}/{sha256}"


def cleaned_key(sha256: str) -> str:
    """Key of the cleaned mesh (npz)."""
    return f"cleaned/{sha256[:2]}/{sha256}.npz"


def thumbnail_key(sha256: str) -> str:
    """Key of the thumbnail (PNG)."""
    return f"thumbnails/{sha256[:2]}/{sha256}.png"


def spectrum_key(sha256: str, view_key: str) -> str:
    """Key of the working mesh and its spectrum under one view (npz)."""
    return f"spectra/{sha256[:2]}/{sha256}.{view_key}.npz"


def frame_key(evaluation_id: str, digest: str) -> str:
    """Key of the shapes that an evaluation compares, by their digest (JSON)."""
    return f"evaluations/{evaluation_id}/{digest}.json"


def ranking_key(evaluation_id: str, digest: str, number: int, start: int) -> str:
    """Key of what these shapes, from a query on, found under the model of this number (JSON)."""
    return f"evaluations/{evaluation_id}/{digest}.{number}.{start}.json"


def training_key(kind: str, digest: str) -> str:
    """Key of what a training keeps of a pair (its moments) or a variant (its descriptor)."""
    return f"{kind}s/{digest[:2]}/{digest}.npz"


def failure_key(kind: str, digest: str) -> str:
    """Key of the reason why there is nothing of a pair or variant."""
    return f"{kind}s/{digest[:2]}/{digest}.failure.json"


class BlobStore:
    """Bytes under keys; a key's bytes appear whole or not at all.

    Parameters
    ----------
    url : str
        An fsspec URL such as ``file:///var/lib/proteus`` or ``s3://bucket/prefix``.
    """

    def __init__(self, url: str) -> None:
        self._files, root = fsspec.core.url_to_fs(url)
        self._root: str = root.rstrip("/")
        self._local = "file" in _protocols(self._files)

    def put(self, key: str, data: bytes) -> None:
        """Store these bytes, replacing what was there."""
        if not self._local:
            self._files.pipe_file(self._path(key), data)
            return
        target = Path(self._path(key))
        partial = self._partial(target)
        with partial.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, target)

    def put_file(self, key: str, source: Path) -> None:
        """Store a file's bytes; the file itself is moved away or stays, see ``source`` as gone."""
        if not self._local:
            self._files.put_file(str(source), self._path(key))
            source.unlink(missing_ok=True)
            return
        target = Path(self._path(key))
        partial = self._partial(target)
        shutil.move(source, partial)
        with partial.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(partial, target)

    def get(self, key: str) -> bytes:
        """Return the bytes under this key.

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
        """Whether there are bytes under this key."""
        return bool(self._files.exists(self._path(key)))

    def delete(self, key: str) -> None:
        """Forget the bytes under this key, if there are any."""
        try:
            self._files.rm_file(self._path(key))
        except FileNotFoundError:
            return

    def _path(self, key: str) -> str:
        return f"{self._root}/{key}"

    @staticmethod
    def _partial(target: Path) -> Path:
        target.parent.mkdir(parents=True, exist_ok=True)
        return target.with_name(f".{target.name}.{uuid.uuid4().hex}")


def _protocols(files: Any) -> tuple[str, ...]:
    protocol = files.protocol
    return (protocol,) if isinstance(protocol, str) else tuple(protocol)
