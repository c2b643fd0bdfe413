"""Shapes are described under a further model, from their stored spectra."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeAlias

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import BlobNotFoundError, ProteusError
from workers.geometry.arrays import Float32Array
from workers.geometry.solution import Solver
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import DESCRIBING, READING
from workers.pipeline.solve import describe_mesh, read_mesh
from workers.pipeline.windows import take_signature
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model, describe
from workers.storage.arrays import vector_to_bytes
from workers.storage.descriptors import store_descriptors
from workers.storage.models import Job, Shape
from workers.storage.parts import Claim, Failure
from workers.storage.solutions import load_cleaned, load_solution
from workers.storage.trained_models import load_model

DescribeShape: TypeAlias = Callable[[Workbench, Shape, Model], Float32Array]


def describe_stored(bench: Workbench, shape: Shape, model: Model) -> Float32Array:
    """Describe a shape from its stored spectra, and solve it only under a view that is new.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    shape : Shape
        Its row.
    model : Model
        How shapes are described.

    Returns
    -------
    (d,) float32
        The descriptor, of the model's dimension.

    Raises
    ------
    ProteusError
        It cannot be described under this model.
    """
    try:
        solutions = {v.name: load_solution(bench.blobs, shape.sha256, v) for v in model.views}
    except BlobNotFoundError:
        bench.progress.enter(READING)
        read = read_mesh(bench.blobs, shape.sha256, filename=shape.name, settings=bench.settings)
        return describe_mesh(
            bench.blobs, shape.sha256, read.mesh, [model], enter=bench.progress.enter
        ).vectors[model.name]
    bench.progress.enter(DESCRIBING)
    return describe(solutions, model)


def redescribe(
    bench: Workbench, claim: Claim, *, describe_shape: DescribeShape = describe_stored
) -> Outcome:
    """Describe some shapes under a model; a shape that fails is named, the others go on.

    An evaluation asks not to mark shapes, since its collection does not follow the model. Then a
    failure leaves no error on the shape, and a success removes no error.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the shapes and the model, and says whether shapes are marked.
    describe_shape : callable
        Returns the descriptor of one shape.

    Returns
    -------
    Outcome
        Stores the descriptors of those shapes that still exist.

    Raises
    ------
    ModelNotFoundError, ModelNotReadyError
        The model was deleted.
    """
    ids, name = claim.payload["shape_ids"], claim.payload["model"]
    with bench.database.read() as session:
        model = load_model(session, name)
        shapes = list(session.scalars(select(Shape).where(Shape.id.in_(ids)).order_by(Shape.id)))
    vectors: dict[str, bytes] = {}
    signatures: dict[str, bytes] = {}
    failures: dict[str, Failure] = {}
    for shape in shapes:
        bench.progress.begin(claim, shape.id)
        try:
            vectors[shape.id] = vector_to_bytes(describe_shape(bench, shape, model))
            signature = _signature(bench, shape, model)
            if signature is not None:
                signatures[shape.id] = signature
        except ProteusError as error:
            failures[shape.id] = Failure(item=shape.path, type=error.kind, detail=str(error))
    marked = ids if claim.payload.get("marks_shapes", True) else []
    return Outcome(
        store=partial(_store, ids, name, vectors, signatures, {i: failures.get(i) for i in marked}),
        failures=[failures[i] for i in sorted(failures)],
    )


def _store(
    shape_ids: Sequence[str],
    model: str,
    vectors: Mapping[str, bytes],
    signatures: Mapping[str, bytes],
    marks: Mapping[str, Failure | None],
    session: Session,
    _job: Job,
) -> None:
    """Mark shapes with their failure, or with none, and store the descriptors."""
    still = select(Shape).where(Shape.id.in_(shape_ids)).order_by(Shape.id).with_for_update()
    there = {shape.id: shape for shape in session.scalars(still)}
    for shape_id in marks.keys() & there.keys():
        failure = marks[shape_id]
        there[shape_id].error = (
            None if failure is None else {"type": failure.type, "detail": failure.detail}
        )
    by_collection: dict[str, list[str]] = {}
    for shape_id in sorted(vectors.keys() & there.keys()):
        by_collection.setdefault(there[shape_id].collection_id, []).append(shape_id)
    for collection_id, described in sorted(by_collection.items()):
        rows = [(shape_id, model, vectors[shape_id]) for shape_id in described]
        taken = [(i, model, signatures[i]) for i in described if i in signatures]
        store_descriptors(session, collection_id, rows, taken)


def _signature(bench: Workbench, shape: Shape, model: Model) -> bytes | None:
    """Windows of a stored shape, where the model compares them and the mesh is still there."""
    if model.windows is None:
        return None
    try:
        mesh = load_cleaned(bench.blobs, shape.sha256)
    except BlobNotFoundError:
        return None
    return take_signature(Solver(mesh), mesh, model.windows)
