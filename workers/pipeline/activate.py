"""A collection moves to another model, in one step."""

from functools import partial

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import ModelNotReadyError
from workers.pipeline.outcome import Outcome
from workers.pipeline.part_kinds import activate_part, describe_parts
from workers.pipeline.workbench import Workbench
from workers.storage.descriptors import is_described, undescribed_shapes
from workers.storage.models import Collection, Job, Shape
from workers.storage.parts import Claim


def activate(_bench: Workbench, claim: Claim) -> Outcome:
    """Point a collection at a model under which all of its shapes are described.

    Shapes that arrived meanwhile are described first, and this runs again. Shapes that cannot be
    described under the model have failed; if none can, the collection stays where it is.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the collection and the model.

    Returns
    -------
    Outcome
        Moves the collection, or has the missing shapes described. It raises ModelNotReadyError if
        shapes were not described, or none could be.
    """
    return Outcome(store=partial(_move, claim.payload["collection_id"], claim.payload["model"]))


def _move(collection_id: str, model: str, session: Session, job: Job) -> Outcome | None:
    """Move a collection, or describe what is missing first; its row is locked."""
    collection = session.get(Collection, collection_id, with_for_update=True)
    if collection is None:
        return None
    missing = undescribed_shapes(session, collection, model, with_failed=False)
    if missing and job.failed:
        raise ModelNotReadyError(
            f"{len(missing)} shapes could not be described under {model!r}, "
            f"so the collection stays under its model; {_first_reason(job)}"
        )
    if missing:
        return Outcome(
            follow_up=describe_parts(missing, model), finale=activate_part(collection_id, model)
        )
    if not _finds_anything(session, collection, model):
        raise ModelNotReadyError(
            f"none of the shapes could be described under {model!r}, so the collection "
            f"stays under its model; {_first_reason(job)}"
        )
    collection.model = model
    return None


def _finds_anything(session: Session, collection: Collection, model: str) -> bool:
    """Whether the move leaves shapes to be found, if there are any."""
    of_collection = select(Shape.id).where(Shape.collection_id == collection.id).limit(1)
    found = session.scalar(of_collection.where(is_described(collection.model)))
    return found is None or session.scalar(of_collection.where(is_described(model))) is not None


def _first_reason(job: Job) -> str:
    """Why the first shape failed, and what can be done."""
    if not job.errors:
        return "retry the job"
    first = job.errors[0]
    return f"the first, {first['item']}: {first['detail']}"
