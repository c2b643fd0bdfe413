"""Rows of a question that is asked with a mesh."""

import time
import uuid
from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.schemas.queries import MeshQueryForm
from service.subjects import why_query_lacks
from workers.errors import ModelNotReadyError
from workers.geometry.arrays import Float32Array
from workers.pipeline.plans import query_part
from workers.storage.arrays import vector_from_bytes
from workers.storage.descriptors import get_query_vector
from workers.storage.jobs import OPEN, create_job
from workers.storage.models import Collection, Descriptor, Job, Part, Query, Shape
from workers.storage.queries import create_query

SHARED_SECONDS = 3600
"""How far back a question of the same content is looked for, to wait for its job."""


def find_vector(session: Session, sha256: str, model: str) -> bytes | None:
    """Return the descriptor of these bytes, of a question or of a shape in any collection."""
    asked = get_query_vector(session, sha256, model)
    if asked is not None:
        return asked
    stored = (
        select(Descriptor.vector)
        .join(Shape, Shape.id == Descriptor.shape_id)
        .where(Shape.sha256 == sha256, Descriptor.model == model, Descriptor.vector.is_not(None))
    )
    return session.scalar(stored.limit(1))


def query_vector(session: Session, query: Query, model: str) -> Float32Array:
    """Return the descriptor of the mesh that a stored question was asked with.

    Raises
    ------
    ProteusError
        It is not described under this model: not yet, not at all, or why its job failed.
    """
    known = find_vector(session, query.sha256, model)
    if known is not None:
        return vector_from_bytes(known)
    if model != query.model:
        raise ModelNotReadyError(
            f"query {query.id} is described under {query.model!r}, but not under {model!r}"
        )
    raise why_query_lacks(session, query)


def store_question(
    session: Session,
    collection: Collection,
    *,
    sha256: str,
    file_name: str,
    model: str,
    options: MeshQueryForm,
) -> tuple[str, Sequence[Part]]:
    """Store a question and a job that describes its mesh, unless one is at work on it already.

    Returns
    -------
    The question's id, and parts to dispatch after the commit.
    """
    job_id = _job_at_work(session, sha256, model)
    parts: Sequence[Part] = []
    if job_id is None:
        job, parts = create_job(
            session,
            kind="query",
            unit="meshes",
            parts=[query_part(sha256, model, file_name)],
            collection=collection.name,
            model=model,
        )
        job_id = job.id
    query = create_query(
        session,
        collection_id=collection.id,
        job_id=job_id,
        sha256=sha256,
        model=model,
        parameters=options.model_dump(mode="json", by_alias=True, exclude_unset=True),
    )
    return query.id, parts


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
