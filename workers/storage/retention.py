"""Rows that are kept for some time: queries by mesh, and jobs that have ended."""

from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, and_, delete, func, select, tuple_, update
from sqlalchemy.orm import Session

from workers.storage.jobs import ENDED
from workers.storage.models import Job, Query, QueryDescriptor, TrainedModel
from workers.storage.trained_models import READY


@dataclass(frozen=True)
class Amount:
    """How much of a kind there is.

    Attributes
    ----------
    count : int
        Rows or files.
    bytes : int
        Of files, or of vectors in rows; what else a row takes is not counted.
    """

    count: int = 0
    bytes: int = 0

    def __add__(self, other: "Amount") -> "Amount":
        """Return both together."""
        return Amount(self.count + other.count, self.bytes + other.bytes)


def old_queries(session: Session, before: float) -> Amount:
    """Count queries that were last asked before a time, and descriptors that none of them needs.

    Parameters
    ----------
    session : Session
        That reads.
    before : float
        Seconds since 1970.

    Returns
    -------
    Queries and descriptors together; a descriptor counts once all queries with its mesh are gone.
    """
    queries = session.scalar(
        select(func.count()).select_from(Query).where(Query.created_at < before)
    )
    size = func.coalesce(func.sum(func.length(QueryDescriptor.vector)), 0)
    count, n_bytes = session.execute(select(func.count(), size).where(_unasked(before))).one()
    return Amount((queries or 0) + count, int(n_bytes))


def prune_queries(session: Session, before: float, *, limit: int) -> Amount:
    """Delete queries that were last asked before a time, then descriptors that none needs.

    Parameters
    ----------
    session : Session
        That writes.
    before : float
        Seconds since 1970.
    limit : int
        At most so many of each.

    Returns
    -------
    What went; nothing once there is nothing left to delete.
    """
    old = select(Query.id).where(Query.created_at < before).limit(limit)
    queries = _delete(session, Query, Query.id.in_(old) & (Query.created_at < before), Query.id)
    key = (QueryDescriptor.sha256, QueryDescriptor.model)
    unasked = _unasked(before)
    chosen = tuple_(*key).in_(select(*key).where(unasked).limit(limit)) & unasked
    sizes = _delete(session, QueryDescriptor, chosen, func.length(QueryDescriptor.vector))
    return Amount(len(queries) + len(sizes), sum(sizes))


def old_jobs(session: Session, before: float) -> Amount:
    """Count jobs that ended before a time.

    Parameters
    ----------
    session : Session
        That reads.
    before : float
        Seconds since 1970.

    Returns
    -------
    Jobs; their parts are not counted.
    """
    return Amount(session.scalar(select(func.count()).select_from(Job).where(_over(before))) or 0)


def prune_jobs(session: Session, before: float, *, limit: int) -> Amount:
    """Delete jobs that ended before a time, with their parts.

    A job that failed to train a model stays until that model is deleted: it says why.

    Parameters
    ----------
    session : Session
        That writes.
    before : float
        Seconds since 1970.
    limit : int
        At most so many.

    Returns
    -------
    What went; nothing once there is nothing left to delete.
    """
    over = _over(before)
    old = select(Job.id).where(over).order_by(Job.id).limit(limit)
    gone = _delete(session, Job, Job.id.in_(old) & over, Job.id)
    session.execute(update(Query).where(Query.job_id.in_(gone)).values(job_id=None))
    return Amount(len(gone))


def _over(before: float) -> ColumnElement[bool]:
    """Jobs that ended before a time, and that no unfinished model names."""
    unready = select(TrainedModel.name).where(
        TrainedModel.job_id == Job.id, TrainedModel.state != READY
    )
    ended = func.coalesce(Job.finished_at, Job.created_at) < before
    return and_(Job.state.in_(ENDED), ended, ~unready.exists())


def _unasked(before: float) -> ColumnElement[bool]:
    """Descriptors of queries that were made before a time, and whose queries are gone."""
    asked = select(Query.id).where(Query.sha256 == QueryDescriptor.sha256)
    return and_(QueryDescriptor.created_at < before, ~asked.exists())


def _delete(session: Session, table: Any, where: ColumnElement[bool], returned: Any) -> list[Any]:
    """Delete rows; a row that another transaction has changed meanwhile is looked at again."""
    statement = delete(table).where(where).returning(returned)
    unsynchronised = statement.execution_options(synchronize_session=False)
    return list(session.scalars(unsynchronised))
