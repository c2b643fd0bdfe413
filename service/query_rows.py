"""Rows of a question that is asked with a mesh."""

import json
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.schemas.queries import MeshQueryForm
from service.subjects import why_query_lacks
from workers.errors import ModelNotReadyError
from workers.geometry.arrays import Float32Array
from workers.pipeline.plans import query_part
from workers.storage.arrays import vector_from_bytes
from workers.storage.descriptors import get_query_vector, store_query_vectors
from workers.storage.jobs import OPEN, create_job
from workers.storage.models import Collection, Descriptor, Job, Json, Part, Query, Shape
from workers.storage.queries import create_query

SHARED_SECONDS = 3600
"""How far back a question of the same content is looked for, to wait for its job."""

LOOKED_AT = 500
"""So many questions with one mesh are looked through for one that is the same."""


@dataclass(frozen=True)
class MeshQuestion:
    """What is asked, and how: with the collection, all that decides the answer.

    Attributes
    ----------
    sha256 : str
        Of the mesh.
    model : str
        Under which it is searched.
    options : MeshQueryForm
    """

    sha256: str
    model: str
    options: MeshQueryForm

    @property
    def parameters(self) -> Json:
        """The options that were given, as they are stored."""
        return self.options.model_dump(mode="json", by_alias=True, exclude_unset=True)


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


def find_question(session: Session, collection_id: str, question: MeshQuestion) -> str | None:
    """Id of a question to this collection that was stored before and is the same, if there is one.

    It is looked for among the newest with this mesh.
    """
    same = (
        Query.sha256 == question.sha256,
        Query.collection_id == collection_id,
        Query.model == question.model,
    )
    newest = select(Query.id, Query.parameters).where(*same).order_by(Query.id.desc())
    wanted = _as_text(question.parameters)
    for query_id, parameters in session.execute(newest.limit(LOOKED_AT)):
        if _as_text(parameters) == wanted:
            return query_id
    return None


def store_answered(
    session: Session, collection: Collection, question: MeshQuestion, vector: bytes
) -> str:
    """Store a question whose mesh is described already, by a shape perhaps; returns its id.

    The descriptor is kept as the question's own, so that it outlives the shape.
    """
    store_query_vectors(session, question.sha256, [(question.model, vector)])
    return _create(session, collection, question, job_id=None)


def store_question(
    session: Session, collection: Collection, question: MeshQuestion, *, file_name: str
) -> tuple[str, Sequence[Part]]:
    """Store a question and a job that describes its mesh, unless one is at work on it already.

    Returns
    -------
    The question's id, and parts to dispatch after the commit.
    """
    job_id = _job_at_work(session, question.sha256, question.model)
    parts: Sequence[Part] = []
    if job_id is None:
        job, parts = create_job(
            session,
            kind="query",
            unit="meshes",
            parts=[query_part(question.sha256, question.model, file_name)],
            collection=collection.name,
            model=question.model,
        )
        job_id = job.id
    return _create(session, collection, question, job_id=job_id), parts


def _create(
    session: Session, collection: Collection, question: MeshQuestion, *, job_id: str | None
) -> str:
    query = create_query(
        session,
        collection_id=collection.id,
        job_id=job_id,
        sha256=question.sha256,
        model=question.model,
        parameters=question.parameters,
    )
    return query.id


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
