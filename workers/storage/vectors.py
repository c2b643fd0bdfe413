"""Descriptors to search with: of a stored shape, of a stored query, of any bytes."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import ModelNotReadyError
from workers.geometry.arrays import Float32Array
from workers.storage.arrays import vector_from_bytes
from workers.storage.descriptors import get_query_vector, get_vector
from workers.storage.models import Descriptor, Query, Shape
from workers.storage.shapes import get_shape
from workers.storage.stored_meshes import require_ready, why_query_lacks


def shape_vector(session: Session, shape_id: str, model: str) -> Float32Array:
    """Return the descriptor of a stored shape.

    Parameters
    ----------
    session : Session
        That reads.
    shape_id : str
        Id of the shape.
    model : str
        Name of the model.

    Returns
    -------
    (d,) float32
        The descriptor; d is the model's dimension.

    Raises
    ------
    ShapeNotFoundError, ShapeNotReadyError, ModelNotReadyError
        There is no such shape; it is not computed; it is not described under this model.
    """
    view = get_shape(session, shape_id)
    vector = get_vector(session, shape_id, model)
    if vector is None:
        require_ready(view)
        raise ModelNotReadyError(
            f"shape {shape_id} of collection {view.collection!r} is not described under {model!r}"
        )
    return vector_from_bytes(vector)


def query_vector(session: Session, query: Query, model: str) -> Float32Array:
    """Return the descriptor of a stored query's mesh.

    Parameters
    ----------
    session : Session
        That reads.
    query : Query
        Row of the query.
    model : str
        Name of the model; the query's own, or another one.

    Returns
    -------
    (d,) float32
        The descriptor; d is the model's dimension.

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


def find_vector(session: Session, sha256: str, model: str) -> bytes | None:
    """Return the descriptor of a mesh by its content, whatever it was computed for.

    Parameters
    ----------
    session : Session
        That reads.
    sha256 : str
        Of the file.
    model : str
        Name of the model.

    Returns
    -------
    bytes or None
        Little-endian float32, from a query or from a shape in any collection; None if neither
        is described under the model.
    """
    of_query = get_query_vector(session, sha256, model)
    if of_query is not None:
        return of_query
    of_shape = (
        select(Descriptor.vector)
        .join(Shape, Shape.id == Descriptor.shape_id)
        .where(Shape.sha256 == sha256, Descriptor.model == model, Descriptor.vector.is_not(None))
    )
    return session.scalar(of_shape.limit(1))
