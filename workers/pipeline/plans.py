"""Which parts a job has: the one place that knows kinds of parts and their payloads."""

from typing import Any

from sqlalchemy.orm import Session

from workers.settings import INGEST, LIGHT
from workers.storage.collections import add_model, get_collection
from workers.storage.descriptors import undescribed_shapes
from workers.storage.jobs import NewPart, create_job
from workers.storage.models import Job, Part
from workers.storage.trained_models import load_model

SHAPES_A_PART = 25


def ingest_part(shape_id: str) -> NewPart:
    """Compute an uploaded shape until it can be found."""
    return NewPart("ingest", INGEST, {}, shape_id=shape_id)


def unpack_part(
    collection_id: str,
    sha256: str,
    *,
    filename: str,
    label: str | None,
    attributes: dict[str, Any],
) -> NewPart:
    """Make shapes of an uploaded zip's entries, each with a part of its own."""
    payload = {
        "collection_id": collection_id,
        "sha256": sha256,
        "filename": filename,
        "label": label,
        "attributes": attributes,
    }
    return NewPart("unpack", LIGHT, payload, weight=0)


def query_part(sha256: str, model: str, filename: str) -> NewPart:
    """Describe a mesh that was asked with."""
    return NewPart("query", LIGHT, {"sha256": sha256, "model": model, "filename": filename})


def describe_parts(shape_ids: list[str], model: str) -> list[NewPart]:
    """Describe shapes under a model from their stored spectra, some at a time."""
    chunks = [
        shape_ids[start : start + SHAPES_A_PART]
        for start in range(0, len(shape_ids), SHAPES_A_PART)
    ]
    return [
        NewPart("describe", LIGHT, {"shape_ids": chunk, "model": model}, weight=len(chunk))
        for chunk in chunks
    ]


def activate_part(collection_id: str, model: str) -> NewPart:
    """Move a collection to a model once nothing is undescribed under it."""
    return NewPart("activate", LIGHT, {"collection_id": collection_id, "model": model}, weight=0)


def plan_activation(session: Session, collection: str, model: str) -> tuple[Job, list[Part]]:
    """Make the job that describes a collection under a model and then moves it there.

    From the commit on, uploads are described under both.

    Raises
    ------
    CollectionNotFoundError, ModelNotFoundError, ModelNotReadyError
        The collection or model does not exist, or the model is not trained yet.
    """
    row = get_collection(session, collection, lock=True)
    load_model(session, model)
    add_model(session, row.id, model)
    session.flush()
    undescribed = undescribed_shapes(session, row, model, with_failed=True)
    return create_job(
        session,
        kind="describe",
        unit="shapes",
        parts=describe_parts(undescribed, model),
        collection=row.name,
        model=model,
        finale=activate_part(row.id, model),
    )
