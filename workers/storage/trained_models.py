"""Rows of models: the built-in ones, and those that were trained."""

import time
from collections.abc import Iterable

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from workers.errors import ConflictError, ModelNotFoundError, ModelNotReadyError
from workers.retrieval.model import Model
from workers.storage.change_feed import ensure_counter
from workers.storage.models import (
    Collection,
    CollectionModel,
    Descriptor,
    QueryDescriptor,
    TrainedModel,
)
from workers.storage.paging import Page, cut_page, decode_cursor


def ensure_models(session: Session, models: Iterable[Model]) -> None:
    """Write the built-in models that are missing; one that is there stays as it is."""
    ensure_counter(session)
    known = set(session.scalars(select(TrainedModel.name)))
    for model in models:
        if model.name not in known:
            session.add(
                TrainedModel(
                    name=model.name,
                    method=model.method,
                    state="ready",
                    built_in=True,
                    definition=model.to_json(),
                    created_at=time.time(),
                )
            )


def get_model_row(session: Session, name: str) -> TrainedModel:
    """Return the row of a model.

    Raises
    ------
    ModelNotFoundError
        There is none of this name.
    """
    row = session.get(TrainedModel, name)
    if row is None:
        raise ModelNotFoundError(f"there is no model named {name!r}")
    return row


def load_model(session: Session, name: str) -> Model:
    """Return a model that is ready to describe with.

    Raises
    ------
    ModelNotFoundError, ModelNotReadyError
        There is none of this name, or it is not trained yet.
    """
    row = get_model_row(session, name)
    if row.state != "ready":
        raise ModelNotReadyError(f"the model {name!r} is {row.state}, expected ready")
    return Model.from_json(row.definition)


def page_of_models(session: Session, *, limit: int, cursor: str | None) -> Page[TrainedModel]:
    """Models by name."""
    statement = select(TrainedModel).order_by(TrainedModel.name).limit(limit + 1)
    if (after := decode_cursor(cursor)) is not None:
        statement = statement.where(TrainedModel.name > after)
    return cut_page(session.scalars(statement).all(), limit, lambda row: row.name)


def delete_model(session: Session, name: str) -> None:
    """Forget a model and the descriptors under it.

    Raises
    ------
    ModelNotFoundError
        There is none of this name.
    ConflictError
        It is built in, or a collection is searched or being described under it.
    """
    row = get_model_row(session, name)
    if row.built_in:
        raise ConflictError(f"the model {name!r} is built in and cannot be deleted")
    users = session.scalars(select(Collection.name).where(Collection.model == name).limit(3)).all()
    if users:
        raise ConflictError(f"the model {name!r} is in use by collection {', '.join(users)}")
    session.execute(delete(CollectionModel).where(CollectionModel.model == name))
    session.execute(delete(Descriptor).where(Descriptor.model == name))
    session.execute(delete(QueryDescriptor).where(QueryDescriptor.model == name))
    session.delete(row)
