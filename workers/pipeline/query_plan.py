"""What is stored of a query by mesh: its row, and a job that describes the mesh."""

import json
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.pipeline.part_kinds import query_part
from workers.storage.descriptors import store_query_vectors
from workers.storage.jobs import OPEN, create_job
from workers.storage.models import Collection, Job, Json, Part, Query
from workers.storage.queries import create_query

SHARED_SECONDS = 3600
"""How far back a query with the same mesh is looked for, to wait for its job."""

LOOKED_AT = 500
"""So many queries with one mesh are looked through for one that is the same."""


@dataclass(frozen=True)
class MeshQuery:
    """A query by mesh: with the collection, all that decides the answer.

    Attributes
    ----------
    sha256 : str
        Of the mesh.
    model : str
        Name of the model under which it is searched.
    parameters : Json
        The options that were given.
    """

    sha256: str
    model: str
    parameters: Json


def find_same_query(session: Session, collection_id: str, query: MeshQuery) -> str | None:
    """Look for the same query to this collection among the newest with this mesh.

    Parameters
    ----------
    session : Session
        That reads.
    collection_id : str
        Id of the collection.
    query : MeshQuery
        The query.

    Returns
    -------
    str or None
        Id of the stored query; None if there is none.
    """
    same = (
        Query.sha256 == query.sha256,
        Query.collection_id == collection_id,
        Query.model == query.model,
    )
    newest = select(Query.id, Query.parameters).where(*same).order_by(Query.id.desc())
    wanted = _as_text(query.parameters)
    for query_id, parameters in session.execute(newest.limit(LOOKED_AT)):
        if _as_text(parameters) == wanted:
            return query_id
    return None


def store_described_query(
    session: Session, collection: Collection, query: MeshQuery, vector: bytes
) -> str:
    """Store a query whose mesh is described already, perhaps as a shape's.

    The descriptor is kept as the query's own, so that it outlives the shape.

    Parameters
    ----------
    session : Session
        That writes.
    collection : Collection
        That is searched.
    query : MeshQuery
        The query.
    vector : bytes
        Descriptor of the mesh, little-endian float32.

    Returns
    -------
    str
        Id of the query.
    """
    store_query_vectors(session, query.sha256, [(query.model, vector)])
    return _create(session, collection, query, job_id=None)


def store_query(
    session: Session, collection: Collection, query: MeshQuery, *, file_name: str
) -> tuple[str, Sequence[Part]]:
    """Store a query, and a job that describes its mesh unless another job does so already.

    Parameters
    ----------
    session : Session
        That writes.
    collection : Collection
        That is searched.
    query : MeshQuery
        The query.
    file_name : str
        Of the mesh, as it was sent.

    Returns
    -------
    Id of the query, and parts to dispatch after the commit.
    """
    job_id = _job_at_work(session, query.sha256, query.model)
    parts: Sequence[Part] = []
    if job_id is None:
        job, parts = create_job(
            session,
            kind="query",
            unit="meshes",
            parts=[query_part(query.sha256, query.model, file_name)],
            collection=collection.name,
            model=query.model,
        )
        job_id = job.id
    return _create(session, collection, query, job_id=job_id), parts


def _create(
    session: Session, collection: Collection, query: MeshQuery, *, job_id: str | None
) -> str:
    row = create_query(
        session,
        collection_id=collection.id,
        job_id=job_id,
        sha256=query.sha256,
        model=query.model,
        parameters=query.parameters,
    )
    return row.id


def _as_text(parameters: Json) -> str:
    """Text that is equal for equal parameters; True, 1 and 1.0 differ, unlike in Python."""
    return json.dumps(parameters, sort_keys=True)


def _job_at_work(session: Session, sha256: str, model: str) -> str | None:
    same = (
        select(Query.job_id)
        .join(Job, Job.id == Query.job_id)
        .where(Query.id > _earliest_id(time.time() - SHARED_SECONDS))
        .where(Query.sha256 == sha256, Query.model == model, Job.state.in_(OPEN))
    )
    return session.scalar(same.limit(1))


def _earliest_id(seconds: float) -> str:
    """Smallest time-ordered id of a time: ids are primary keys, so a range of them is cheap."""
    return str(uuid.UUID(int=int(1000 * seconds) << 80))
