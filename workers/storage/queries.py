"""Rows of questions that were asked with a mesh."""

import time
from typing import Any

from sqlalchemy.orm import Session

from workers.errors import QueryNotFoundError
from workers.storage.identifiers import new_id
from workers.storage.models import Query


def create_query(
    session: Session,
    *,
    collection_id: str,
    job_id: str | None,
    sha256: str,
    model: str,
    parameters: dict[str, Any],
) -> Query:
    """Remember a question, so that it can be ranked again whenever it is read."""
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
    """Return a question.

    Raises
    ------
    QueryNotFoundError
        There is none with this id.
    """
    row = session.get(Query, query_id)
    if row is None:
        raise QueryNotFoundError(f"there is no query {query_id!r}")
    return row
