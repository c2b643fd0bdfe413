"""Rows of queries by mesh."""

import time
from typing import Any

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from workers.errors import QueryNotFoundError
from workers.storage.identifiers import new_id
from workers.storage.models import Query

REFRESHED_SECONDS = 86_400.0
"""A query that is asked again is kept anew at most this often: most repetitions write nothing."""


def create_query(
    session: Session,
    *,
    collection_id: str,
    job_id: str | None,
    sha256: str,
    model: str,
    parameters: dict[str, Any],
) -> Query:
    """Store a query, so that it can be ranked again whenever it is read.

    Parameters
    ----------
    session : Session
        That writes.
    collection_id : str
        Id of the collection that is searched.
    job_id : str or None
        Id of the job that describes the mesh; None if it is described already.
    sha256 : str
        Hash of the mesh as it was uploaded.
    model : str
        Name of the model under which it is searched.
    parameters : dict
        The options of the request, as JSON.

    Returns
    -------
    The new row.
    """
    row = Query(
        id=new_id(),
        collection_id=collection_id,
        job_id=job_id,
        sha256=sha256,
        model=model,
        parameters=parameters,
        created_at=time.time(),
    )
    session.add(row)
    session.flush()
    return row


def get_query(session: Session, query_id: str) -> Query:
    """Return a query.

    Parameters
    ----------
    session : Session
        That reads.
    query_id : str
        Its id.

    Returns
    -------
    The row.

    Raises
    ------
    QueryNotFoundError
        There is none with this id.
    """
    row = session.get(Query, query_id)
    if row is None:
        raise QueryNotFoundError(f"there is no query {query_id!r}")
    return row


def needs_keeping(session: Session, query_id: str) -> bool:
    """Whether a query that is asked again has to be kept anew.

    Parameters
    ----------
    session : Session
        That reads.
    query_id : str
        Its id.

    Returns
    -------
    True if it is gone, or was made or kept more than a day ago.
    """
    made = session.scalar(select(Query.created_at).where(Query.id == query_id))
    return made is None or made < time.time() - REFRESHED_SECONDS


def keep_query(session: Session, query_id: str) -> bool:
    """Keep a query that was asked again as long as a new one.

    Parameters
    ----------
    session : Session
        That writes.
    query_id : str
        Its id.

    Returns
    -------
    False if it was pruned meanwhile.
    """
    kept = update(Query).where(Query.id == query_id).values(created_at=time.time())
    return session.scalar(kept.returning(Query.id)) is not None
