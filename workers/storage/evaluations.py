"""Rows of evaluations, and what an evaluation has to know of a collection."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import case, func, select, update
from sqlalchemy.orm import Session, undefer

from workers.errors import EvaluationNotFoundError
from workers.retrieval.protocol import EvaluatedShape
from workers.storage.descriptors import is_described
from workers.storage.jobs import OPEN
from workers.storage.models import Collection, Evaluation, Job, Part, Shape
from workers.storage.paging import Page, cut_page, decode_cursor

Json = dict[str, Any]


@dataclass(frozen=True)
class EvaluationView:
    """An evaluation's row, and its state: that of its job, "succeeded" once it has a result."""

    row: Evaluation
    state: str


@dataclass(frozen=True)
class GroupedShapes:
    """The shapes of a collection by what became of them.

    Attributes
    ----------
    ready : tuple of EvaluatedShape
        Can be found, in the order of their ids.
    failed : tuple of EvaluatedShape
    unfinished : int
        Are still being computed.
    unpacking : int
        Archives that are still being unpacked.
    """

    ready: tuple[EvaluatedShape, ...]
    failed: tuple[EvaluatedShape, ...]
    unfinished: int
    unpacking: int


def group_shapes(session: Session, collection: Collection) -> GroupedShapes:
    """Read what the shapes of a collection are called, and which of them can be compared.

    Parameters
    ----------
    session : Session
        That reads.
    collection : Collection
        Its row.

    Returns
    -------
    All its shapes by what became of them.
    """
    state = case(
        (is_described(collection.model), "ready"),
        (Shape.error.is_not(None), "failed"),
        else_="unfinished",
    )
    columns = (Shape.id, Shape.name, Shape.label, Shape.transformation, Shape.strength)
    rows = session.execute(
        select(state, *columns).where(Shape.collection_id == collection.id).order_by(Shape.id)
    )
    found: dict[str, list[EvaluatedShape]] = {"ready": [], "failed": [], "unfinished": []}
    for its_state, *facts in rows:
        found[its_state].append(EvaluatedShape(*facts))
    unpacking = (
        select(func.count())
        .select_from(Part)
        .join(Job, Job.id == Part.job_id)
        .where(Part.kind == "unpack", Part.state.in_(OPEN), Job.collection == collection.name)
    )
    return GroupedShapes(
        ready=tuple(found["ready"]),
        failed=tuple(found["failed"]),
        unfinished=len(found["unfinished"]),
        unpacking=session.scalar(unpacking) or 0,
    )


def create_evaluation(
    session: Session,
    *,
    evaluation_id: str,
    job_id: str,
    collection: str,
    models: Sequence[str],
    dissimilarity: str | None,
) -> Evaluation:
    """Make the row of an evaluation that has no result yet.

    Parameters
    ----------
    session : Session
        That writes.
    evaluation_id : str
        Its new id.
    job_id : str
        Id of the job that measures.
    collection : str
        Name of the collection.
    models : sequence of str
        Names of the models that are compared.
    dissimilarity : str or None
        What compares their channels; None for each channel's own.

    Returns
    -------
    The new row.
    """
    row = Evaluation(
        id=evaluation_id,
        job_id=job_id,
        collection=collection,
        models=list(models),
        dissimilarity=dissimilarity,
        created_at=time.time(),
    )
    session.add(row)
    session.flush()
    return row


def get_evaluation(session: Session, evaluation_id: str) -> EvaluationView:
    """Return an evaluation, its ranks too.

    Parameters
    ----------
    session : Session
        That reads.
    evaluation_id : str
        Its id.

    Returns
    -------
    The row and its state.

    Raises
    ------
    EvaluationNotFoundError
        There is none with this id.
    """
    statement = _views().where(Evaluation.id == evaluation_id)
    found = session.execute(statement.options(undefer(Evaluation.ranks))).one_or_none()
    if found is None:
        raise EvaluationNotFoundError(f"there is no evaluation {evaluation_id!r}")
    return EvaluationView(*found)


def page_of_evaluations(
    session: Session, *, limit: int, cursor: str | None, collection: str | None = None
) -> Page[EvaluationView]:
    """Evaluations, the newest first; their ranks are not read.

    Parameters
    ----------
    session : Session
        That reads.
    limit : int
        At most so many, 1 or more.
    cursor : str or None
        ``next_cursor`` of the page before; None for the first page.
    collection : str, optional
        Only those of the collection with this name.

    Returns
    -------
    A page of rows with their states.

    Raises
    ------
    InvalidRequestError
        The cursor is none that was given.
    """
    statement = _views().order_by(Evaluation.id.desc()).limit(limit + 1)
    if collection is not None:
        statement = statement.where(Evaluation.collection == collection)
    if (before := decode_cursor(cursor)) is not None:
        statement = statement.where(Evaluation.id < before)
    views = [EvaluationView(*found) for found in session.execute(statement)]
    return cut_page(views, limit, lambda view: view.row.id)


def finish_evaluation(
    session: Session, evaluation_id: str, *, result: Json, ranks: list[Json]
) -> None:
    """Store what was measured.

    Parameters
    ----------
    session : Session
        That writes.
    evaluation_id : str
        Its id; if it is gone, nothing is stored.
    result : dict
        The tables, as JSON.
    ranks : list of dict
        One entry for each query and model, as JSON.
    """
    finished = update(Evaluation).where(Evaluation.id == evaluation_id)
    session.execute(finished.values(result=result, ranks=ranks))


def rename_in_evaluations(session: Session, collection: str, name: str) -> None:
    """Give the evaluations of a collection its new name.

    Parameters
    ----------
    session : Session
        That writes.
    collection : str
        The name that it had.
    name : str
        The name that it has now.
    """
    renamed = update(Evaluation).where(Evaluation.collection == collection)
    session.execute(renamed.values(collection=name))


def _views() -> Any:
    state = case(
        (Evaluation.result.is_not(None), "succeeded"), else_=func.coalesce(Job.state, "failed")
    )
    return select(Evaluation, state).outerjoin(Job, Job.id == Evaluation.job_id)
