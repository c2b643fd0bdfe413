"""Which parts a job has: the one place that knows kinds of parts and their payloads."""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy.orm import Session

from workers.pipeline.training_pairs import Pair
from workers.pipeline.training_variants import Variant
from workers.retrieval.model import Model
from workers.settings import INGEST, LIGHT
from workers.storage.collections import add_model, get_collection
from workers.storage.descriptors import undescribed_shapes
from workers.storage.jobs import NewPart, create_job
from workers.storage.models import Job, Json, Part
from workers.storage.trained_models import READY, TRAINING, create_model, load_model

SHAPES_A_PART = 25
QUERIES_A_PART = 250


def ingest_part(shape_id: str) -> NewPart:
    """Compute an uploaded shape until it can be found."""
    return NewPart("ingest", INGEST, {}, shape_id=shape_id)


def unpack_part(
    collection_id: str,
    sha256: str,
    *,
    filename: str,
    label: str | None,
    attributes: Mapping[str, Any],
) -> NewPart:
    """Make shapes of an uploaded zip's entries, each with a part of its own.

    Parameters
    ----------
    collection_id : str
    sha256 : str
        Of the archive's bytes.
    filename : str
        What people call the archive.
    label : str or None
        Label of all shapes; without one the entries' names give it.
    attributes : mapping of str
        Attributes of all shapes.

    Returns
    -------
    NewPart
        It adds nothing to the progress: the shapes do.
    """
    payload = {
        "collection_id": collection_id,
        "sha256": sha256,
        "filename": filename,
        "label": label,
        "attributes": dict(attributes),
    }
    return NewPart("unpack", LIGHT, payload, weight=0)


def entry_parts(archive: Mapping[str, Any], entries: int, entries_a_part: int) -> list[NewPart]:
    """Unpack a long archive, some entries a part.

    Parameters
    ----------
    archive : mapping of str
        Payload of the part that unpacks the whole archive.
    entries : int
        How many entries it has, see `workers.pipeline.archives.count_entries`.
    entries_a_part : int
        At most so many in one part.

    Returns
    -------
    list of NewPart
    """
    return [
        NewPart(
            "unpack",
            LIGHT,
            {**archive, "start": start, "stop": min(start + entries_a_part, entries)},
            weight=0,
        )
        for start in range(0, entries, entries_a_part)
    ]


def query_part(sha256: str, model: str, filename: str) -> NewPart:
    """Describe a mesh that was asked with."""
    return NewPart("query", LIGHT, {"sha256": sha256, "model": model, "filename": filename})


def describe_parts(shape_ids: list[str], model: str, *, marks_shapes: bool = True) -> list[NewPart]:
    """Describe shapes under a model from their stored spectra, some at a time.

    ``marks_shapes`` says whether a shape that fails at it has failed, or only the job is told.
    """
    chunks = [
        shape_ids[start : start + SHAPES_A_PART]
        for start in range(0, len(shape_ids), SHAPES_A_PART)
    ]
    return [
        NewPart(
            "describe",
            LIGHT,
            {"shape_ids": chunk, "model": model, "marks_shapes": marks_shapes},
            weight=len(chunk),
        )
        for chunk in chunks
    ]


def activate_part(collection_id: str, model: str) -> NewPart:
    """Move a collection to a model once nothing is undescribed under it."""
    return NewPart("activate", LIGHT, {"collection_id": collection_id, "model": model}, weight=0)


def evaluate_part(evaluation_id: str, collection_id: str, frame: str) -> NewPart:
    """Rank the shapes of a frame under every model, or put the rankings into tables."""
    payload = {"evaluation_id": evaluation_id, "collection_id": collection_id, "frame": frame}
    return NewPart("evaluate", LIGHT, payload, weight=0)


def rank_parts(
    evaluation: NewPart,
    models: Sequence[str],
    *,
    dissimilarity: str | None,
    queries: int,
    queries_a_part: int = QUERIES_A_PART,
) -> list[NewPart]:
    """Rank the queries of an evaluation's frame under each model, some queries a part.

    Parameters
    ----------
    evaluation : NewPart
        The part that puts the rankings into tables; names the frame.
    models : sequence of str
        Their places number the rankings.
    dissimilarity : str or None
        Takes the place of the models' own dissimilarities.
    queries : int
        How many queries the frame has.
    queries_a_part : int
        At most so many queries in one part.

    Returns
    -------
    list of NewPart
        Model after model, and range after range.
    """
    parts = []
    for number, model in enumerate(models):
        asked = {"model": model, "item": model, "number": number, "dissimilarity": dissimilarity}
        for start, stop in query_ranges(queries, queries_a_part):
            payload = {**evaluation.payload, **asked, "start": start, "stop": stop}
            parts.append(NewPart("rank", LIGHT, payload, weight=stop - start))
    return parts


def query_ranges(queries: int, queries_a_part: int = QUERIES_A_PART) -> list[tuple[int, int]]:
    """Split the queries of a frame into those of each part.

    Parameters
    ----------
    queries : int
        How many queries the frame has.
    queries_a_part : int
        At most so many queries in one part.

    Returns
    -------
    list of (int, int)
        Place of the first query, and of the one after the last.
    """
    starts = range(0, queries, queries_a_part)
    return [(start, min(start + queries_a_part, queries)) for start in starts]


def pair_part(pair: Pair) -> NewPart:
    """Solve a shape and a transformation of it, and take their moments."""
    return NewPart("pair", INGEST, pair.to_payload())


def fit_part(model: str) -> NewPart:
    """Learn a kernel from the moments of all pairs."""
    return NewPart("fit", LIGHT, {"model": model, "item": model}, weight=0)


def variant_part(variant: Variant) -> NewPart:
    """Describe a shape, or a transformed copy of it, under every candidate channel."""
    return NewPart("variant", INGEST, variant.to_payload())


def fit_bank_part(model: str) -> NewPart:
    """Choose and weigh channels by the descriptors of all variants."""
    return NewPart("fit-bank", LIGHT, {"model": model, "item": model}, weight=0)


def plan_training(
    session: Session,
    *,
    name: str,
    method: str,
    parameters: Json,
    training: Json,
    pairs: Sequence[Pair] = (),
    variants: Sequence[Variant] = (),
) -> tuple[Job, list[Part]]:
    """Make a model that is in training, and the job that trains it.

    A kernel is learned from pairs, a bank from variants.

    Raises
    ------
    NameTakenError
        There is a model of this name.
    """
    job, parts = create_job(
        session,
        kind="train",
        unit="variants" if variants else "pairs",
        parts=[*map(pair_part, pairs), *map(variant_part, variants)],
        collection=training["collection"],
        model=name,
        finale=fit_bank_part(name) if variants else fit_part(name),
    )
    definition = {"parameters": parameters, "training": training}
    create_model(
        session, name=name, method=method, state=TRAINING, definition=definition, job_id=job.id
    )
    return job, parts


def add_untrained(session: Session, model: Model) -> Job:
    """Make a model that is ready at once; its job has succeeded already.

    Raises
    ------
    NameTakenError
        There is a model of this name.
    """
    job, _ = create_job(session, kind="train", unit="pairs", model=model.name)
    create_model(
        session,
        name=model.name,
        method=model.method,
        state=READY,
        definition=model.to_json(),
        job_id=job.id,
    )
    return job


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
