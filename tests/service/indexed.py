"""Descriptors for tests of the search index: stored, deleted, and read back from a snapshot."""

import numpy as np

from service.search.cache_file import Identity
from service.search.index import Snapshot
from workers.storage.arrays import vector_to_bytes
from workers.storage.collections import create_collection
from workers.storage.database import Database
from workers.storage.descriptors import mark_deleted, store_descriptors
from workers.storage.identifiers import new_id

DIMENSION = 5
Rows = dict[str, bytes]


def new_identity(database: Database, name: str) -> Identity:
    """Make a collection, and name the index of it."""
    with database.begin() as session:
        row = create_collection(session, name=name, description="", model="heat")
    return Identity(row.id, "heat", "f" * 64, DIMENSION)


def store(database: Database, identity: Identity, rows: Rows) -> None:
    """Store the descriptors in one transaction."""
    with database.begin() as session:
        triples = [(shape_id, "heat", vector) for shape_id, vector in rows.items()]
        store_descriptors(session, identity.collection_id, triples)


def forget(database: Database, ids: list[str]) -> None:
    """Delete the descriptors of shapes in one transaction."""
    with database.begin() as session:
        mark_deleted(session, ids)


def vector_of(values: object) -> bytes:
    """Bytes of a descriptor all of whose values, or each of them, are these."""
    filled = np.broadcast_to(np.asarray(values, dtype=np.float32), (DIMENSION,))
    return vector_to_bytes(np.ascontiguousarray(filled))


def draw(rng: np.random.Generator, count: int) -> Rows:
    """Descriptors of so many new shapes."""
    return {new_id(): vector_of(rng.normal(size=DIMENSION)) for _ in range(count)}


def content(snapshot: Snapshot) -> Rows:
    """All rows of a snapshot that count."""
    return {snapshot.ids[row]: snapshot.matrix[row].tobytes() for row in snapshot.rows.tolist()}


def found(snapshot: Snapshot, ids: list[str]) -> Rows:
    """Those of these shapes that the snapshot finds by their ids."""
    rows = snapshot.rows_of(ids)
    assert (np.diff(rows) > 0).all()
    return {snapshot.ids[row]: snapshot.matrix[row].tobytes() for row in rows.tolist()}
