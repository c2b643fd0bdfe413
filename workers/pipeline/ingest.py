"""An uploaded shape becomes one that can be found."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import ProteusError
from workers.geometry.topology import boundary_loops, count_surface_components
from workers.pipeline.outcome import GoOn, Outcome
from workers.pipeline.progress import READING
from workers.pipeline.solve import Described, ReadMesh, describe_under_each, read_mesh
from workers.pipeline.workbench import Workbench
from workers.rendering.render import encode_png, render
from workers.retrieval.model import Model
from workers.storage.arrays import vector_to_bytes
from workers.storage.blobs import thumbnail_key
from workers.storage.collections import models_of
from workers.storage.descriptors import store_descriptors
from workers.storage.models import Collection, Job, Json, Shape
from workers.storage.parts import Claim
from workers.storage.solutions import store_cleaned
from workers.storage.trained_models import load_model


@dataclass(frozen=True)
class Facts:
    """What is said of a shape in its row."""

    format: str
    n_vertices: int
    n_faces: int
    area: float
    n_components: int
    n_boundary_loops: int
    repairs: list[str]
    found: list[str]


def ingest(bench: Workbench, claim: Claim) -> Outcome:
    """Compute a shape and describe it under every model that its collection needs.

    Only the model that the collection is searched under decides whether the shape has failed.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        A part of this shape.

    Returns
    -------
    Outcome
        Stores the facts and the descriptors, or goes on if the collection needs another model by
        then. It raises the reason if the shape cannot be described under the collection's model.

    Raises
    ------
    ProteusError
        The mesh cannot be used; the shape fails with this reason.
    """
    with bench.database.read() as session:
        shape = session.get(Shape, claim.shape_id)
        models = [] if shape is None else _models(session, shape.collection_id)
    if shape is None or not models:  # it was deleted while it waited
        return Outcome()
    bench.progress.enter(READING)
    read = read_mesh(bench.blobs, shape.sha256, filename=shape.name, settings=bench.settings)
    store_cleaned(bench.blobs, shape.sha256, read.mesh)
    bench.blobs.put(thumbnail_key(shape.sha256), encode_png(render(read.mesh, up=read.up)))
    facts = _facts(read)

    def describe_further(before: Described, models: Sequence[Model]) -> Outcome:
        more = describe_under_each(
            bench.blobs, shape.sha256, read.mesh, models, enter=bench.progress.enter
        )
        bench.progress.end()
        found = Described(
            {**before.vectors, **more.vectors},
            {**before.errors, **more.errors},
            (*before.notes, *more.notes),
            {**before.signatures, **more.signatures},
        )
        return Outcome(store=partial(_store, shape.id, facts, found, describe_further))

    return describe_further(Described({}, {}), models)


def _facts(read: ReadMesh) -> Facts:
    return Facts(
        format=read.format,
        n_vertices=read.mesh.n_vertices,
        n_faces=read.mesh.n_faces,
        area=read.mesh.area,
        n_components=count_surface_components(read.mesh),
        n_boundary_loops=len(boundary_loops(read.mesh)),
        repairs=list(read.repairs),
        found=list(read.found),
    )


def _models(session: Session, collection_id: str) -> list[Model]:
    return [load_model(session, name) for name in sorted(models_of(session, collection_id))]


def _store(
    shape_id: str,
    facts: Facts,
    found: Described,
    describe_further: Callable[[Described, Sequence[Model]], Outcome],
    session: Session,
    _job: Job,
) -> GoOn | None:
    """Store a shape; or go on under models that it was not described under yet.

    The collection's row is share-locked. An activation therefore sees this shape with its
    descriptors, or else this sees the model that is being activated.
    """
    of_shape = select(Shape.collection_id).where(Shape.id == shape_id)
    collection = select(Collection).where(Collection.id.in_(of_shape))
    row = session.scalar(collection.with_for_update(read=True))
    shape = session.get(Shape, shape_id, with_for_update=True)
    if row is None or shape is None:
        return None
    if row.model in found.errors:
        raise found.errors[row.model]
    needed = models_of(session, shape.collection_id)
    if missing := needed - found.vectors.keys() - found.errors.keys():
        models = [load_model(session, name) for name in sorted(missing)]
        return GoOn(partial(describe_further, found, models))
    for name, value in vars(facts).items():
        setattr(shape, name, value)
    shape.repairs = [*facts.repairs, *dict.fromkeys(found.notes)]
    shape.error = _reason([found.errors[name] for name in sorted(needed & found.errors.keys())])
    described = sorted(needed & found.vectors.keys())
    rows = [(shape.id, name, vector_to_bytes(found.vectors[name])) for name in described]
    signatures = [(shape.id, n, found.signatures[n]) for n in described if n in found.signatures]
    store_descriptors(session, shape.collection_id, rows, signatures)
    return None


def _reason(errors: Sequence[ProteusError]) -> Json | None:
    """Why a shape that is found could not be described under a further model."""
    return {"type": errors[0].kind, "detail": str(errors[0])} if errors else None
