"""Rows of descriptors: those of shapes, in the change feed, and those of query meshes."""

import time
from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import ColumnElement, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import InstrumentedAttribute, Session

from workers.storage.change_feed import next_change
from workers.storage.models import (
    FEEDS,
    Collection,
    Descriptor,
    QueryDescriptor,
    Shape,
    Signature,
)


def store_descriptors(
    session: Session,
    collection_id: str,
    rows: Sequence[tuple[str, str, bytes]],
    signatures: Sequence[tuple[str, str, bytes]] = (),
) -> None:
    """Store descriptors and signatures of shapes under one new change number.

    Parameters
    ----------
    session : Session
        That writes.
    collection_id : str
        Id of the shapes' collection.
    rows : sequence of (str, str, bytes)
        Shape id, model name, and little-endian float32 bytes of the descriptor.
    signatures : sequence of (str, str, bytes)
        Shape id, model name, and bytes of the signature, of models that compare windows.
    """
    if not rows and not signatures:
        return
    number = next_change(session)
    feeds: tuple[tuple[type[Descriptor | Signature], Sequence[tuple[str, str, bytes]]], ...] = (
        (Descriptor, rows),
        (Signature, signatures),
    )
    for feed, changed in feeds:
        for shape_id, model, vector in changed:
            _upsert(
                session,
                feed,
                {"shape_id": shape_id, "model": model},
                {
                    "collection_id": collection_id,
                    "change": number,
                    "vector": vector,
                    "deleted_at": None,
                },
            )


def mark_deleted(session: Session, shape_ids: Sequence[str]) -> None:
    """Turn the descriptors and signatures of deleted shapes into changes that say so.

    Parameters
    ----------
    session : Session
        That writes.
    shape_ids : sequence of str
        Ids of the shapes.
    """
    number, now = next_change(session), time.time()
    for feed in FEEDS:
        session.execute(
            update(feed)
            .where(feed.shape_id.in_(shape_ids))
            .values(vector=None, change=number, deleted_at=now)
        )


def get_vector(session: Session, shape_id: str, model: str) -> bytes | None:
    """Return the descriptor of a shape under a model.

    Parameters
    ----------
    session : Session
        That reads.
    shape_id : str
        Id of the shape.
    model : str
        Name of the model.

    Returns
    -------
    Little-endian float32 bytes; None if there is no descriptor.
    """
    row = session.get(Descriptor, (shape_id, model))
    return None if row is None else row.vector


def is_described(model: str | InstrumentedAttribute[str]) -> ColumnElement[bool]:
    """SQL that is true for each ``Shape`` with a descriptor under a model.

    Parameters
    ----------
    model : str or column
        Name of the model.

    Returns
    -------
    An expression for a statement over ``Shape``.
    """
    return (
        select(Descriptor.shape_id)
        .where(
            Descriptor.shape_id == Shape.id,
            Descriptor.model == model,
            Descriptor.vector.is_not(None),
        )
        .exists()
    )


def is_signed(model: str | InstrumentedAttribute[str]) -> ColumnElement[bool]:
    """SQL that is true for each ``Shape`` with a signature under a model.

    Parameters
    ----------
    model : str or column
        Name of the model.

    Returns
    -------
    An expression for a statement over ``Shape``.
    """
    there = Signature.shape_id == Shape.id, Signature.model == model
    return select(Signature.shape_id).where(*there, Signature.vector.is_not(None)).exists()


def undescribed_shapes(
    session: Session,
    collection: Collection,
    model: str,
    *,
    with_failed: bool,
    with_unsigned: bool = False,
) -> list[str]:
    """Ids of shapes that can be found under the collection's model, but not under another.

    Parameters
    ----------
    session : Session
        That reads.
    collection : Collection
        Its row.
    model : str
        Name of the other model.
    with_failed : bool
        Count those that have an error too: they are to be tried again.
    with_unsigned : bool
        Count those that have a descriptor under the other model, but no signature.

    Returns
    -------
    Ids, in order.
    """
    lacks = ~is_described(model)
    if with_unsigned:
        lacks |= ~is_signed(model)
    statement = select(Shape.id).where(
        Shape.collection_id == collection.id, is_described(collection.model), lacks
    )
    if not with_failed:
        statement = statement.where(Shape.error.is_(None))
    return list(session.scalars(statement.order_by(Shape.id)))


def described_shapes(session: Session, collection_id: str, model: str) -> set[str]:
    """Ids of a collection's shapes that have a descriptor under a model.

    Parameters
    ----------
    session : Session
        That reads.
    collection_id : str
        Id of the collection.
    model : str
        Name of the model.

    Returns
    -------
    A set of ids.
    """
    statement = select(Descriptor.shape_id).where(
        Descriptor.collection_id == collection_id,
        Descriptor.model == model,
        Descriptor.vector.is_not(None),
    )
    return set(session.scalars(statement))


def store_query_vectors(session: Session, sha256: str, rows: Iterable[tuple[str, bytes]]) -> None:
    """Store descriptors of a query's mesh, by its content.

    Parameters
    ----------
    session : Session
        That writes.
    sha256 : str
        Hash of the mesh as it was uploaded.
    rows : iterable of (str, bytes)
        Model name and little-endian float32 bytes of the descriptor.
    """
    for model, vector in rows:
        _upsert(
            session,
            QueryDescriptor,
            {"sha256": sha256, "model": model},
            {"vector": vector, "created_at": time.time()},
        )


def get_query_vector(session: Session, sha256: str, model: str) -> bytes | None:
    """Return the descriptor of a query's mesh.

    Parameters
    ----------
    session : Session
        That reads.
    sha256 : str
        Hash of the mesh as it was uploaded.
    model : str
        Name of the model.

    Returns
    -------
    Little-endian float32 bytes; None if there is no descriptor yet.
    """
    row = session.get(QueryDescriptor, (sha256, model))
    return None if row is None else row.vector


def _upsert(session: Session, table: Any, key: dict[str, Any], values: dict[str, Any]) -> None:
    dialect = session.get_bind().dialect.name
    insert = postgresql.insert if dialect == "postgresql" else sqlite.insert
    statement = insert(table).values(**key, **values)
    session.execute(statement.on_conflict_do_update(index_elements=list(key), set_=values))
