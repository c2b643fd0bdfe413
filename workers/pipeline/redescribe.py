"""Shapes are described under a further model, from their stored spectra."""

from sqlalchemy import select

from workers.errors import BlobNotFoundError, ProteusError
from workers.geometry.arrays import Float32Array
from workers.pipeline.solve import describe_mesh, read_mesh
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model, describe
from workers.storage.arrays import vector_to_bytes
from workers.storage.descriptors import store_descriptors
from workers.storage.models import Shape
from workers.storage.parts import Claim, Failure, finish_part, hold_lease, report_failures
from workers.storage.solutions import load_solution
from workers.storage.trained_models import load_model


def redescribe(bench: Workbench, claim: Claim) -> None:
    """Describe some shapes under a model; one that fails is named, the rest goes on.

    A collection that does not follow the model asks not to mark shapes: what fails is no error of
    theirs, what succeeds heals none.
    """
    ids, name = claim.payload["shape_ids"], claim.payload["model"]
    marks_shapes = claim.payload.get("marks_shapes", True)
    with bench.database.read() as session:
        model = load_model(session, name)
        shapes = list(session.scalars(select(Shape).where(Shape.id.in_(ids)).order_by(Shape.id)))
    vectors: dict[str, Float32Array] = {}
    failures: dict[str, Failure] = {}
    for shape in shapes:
        try:
            vectors[shape.id] = _describe_shape(bench, shape, model)
        except ProteusError as error:
            failures[shape.id] = Failure(item=shape.name, type=error.kind, detail=str(error))
    with bench.database.begin() as session:
        hold_lease(session, claim)
        still = select(Shape).where(Shape.id.in_(ids)).order_by(Shape.id).with_for_update()
        there = {shape.id: shape for shape in session.scalars(still)}
        for shape_id in there if marks_shapes else ():
            failed = failures.get(shape_id)
            there[shape_id].error = (
                None if failed is None else {"type": failed.type, "detail": failed.detail}
            )
        report_failures(session, claim, [failures[i] for i in sorted(failures)], are_counted=True)
        parts = finish_part(session, claim)
        by_collection: dict[str, list[tuple[str, str, bytes]]] = {}
        for shape_id in sorted(vectors.keys() & there.keys()):
            row = (shape_id, name, vector_to_bytes(vectors[shape_id]))
            by_collection.setdefault(there[shape_id].collection_id, []).append(row)
        for collection_id, rows in sorted(by_collection.items()):
            store_descriptors(session, collection_id, rows)
    bench.send(parts)


def _describe_shape(bench: Workbench, shape: Shape, model: Model) -> Float32Array:
    """Describe a shape from its stored spectra, solving only under a view that is new."""
    try:
        solutions = {v.name: load_solution(bench.blobs, shape.sha256, v) for v in model.views}
    except BlobNotFoundError:
        read = read_mesh(bench.blobs, shape.sha256, filename=shape.name, settings=bench.settings)
        return describe_mesh(bench.blobs, shape.sha256, read.mesh, [model])[model.name]
    return describe(solutions, model)
