"""Received files become blobs, and are there when the rows that refer to them are committed.

Bytes that were made for a request, such as a region of a shape, are stored in the same way.
"""

from collections.abc import Mapping
from pathlib import Path

from sqlalchemy.orm import Session

from workers.storage.blobs import BlobStore
from workers.storage.references import hold_blobs

Contents = Mapping[str, Path | bytes]
"""Files on disk, or bytes, by the keys of their blobs."""


def store_received(blobs: BlobStore, files: Contents) -> None:
    """Store files under their keys, before the transaction that refers to them.

    Parameters
    ----------
    blobs : BlobStore
        Where they are stored.
    files : Mapping
        Files or bytes by the keys of their blobs; files stay where they are.
    """
    for key, content in files.items():
        if isinstance(content, bytes):
            blobs.put(key, content)
        else:
            blobs.put_file(key, content)


def keep_received(session: Session, blobs: BlobStore, files: Contents) -> None:
    """Store again what was pruned since, and let nothing be pruned until the commit.

    Call it last in the transaction that refers to the files.

    Parameters
    ----------
    session : Session
        That writes.
    blobs : BlobStore
        Where they are stored.
    files : Mapping
        Files or bytes by the keys of their blobs.
    """
    hold_blobs(session)
    store_received(blobs, {key: file for key, file in files.items() if not blobs.exists(key)})
