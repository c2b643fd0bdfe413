"""Received files become blobs, and are there when the rows that refer to them are committed."""

from collections.abc import Mapping
from pathlib import Path

from sqlalchemy.orm import Session

from workers.storage.blobs import BlobStore
from workers.storage.references import hold_blobs


def store_received(blobs: BlobStore, files: Mapping[str, Path]) -> None:
    """Store files under their keys, before the transaction that refers to them.

    Parameters
    ----------
    blobs : BlobStore
        Where they are stored.
    files : Mapping
        Files by the keys of their blobs; they stay where they are.
    """
    for key, path in files.items():
        blobs.put_file(key, path)


def keep_received(session: Session, blobs: BlobStore, files: Mapping[str, Path]) -> None:
    """Store again what was pruned since, and let nothing be pruned until the commit.

    Call it last in the transaction that refers to the files.

    Parameters
    ----------
    session : Session
        That writes.
    blobs : BlobStore
        Where they are stored.
    files : Mapping
        Files by the keys of their blobs.
    """
    hold_blobs(session)
    store_received(blobs, {key: path for key, path in files.items() if not blobs.exists(key)})
