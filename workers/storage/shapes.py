"""Rows of shapes.

A shape's state is derived: it can be found exactly when it has a descriptor under its
collection's model, and no flag could disagree with that.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import ColumnElement, case, func, or_, select, true
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from workers.errors import ShapeNotFoundError
from workers.storage.descriptors import is_described, mark_deleted
from workers.storage.identifiers import new_id
from workers.storage.models import Collection, Part, Shape
from workers.storage.paging import Page, cut_page, decode_cursor


@dataclass(frozen=True)
class NewShape:
    """A mesh that was received: its content's hash and what is said of it.

    Its path is where it lay in its folder or archive; without one, that is its name.
    """

    sha256: str
    n_bytes: int
    name: str
    label: str | None = None
    transformation: str | None = None
    strength: int | None = None
    path: str = ""
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ShapeView:
    """A shape's row, the name of its collection, and its state."""

    row: Shape
    collection: str
    state: str


def create_shape(session: Session, collection_id: str, shape: NewShape) -> tuple[str, bool]:
    """Make a shape, unless the collection has one of the same content.

    Parameters
    ----------
    session : Session
        That writes.
    collection_id : str
        Id of the collection.
    shape : NewShape
        Content and names.

    Returns
    -------
    shape_id : str
        Id of the new shape, or of the one that was there.
    created : bool
        Whether it is new.
    """
    dialect = session.get_bind().dialect.name
    insert = postgresql.insert if dialect == "postgresql" else sqlite.insert
    statement = insert(Shape).values(
        id=new_id(),
        collection_id=collection_id,
        repairs=[],
        found=[],
        created_at=time.time(),
        **{
            **vars(shape),
            "path": shape.path or shape.name,
            "attributes": dict(shape.attributes),
        },
    )
    unseen = statement.on_conflict_do_nothing(index_elements=["collection_id", "sha256"])
    created = session.scalar(unseen.returning(Shape.id))
    if created is not None:
        return created, True
    same = (Shape.collection_id == collection_id, Shape.sha256 == shape.sha256)
    return session.execute(select(Shape.id).where(*same)).scalar_one(), False


def state_of_shape() -> ColumnElement[str]:
    """SQL expression of the state: ready, failed, processing or queued.

    Returns
    -------
    An expression for a statement in which ``Shape`` is joined with ``Collection``.
    """
    running = select(Part.id).where(Part.shape_id == Shape.id, Part.state == "running").exists()
    return case(
        (is_described(Collection.model), "ready"),  # whatever failed since: it is found
        (Shape.error.is_not(None), "failed"),
        (running, "processing"),
        else_="queued",
    )


def lies_under(folder: str) -> ColumnElement[bool]:
    """SQL condition that a shape lay at a path, or anywhere below it.

    Parameters
    ----------
    folder : str
        Names with ``/`` between them; one at the end means the same. Upper and lower case differ.

    Returns
    -------
    An expression for a statement over ``Shape``; it is true for all shapes if the path is empty.
    """
    folder = folder.strip("/")
    below = func.substr(Shape.path, 1, len(folder) + 1) == f"{folder}/"
    return or_(Shape.path == folder, below) if folder else true()


def get_shape(session: Session, shape_id: str) -> ShapeView:
    """Return a shape.

    Parameters
    ----------
    session : Session
        That reads.
    shape_id : str
        Its id.

    Returns
    -------
    The row, the name of its collection, and its state.

    Raises
    ------
    ShapeNotFoundError
        There is none with this id.
    """
    found = get_shapes(session, [shape_id])
    if not found:
        raise ShapeNotFoundError(f"there is no shape {shape_id!r}")
    return found[shape_id]


def get_shapes(session: Session, shape_ids: Sequence[str]) -> dict[str, ShapeView]:
    """Return those of some shapes that exist.

    Parameters
    ----------
    session : Session
        That reads.
    shape_ids : sequence of str
        Ids, in any number.

    Returns
    -------
    Rows with collections and states, by id.
    """
    found: dict[str, ShapeView] = {}
    for start in range(0, len(shape_ids), 500):
        ids = shape_ids[start : start + 500]
        for row in session.execute(_views().where(Shape.id.in_(ids))):
            found[row[0].id] = ShapeView(*row)
    return found


def page_of_shapes(
    session: Session,
    collection_id: str,
    *,
    limit: int,
    cursor: str | None,
    state: str | None = None,
    path: str | None = None,
    **equals: str | None,
) -> Page[ShapeView]:
    """Shapes of a collection in the order they came.

    Parameters
    ----------
    session : Session
        That reads.
    collection_id : str
        Id of the collection.
    limit : int
        At most so many, 1 or more.
    cursor : str or None
        ``next_cursor`` of the page before; None for the first page.
    state : str, optional
        Only those in this state.
    path : str, optional
        Only the one that lay there, or all below this folder.
    **equals : str or None
        Only those whose columns have these values; None for any.

    Returns
    -------
    A page of rows with their states.

    Raises
    ------
    InvalidRequestError
        The cursor is none that was given.
    """
    statement = _views().where(Shape.collection_id == collection_id)
    for name, value in equals.items():
        if value is not None:
            statement = statement.where(getattr(Shape, name) == value)
    if state is not None:
        statement = statement.where(state_of_shape() == state)
    if path is not None:
        statement = statement.where(lies_under(path))
    if (after := decode_cursor(cursor)) is not None:
        statement = statement.where(Shape.id > after)
    rows = session.execute(statement.order_by(Shape.id).limit(limit + 1)).all()
    return cut_page([ShapeView(*row) for row in rows], limit, lambda view: view.row.id)


def delete_shape(session: Session, shape_id: str) -> None:
    """Delete a shape; its descriptors stay for a while as rows that say it is gone.

    What is stored of its mesh goes with the next pruning, unless something else refers to it.

    Parameters
    ----------
    session : Session
        That writes.
    shape_id : str
        Its id.

    Raises
    ------
    ShapeNotFoundError
        There is none with this id.
    """
    shape = session.get(Shape, shape_id, with_for_update=True)
    if shape is None:
        raise ShapeNotFoundError(f"there is no shape {shape_id!r}")
    session.delete(shape)
    session.flush()
    mark_deleted(session, [shape_id])


def _views() -> Any:
    return select(Shape, Collection.name, state_of_shape()).join(
        Collection, Collection.id == Shape.collection_id
    )
