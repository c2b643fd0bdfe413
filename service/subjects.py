"""Meshes of which there is something to see: of stored shapes, and those that were asked with."""

from dataclasses import dataclass

from sqlalchemy.orm import Session

from service.errors import failed_work
from service.search.ranking import require_ready
from workers.errors import ProteusError, ShapeNotReadyError
from workers.storage.collections import get_collection
from workers.storage.jobs import ENDED, get_job
from workers.storage.models import Query
from workers.storage.queries import get_query
from workers.storage.shapes import ShapeView, get_shape


@dataclass(frozen=True)
class Subject:
    """A mesh by its content, and what is said of it.

    Attributes
    ----------
    sha256 : str
        Of the file as it was uploaded.
    name : str
        Of the file; "query" for one that was asked with, whose name is not kept.
    format : str or None
        By the file's content, where it is known.
    model : str
        Name of the model under whose views it is solved: of the shape's collection, or the query's.
    absence : ProteusError
        Why something is not there that would have been computed of it.
    """

    sha256: str
    name: str
    format: str | None
    model: str
    absence: ProteusError


def subject_of_shape(session: Session, shape_id: str) -> Subject:
    """Return the mesh of a stored shape.

    Raises
    ------
    ShapeNotFoundError
        There is no shape with this id.
    """
    view = get_shape(session, shape_id)
    model = get_collection(session, view.collection).model
    row = view.row
    return Subject(row.sha256, row.name, row.format, model, _why_shape_lacks(view))


def subject_of_query(session: Session, query_id: str) -> Subject:
    """Return the mesh that a stored query was asked with.

    Raises
    ------
    QueryNotFoundError
        There is no query with this id.
    """
    row = get_query(session, query_id)
    return Subject(row.sha256, "query", None, row.model, why_query_lacks(session, row))


def why_query_lacks(session: Session, query: Query) -> ProteusError:
    """Why something was not computed of a query's mesh: its job is at work, or has failed."""
    job = None if query.job_id is None else get_job(session, query.job_id)
    if job is None or job.state == "succeeded":
        return ShapeNotReadyError(f"this was not computed of the mesh of query {query.id}")
    if job.state in ENDED:
        return failed_work(job.errors)
    return ShapeNotReadyError(f"the job of query {query.id} is {job.state}, expected succeeded")


def _why_shape_lacks(view: ShapeView) -> ShapeNotReadyError:
    try:
        require_ready(view)
    except ShapeNotReadyError as error:
        return error
    return ShapeNotReadyError(f"this was not computed of shape {view.row.id} yet")
