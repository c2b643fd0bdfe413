"""Rows of models: the built-in ones, and those that were trained."""

import hashlib
import json
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import delete, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from workers.errors import ConflictError, ModelNotFoundError, ModelNotReadyError, NameTakenError
from workers.retrieval.model import Model
from workers.storage.change_feed import ensure_counter
from workers.storage.jobs import OPEN
from workers.storage.models import (
    FEEDS,
    Collection,
    CollectionModel,
    Job,
    Json,
    QueryDescriptor,
    TrainedModel,
)
from workers.storage.paging import Page, cut_page, decode_cursor

READY, TRAINING, FAILED = "ready", "training", "failed"


@dataclass(frozen=True)
class ModelView:
    """A model's row and its state."""

    row: TrainedModel
    state: str


def ensure_models(
    session: Session, models: Iterable[Model], reports: Mapping[str, Mapping[str, Any]] = {}
) -> None:
    """Write the built-in models that are missing; one that is there stays as it is.

    Parameters
    ----------
    session : Session
        That writes.
    models : iterable of Model
        All built-in models.
    reports : Mapping
        What the training of those that were trained found, by their names.
    """
    ensure_counter(session)
    known = set(session.scalars(select(TrainedModel.name)))
    for model in models:
        if model.name not in known:
            session.add(
                TrainedModel(
                    name=model.name,
                    method=model.method,
                    state=READY,
                    built_in=True,
                    definition={**model.to_json(), "training": reports.get(model.name)},
                    created_at=time.time(),
                )
            )


def get_model_row(session: Session, name: str) -> TrainedModel:
    """Return the row of a model.

    Parameters
    ----------
    session : Session
        That reads.
    name : str
        Of the model.

    Returns
    -------
    The row, whatever the model's state.

    Raises
    ------
    ModelNotFoundError
        There is none of this name.
    """
    row = session.get(TrainedModel, name)
    if row is None:
        raise ModelNotFoundError(f"there is no model named {name!r}")
    return row


def model_fingerprint(row: TrainedModel) -> str:
    """Digest that tells a model from another that had its name before.

    Parameters
    ----------
    row : TrainedModel
        The row of the model.

    Returns
    -------
    64 hexadecimal digits of its definition and the time it was made.
    """
    definition = json.dumps(row.definition, sort_keys=True)
    return hashlib.sha256(f"{row.created_at!r} {definition}".encode()).hexdigest()


def load_model(session: Session, name: str) -> Model:
    """Return a model that is ready to describe with.

    Parameters
    ----------
    session : Session
        That reads.
    name : str
        Of the model.

    Returns
    -------
    The model.

    Raises
    ------
    ModelNotFoundError, ModelNotReadyError
        There is none of this name, or it is not trained yet.
    """
    view = get_model(session, name)
    if view.state == TRAINING:
        raise ModelNotReadyError(f"the model {name!r} is in training, expected ready")
    if view.state != READY:
        raise ModelNotReadyError(f"the training of the model {name!r} failed, expected ready")
    return Model.from_json(view.row.definition)


def model_state(row: TrainedModel, job_state: str | None) -> str:
    """State of a model: its row is ready, or else its job says how its training stands.

    Parameters
    ----------
    row : TrainedModel
        The row of the model.
    job_state : str or None
        State of its job; None if there is no job.

    Returns
    -------
    ``ready``, ``training`` or ``failed``.
    """
    if row.state == READY or job_state is None:
        return row.state
    return TRAINING if job_state in OPEN else FAILED


def get_model(session: Session, name: str) -> ModelView:
    """Return a model and its state.

    Parameters
    ----------
    session : Session
        That reads.
    name : str
        Of the model.

    Returns
    -------
    The row and the state.

    Raises
    ------
    ModelNotFoundError
        There is none of this name.
    """
    view = _find(session, name)
    if view is None:
        raise ModelNotFoundError(f"there is no model named {name!r}")
    return view


