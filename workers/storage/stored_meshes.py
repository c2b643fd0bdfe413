"""Stored meshes that can be looked at: those of shapes, and those of queries."""

from dataclasses import dataclass

from sqlalchemy.orm import Session

from workers.errors import FailedWorkError, ProteusError, ShapeNotReadyError
from workers.storage.collections import get_collection
from workers.storage.jobs import ENDED, get_job
from workers.storage.models import Query
from workers.storage.queries import get_query
from workers.storage.shapes import ShapeView, get_shape


@dataclass(frozen=True)
class StoredMesh:
    """A mesh by its content, and what is known of it.

    Attributes
    ----------
    sha256 : str
        Of the file as it was uploaded.
    name : str
        Of the file; "query" for the mesh of a query, whose name is not kept.
    format : str or None
        By the file's content, where it is known.
    model : str
        Name of the model under whose views it is solved: of the shape's collection, or the query's.
    absence : ProteusError
        The answer where something is missing that would have been computed of it.
    """

    sha256: str
    name: str
    format: str | None
    model: str
    absence: ProteusError


def mesh_of_shape(session: Session, shape_id: str) -> StoredMesh:
    """Return the mesh of a stored shape.

    Parameters
    ----------
    session : Session
        That reads.
    shape_id : str
        Id of the shape.

    Returns
    -------
    StoredMesh
        The mesh, with the model of the shape's collection.

    Raises
    ------
    ShapeNotFoundError
        There is no shape with this id.
    """
    view = get_shape(session, shape_id)
    model = get_collection(session, view.collection).model
    row = view.row
    return StoredMesh(row.sha256, row.name, row.format, model, _why_shape_lacks(view))


def mesh_of_query(session: Session, query_id: str) -> StoredMesh:
    """Return the mesh of a stored query.

    Parameters
    ----------
    session : Session
        That reads.
    query_id : str
        Id of the query.

    Returns
    -------
    StoredMesh
        The mesh, with the query's model.

    Raises
    ------
    QueryNotFoundError
        There is no query with this id.
    """
    row = get_query(session, query_id)
    return StoredMesh(row.sha256, "query", None, row.model, why_query_lacks(session, row))


def why_query_lacks(session: Session, query: Query) -> ProteusError:
    """Say why something was not computed of a query's mesh: its job goes on, or has failed.

    Parameters
    ----------
    session : Session
        That reads.
    query : Query
        Row of the query.

    Returns
    -------
    ProteusError
        To be raised where the thing is asked for.
    """
    job = None if query.job_id is None else get_job(session, query.job_id)
    if job is None or job.state == "succeeded":
        return ShapeNotReadyError(f"this was not computed of the mesh of query {query.id}")
    if job.state in ENDED:
        return FailedWorkError.of(job.errors)
    return ShapeNotReadyError(f"the job of query {query.id} is {job.state}, expected succeeded")


def require_ready(view: ShapeView) -> None:
    """Refuse a shape that is still being computed, or whose computation failed.

    Parameters
    ----------
    view : ShapeView
        The shape and its state.

    Raises
    ------
    ShapeNotReadyError
        With its state, or the reason of its failure.
    """
    if view.state == "failed" and view.row.error is not None:
        raise ShapeNotReadyError(
            f"the computation of shape {view.row.id} failed: {view.row.error['detail']}"
        )
    if view.state != "ready":
        raise ShapeNotReadyError(f"shape {view.row.id} is {view.state}, expected ready")


def _why_shape_lacks(view: ShapeView) -> ShapeNotReadyError:
    try:
        require_ready(view)
    except ShapeNotReadyError as error:
        return error
    return ShapeNotReadyError(f"this was not computed of shape {view.row.id} yet")
