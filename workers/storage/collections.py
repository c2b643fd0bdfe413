"""Rows of collections, and under which models their shapes are described."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import delete, func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from workers.errors import CollectionNotFoundError, NameTakenError
from workers.storage.descriptors import is_described
from workers.storage.identifiers import new_id
from workers.storage.models import FEEDS, Collection, CollectionModel, Descriptor, Shape
from workers.storage.paging import Page, cut_page, decode_cursor
from workers.storage.trained_models import load_model


@dataclass(frozen=True)
class Counts:
    """How many shapes a collection holds, can be found in it, and failed."""

    shapes: int = 0
    ready: int = 0
    failed: int = 0


def create_collection(session: Session, *, name: str, description: str, model: str) -> Collection:
    """Make a collection.

    Parameters
    ----------
    session : Session
        That writes.
    name : str
        By which clients find it; no other collection has it.
    description : str
        Text for people.
    model : str
        Name of the model under which it is searched.

    Returns
    -------
    The new row.

    Raises
    ------
    NameTakenError, ModelNotFoundError, ModelNotReadyError
        The name is taken; the model is unknown or not ready.
    """
    load_model(session, model)
    taken = NameTakenError(f"a collection named {name!r} exists already")
    if session.scalar(select(Collection.id).where(Collection.name == name)) is not None:
        raise taken
    row = Collection(
        id=new_id(), name=name, description=description, model=model, created_at=time.time()
    )
    session.add(row)
    try:
        session.flush()
    except IntegrityError:
        raise taken from None
    session.add(CollectionModel(collection_id=row.id, model=model))
    return row


def get_collection(session: Session, name: str, *, lock: bool = False) -> Collection:
    """Return a collection by its name.

    Parameters
    ----------
    session : Session
        That reads, or writes if the row is locked.
    name : str
        Of the collection.
    lock : bool
        Lock its row until the commit.

    Returns
    -------
    The row.

    Raises
    ------
    CollectionNotFoundError
        There is none of this name.
    """
    statement = select(Collection).where(Collection.name == name)
    row = session.scalar(statement.with_for_update() if lock else statement)
    if row is None:
        raise CollectionNotFoundError(f"there is no collection named {name!r}")
    return row


def page_of_collections(session: Session, *, limit: int, cursor: str | None) -> Page[Collection]:
    """Collections in the order of their names.

    Parameters
    ----------
    session : Session
        That reads.
    limit : int
        At most so many, 1 or more.
    cursor : str or None
        ``next_cursor`` of the page before; None for the first page.

    Returns
    -------
    A page of rows.

    Raises
    ------
    InvalidRequestError
        The cursor is none that was given.
    """
    statement = select(Collection).order_by(Collection.name).limit(limit + 1)
    if (after := decode_cursor(cursor)) is not None:
        statement = statement.where(Collection.name > after)
    return cut_page(session.scalars(statement).all(), limit, lambda row: row.name)


def count_shapes(session: Session, collections: Sequence[Collection]) -> Mapping[str, Counts]:
    """Count the shapes of some collections.

    Parameters
    ----------
    session : Session
        That reads.
    collections : sequence of Collection
        Rows.

    Returns
    -------
    Counts by the ids of all of them.
    """
    ids = [row.id for row in collections]
    shapes = dict(
        session.execute(
            select(Shape.collection_id, func.count())
            .where(Shape.collection_id.in_(ids))
            .group_by(Shape.collection_id)
        ).all()
    )
    failed = dict(
        session.execute(
            select(Shape.collection_id, func.count())
            .join(Collection, Collection.id == Shape.collection_id)
            .where(Shape.collection_id.in_(ids), Shape.error.is_not(None))
            .where(~is_described(Collection.model))
            .group_by(Shape.collection_id)
        ).all()
    )
    ready = dict(
        session.execute(
            select(Collection.id, func.count())
            .join(
                Descriptor,
                (Descriptor.collection_id == Collection.id)
                & (Descriptor.model == Collection.model)
                & Descriptor.vector.is_not(None),
            )
            .where(Collection.id.in_(ids))
            .group_by(Collection.id)
        ).all()
    )
    return {i: Counts(shapes.get(i, 0), ready.get(i, 0), failed.get(i, 0)) for i in ids}


def models_of(session: Session, collection_id: str) -> set[str]:
    """Names of the models under which a collection's shapes are described.

    Parameters
    ----------
    session : Session
        That reads.
    collection_id : str
        Id of the collection.

    Returns
    -------
    The model that it is searched under, and those that it is being moved to.
    """
    statement = select(CollectionModel.model).where(CollectionModel.collection_id == collection_id)
    return set(session.scalars(statement))


def add_model(session: Session, collection_id: str, model: str) -> None:
    """From now on describe the collection's shapes under this model too.

    Parameters
    ----------
    session : Session
        That writes.
    collection_id : str
        Id of the collection.
    model : str
        Name of the model.
    """
    if session.get(CollectionModel, (collection_id, model)) is None:
        session.add(CollectionModel(collection_id=collection_id, model=model))


def delete_collection(session: Session, name: str) -> None:
    """Delete a collection, its shapes and their descriptors; waiting work finds nothing to do.

    What is stored of its meshes goes with the next pruning, unless something else refers to it.

    Parameters
    ----------
    session : Session
        That writes.
    name : str
        Of the collection.

    Raises
    ------
    CollectionNotFoundError
        There is none of this name.
    """
    row = get_collection(session, name, lock=True)
    for feed in FEEDS:
        session.execute(delete(feed).where(feed.collection_id == row.id))
    session.delete(row)