def get_training(session: Session, name: str, *, job_id: str) -> TrainedModel:
    """Return the row of a model that a job trains; it is locked until the commit.

    Parameters
    ----------
    session : Session
        That writes.
    name : str
        Of the model.
    job_id : str
        Id of the job.

    Returns
    -------
    The row.

    Raises
    ------
    ModelNotFoundError
        The model of this job was deleted; another of its name is left alone.
    """
    row = session.get(TrainedModel, name, with_for_update=True, populate_existing=True)
    if row is None or row.job_id != job_id:
        raise ModelNotFoundError(f"the model {name!r} was deleted before its training ended")
    return row


def page_of_models(session: Session, *, limit: int, cursor: str | None) -> Page[ModelView]:
    """Models in the order of their names.

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
    A page of rows with their states.

    Raises
    ------
    InvalidRequestError
        The cursor is none that was given.
    """
    statement = select(TrainedModel, Job.state).outerjoin(Job, Job.id == TrainedModel.job_id)
    statement = statement.order_by(TrainedModel.name).limit(limit + 1)
    if (after := decode_cursor(cursor)) is not None:
        statement = statement.where(TrainedModel.name > after)
    views = [ModelView(row, model_state(row, job)) for row, job in session.execute(statement)]
    return cut_page(views, limit, lambda view: view.row.name)


def require_free_name(session: Session, name: str) -> None:
    """Refuse the name of a model that is there, in training, or failed to be trained.

    Parameters
    ----------
    session : Session
        That reads.
    name : str
        That a new model is to have.

    Raises
    ------
    NameTakenError
        Saying which.
    """
    view = _find(session, name)
    if view is None:
        return
    if view.state == TRAINING:
        raise NameTakenError(f"a model named {name!r} is in training")
    if view.state == FAILED:
        raise NameTakenError(
            f"the training of a model named {name!r} failed; delete it to use its name again"
        )
    raise NameTakenError(f"a model named {name!r} exists already")


def create_model(
    session: Session, *, name: str, method: str, state: str, definition: Json, job_id: str
) -> TrainedModel:
    """Make a model that is ready, or that a job trains.

    Parameters
    ----------
    session : Session
        That writes.
    name : str
        No other model has it.
    method : str
        How it describes shapes, or how it is trained.
    state : str
        ``ready`` or ``training``.
    definition : dict
        The model as JSON; in training, what was asked for.
    job_id : str
        Id of the job that trains it, or that has made it.

    Returns
    -------
    The new row.

    Raises
    ------
    NameTakenError
        There is one of this name, or one is trained or failed to be trained under it.
    """
    require_free_name(session, name)
    row = TrainedModel(
        name=name,
        method=method,
        state=state,
        built_in=False,
        definition=definition,
        job_id=job_id,
        created_at=time.time(),
    )
    session.add(row)
    try:
        session.flush()
    except IntegrityError:
        raise NameTakenError(f"a model named {name!r} exists already") from None
    return row


def delete_model(session: Session, name: str) -> None:
    """Delete a model and the descriptors under it.

    Parameters
    ----------
    session : Session
        That writes.
    name : str
        Of the model.

    Raises
    ------
    ModelNotFoundError
        There is none of this name.
    ConflictError
        It is built in, in training, or a collection is searched under it.
    """
    view = get_model(session, name)
    row = view.row
    if row.built_in:
        raise ConflictError(f"the model {name!r} is built in and cannot be deleted")
    if view.state == TRAINING:
        raise ConflictError(f"the model {name!r} is in training; cancel job {row.job_id} first")
    users = session.scalars(select(Collection.name).where(Collection.model == name).limit(3)).all()
    if users:
        raise ConflictError(f"the model {name!r} is in use by collection {', '.join(users)}")
    session.execute(delete(CollectionModel).where(CollectionModel.model == name))
    for feed in FEEDS:
        session.execute(delete(feed).where(feed.model == name))
    session.execute(delete(QueryDescriptor).where(QueryDescriptor.model == name))
    session.delete(row)


def _find(session: Session, name: str) -> ModelView | None:
    """Read row and state at one moment: the job ends when the row becomes ready."""
    statement = select(TrainedModel, Job.state).outerjoin(Job, Job.id == TrainedModel.job_id)
    found = session.execute(
        statement.where(TrainedModel.name == name).execution_options(populate_existing=True)
    ).one_or_none()
    return None if found is None else ModelView(found[0], model_state(*found))
