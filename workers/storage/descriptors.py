"""Rows of descriptors: of shapes, in the change feed, and of meshes that were asked with."""

import time
from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import ColumnElement, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import InstrumentedAttribute, Session

from workers.storage.change_feed import next_change
from workers.storage.models import Collection, Descriptor, QueryDescriptor, Shape


def store_descriptors(
    session: Session, collection_id: str, rows: Sequence[tuple[str, str, bytes]]
) -> None:
    """Store (shape id, model name, vector) rows under one new change number."""
    if rows:
        number = next_change(session)
        for shape_id, model, vector in rows:
            _upsert(
                session,
                Descriptor,
                {"shape_id": shape_id, "model": model},
                {
                    "collection_id": collection_id,
                    "change": number,
                    "vector": vector,
                    "deleted_at": None,
                },
            )


def forget_shapes(session: Session, shape_ids: Sequence[str]) -> None:
    """Turn the descriptors of deleted shapes into rows that say so."""
    session.execute(
        update(Descriptor)
        .where(Descriptor.shape_id.in_(shape_ids))
        .values(vector=None, change=next_change(session), deleted_at=time.time())
    )


def get_vector(session: Session, shape_id: str, model: str) -> bytes | None:
    """Return the descriptor of a shape under a model, None if there is none."""
    row = session.get(Descriptor, (shape_id, model))
    return None if row is None else row.vector


def is_described(model: str | InstrumentedAttribute[str]) -> ColumnElement[bool]:
    """SQL that is true for each ``Shape`` with a descriptor under a model."""
    return (
        select(Descriptor.shape_id)
        .where(
            Descriptor.shape_id == Shape.id,
            Descriptor.model == model,
            Descriptor.vector.is_not(None),
        )
        .exists()
    )


def undescribed_shapes(
    session: Session, collection: Collection, model: str, *, with_failed: bool
) -> list[str]:
    """Ids of shapes that can be found under the collection's model, but not under this one.

    Those of which something failed count where it is to be tried again, and not where it was.
    """
    statement = select(Shape.id).where(
        Shape.collection_id == collection.id,
        is_described(collection.model),
        ~is_described(model),
    )
    if not with_failed:
        statement = statement.where(Shape.error.is_(None))
    return list(session.scalars(statement.order_by(Shape.id)))


def described_shapes(session: Session, collection_id: str, model: str) -> set[str]:
    """Ids of a collection's shapes that have a descriptor under a model."""
    statement = select(Descriptor.shape_id).where(
        Descriptor.collection_id == collection_id,
        Descriptor.model == model,
        Descriptor.vector.is_not(None),
    )
    return set(session.scalars(statement))


def store_query_vectors(session: Session, sha256: str, rows: Iterable[tuple[str, bytes]]) -> None:
    """Store (model name, vector) rows of a mesh that was asked with, by its content."""
    for model, vector in rows:
        _upsert(
            session,
            QueryDescriptor,
            {"sha256": sha256, "model": model},
            {"vector": vector, "created_at": time.time()},
        )


def get_query_vector(session: Session, sha256: str, model: str) -> bytes | None:
    """Return the descriptor of a mesh that was asked with, None if there is none yet."""
    row = session.get(QueryDescriptor, (sha256, model))
    return None if row is None else row.vector


def _upsert(session: Session, table: Any, key: dict[str, Any], values: dict[str, Any]) -> None:
    dialect = session.get_bind().dialect.name
    insert = postgresql.insert if dialect == "postgresql" else sqlite.insert
    statement = insert(table).values(**key, **values)
    session.execute(statement.on_conflict_do_update(index_elements=list(key), set_=values))
