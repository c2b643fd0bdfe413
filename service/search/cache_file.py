"""A search index as a file: a copy of rows of the database that can be made again at any time.

Layout: 8 bytes that say what it is; the length of the header (8 bytes, little-endian); the header
(JSON); ids of 36 bytes each; rows of little-endian float32; empty room for more rows. Ids and rows
start at a page. The mapping is private: what is added later never reaches the file. Decision 24
says why this is no ``.npy`` file.

A file is written under another name and then renamed into place. It must never be written to:
a process that has mapped a file dies when the file becomes shorter.
"""

import contextlib
import json
import os
import uuid
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from workers.geometry.arrays import Float32Array
from workers.storage.stale_files import PARTIAL, index_file_name

MAGIC = b"PROTEUS1"
PAGE = 4096
ID_BYTES = 36
BLOCK = 1 << 24


@dataclass(frozen=True)
class Identity:
    """Which index it is; ``fingerprint`` stands for all that the model's descriptors depend on."""

    collection_id: str
    model: str
    fingerprint: str
    dimension: int

    @property
    def file_name(self) -> str:
        """Name of its cache file: of the collection, the model's name and its fingerprint."""
        return index_file_name(self.collection_id, self.model, self.fingerprint)


@dataclass(frozen=True, eq=False)
class Cached:
    """What a cache file holds.

    Attributes
    ----------
    ids : list of n str
    matrix : (capacity, d) float32, capacity >= n
        Privately mapped: writing to it changes nothing but this process.
    number : int
        Last change that is in it.
    """

    ids: list[str]
    matrix: Float32Array
    number: int


def write_cache(
    path: Path,
    identity: Identity,
    *,
    ids: Sequence[str],
    matrix: Float32Array,
    number: int,
    capacity: int,
) -> None:
    """Write a cache file, whole or not at all.

    Parameters
    ----------
    path : Path
        Where; a file that is there is replaced.
    identity : Identity
        Which index it is.
    ids, matrix : n str and (n, d) float32
        The rows.
    number : int
        Last change that is in them.
    capacity : int
        For how many rows the file has room.

    Raises
    ------
    OSError
        It cannot be written.
    """
    names = "".join(ids).encode("ascii")
    rows = np.ascontiguousarray(matrix, dtype="<f4")
    header = {
        **vars(identity),
        "rows": len(ids),
        "capacity": capacity,
        "number": number,
        "checksum": _checksum(names, rows),
    }
    text = json.dumps(header).encode()
    ids_at = _padded(16 + len(text))
    rows_at = _padded(ids_at + len(names))
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{uuid.uuid4().hex}{PARTIAL}")
    try:
        with partial.open("wb") as file:
            file.write(MAGIC + len(text).to_bytes(8, "little") + text)
            file.seek(ids_at)
            file.write(names)
            file.seek(rows_at)
            file.write(rows.data.cast("B") if rows.size else b"")
            file.truncate(rows_at + 4 * identity.dimension * capacity)
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def read_cache(path: Path, identity: Identity) -> Cached | None:
    """Open a cache file.

    Parameters
    ----------
    path : Path
        Where it is.
    identity : Identity
        Which index it should be.

    Returns
    -------
    Cached or None
        What it holds; None if it is missing, damaged, or of another index.
    """
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        return _read(path, identity)
    return None


def _read(path: Path, identity: Identity) -> Cached:
    with path.open("rb") as file:
        magic, length = file.read(8), int.from_bytes(file.read(8), "little")
        if magic != MAGIC or length > PAGE:
            raise ValueError("this is no cache file")
        header: dict[str, Any] = json.loads(file.read(length))
        if any(header[name] != value for name, value in vars(identity).items()):
            raise ValueError("it is of another index")
        n, capacity = header["rows"], header["capacity"]
        ids_at = _padded(16 + length)
        rows_at = _padded(ids_at + ID_BYTES * n)
        expected = rows_at + 4 * identity.dimension * capacity
        if not 0 <= n <= capacity or os.fstat(file.fileno()).st_size != expected:
            raise ValueError("its size is not the one it declares")
        file.seek(ids_at)
        names = file.read(ID_BYTES * n)
        matrix = np.memmap(
            file, dtype="<f4", mode="c", offset=rows_at, shape=(capacity, identity.dimension)
        )
    if _checksum(names, matrix[:n]) != header["checksum"]:
        raise ValueError("its checksum is wrong")
    text = names.decode("ascii")
    ids = [text[start : start + ID_BYTES] for start in range(0, len(text), ID_BYTES)]
    return Cached(ids, np.asarray(matrix), header["number"])


def _checksum(names: bytes, rows: Float32Array) -> int:
    value = zlib.crc32(names)
    step = max(1, BLOCK // max(1, 4 * rows.shape[1]))
    for start in range(0, len(rows), step):
        value = zlib.crc32(np.ascontiguousarray(rows[start : start + step]).data, value)
    return value


def _padded(length: int) -> int:
    return -(-length // PAGE) * PAGE
