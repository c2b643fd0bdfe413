"""A training as rows: its examples are chosen, and its job and its model are made."""

from collections.abc import Callable, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import ShapeNotReadyError
from workers.geometry.views import View
from workers.pipeline.part_kinds import example_part, fit_bank_part, fit_part
from workers.retrieval.model import Model
from workers.storage.collections import get_collection
from workers.storage.jobs import create_job
from workers.storage.models import Collection, Job, Json, Part, Shape
from workers.storage.shapes import state_of_shape
from workers.storage.trained_models import READY, TRAINING, create_model
from workers.training.chosen_pairs import check_pairs, pairs_of
from workers.training.chosen_variants import check_variants, variants_of
from workers.training.examples import Pair, Variant
from workers.training.request import TrainingRequest
from workers.training.shapes import TrainingShape
from workers.training.sources import StoredSource


def choose_pairs(
    session: Session,
    request: TrainingRequest,
    *,
    view: View,
    criterion: str,
    working_vertices: int,
    count_vertices: Callable[[StoredSource], int],
) -> list[Pair]:
    """Choose the pairs that a kernel is learned from; nothing is written.

    Parameters
    ----------
    session : Session
        An open transaction.
    request : TrainingRequest
        What the client asks for.
    view : View
        Under which shapes are solved.
    criterion : str
        Of the learning.
    working_vertices : int
        Of the service: creatures have no more, if they can.
    count_vertices : callable
        Number of vertices in a file as it was uploaded.

    Returns
    -------
    list of Pair
        In an order that does not depend on that of the uploads.

    Raises
    ------
    CollectionNotFoundError, ShapeNotReadyError
        There is no such collection, or some of its shapes are still being computed.
    InsufficientTrainingDataError
        There are too few shapes, classes or transformations.
    InvalidRequestError
        A transformation or strength is unknown, vertex counts differ, or the request asks for
        things that do not go together.
    """
    check_pairs(request)
    return pairs_of(
        request,
        _ready_shapes(session, request),
        view=view,
        criterion=criterion,
        working_vertices=working_vertices,
        count_vertices=count_vertices,
    )


def choose_variants(
    session: Session,
    request: TrainingRequest,
    *,
    views: Sequence[View],
    working_vertices: int,
) -> list[Variant]:
    """Choose the variants that a bank is learned from; nothing is written.

    Parameters
    ----------
    session : Session
        An open transaction.
    request : TrainingRequest
        Of a collection's shapes, of so many creatures, or of both.
    views : sequence of View
        Under which they are described.
    working_vertices : int
        Of the service: creatures have no more, if they can.

    Returns
    -------
    list of Variant
        Every shape, and after it every transformation of it in every strength.

    Raises
    ------
    CollectionNotFoundError, ShapeNotReadyError
        There is no such collection, or some of its shapes are still being computed.
    InsufficientTrainingDataError
        There are fewer than two shapes, or no transformations.
    InvalidRequestError
        Something is unknown, or too much, or does not go together.
    """
    check_variants(request)
    shapes = _ready_shapes(session, request)
    return variants_of(request, shapes, views=views, working_vertices=working_vertices)


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

    Parameters
    ----------
    session : Session
        An open transaction.
    name : str
        Of the model.
    method : str
        How it is learned.
    parameters, training : dict
        What was asked for, as it is shown with the model.
    pairs : sequence of Pair
        A kernel is learned from them.
    variants : sequence of Variant
        A bank is learned from them.

    Returns
    -------
    (Job, list of Part)
        The parts are to be sent after the commit.

    Raises
    ------
    NameTakenError
        There is a model of this name.
    """
    job, parts = create_job(
        session,
        kind="train",
        unit="variants" if variants else "pairs",
        parts=map(example_part, [*pairs, *variants]),
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
    """Make a model that is ready at once.

    Parameters
    ----------
    session : Session
        An open transaction.
    model : Model
        How shapes are described.

    Returns
    -------
    Job
        It has succeeded already.

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


def _ready_shapes(session: Session, request: TrainingRequest) -> list[TrainingShape]:
    """Shapes of the request's collection that were computed, in any order."""
    if request.collection is None:
        return []
    collection = get_collection(session, request.collection)
    columns = (Shape.sha256, Shape.name, Shape.label, Shape.n_vertices, Shape.repairs)
    rows = session.execute(
        select(*columns, state_of_shape().label("state"))
        .join(Collection, Collection.id == Shape.collection_id)
        .where(Shape.collection_id == collection.id)
    ).all()
    waiting = sorted(row.name for row in rows if row.state in {"queued", "processing"})
    if waiting:
        more = f" and {len(waiting) - 1} more" if len(waiting) > 1 else ""
        raise ShapeNotReadyError(
            f"{waiting[0]}{more} of collection {collection.name!r} are still being computed; train "
            "when they are ready"
        )
    return [
        TrainingShape(row.sha256, row.name, row.label, row.n_vertices or 0, bool(row.repairs))
        for row in rows
        if row.state == "ready"
    ]
