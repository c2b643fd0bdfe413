"""A collection moves to another model, in one step."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import ModelNotReadyError
from workers.pipeline.plans import activate_part, describe_parts
from workers.pipeline.workbench import Workbench
from workers.storage.descriptors import is_described, undescribed_shapes
from workers.storage.jobs import part_to_json
from workers.storage.models import Collection, Job, Shape
from workers.storage.parts import Claim, finish_part, hold_lease


def activate(bench: Workbench, claim: Claim) -> None:
    """Point a collection at a model under which all of its shapes are described.

    Shapes that arrived meanwhile without it are described first, and this runs again. Those that
    cannot be described under it have failed, unless that is all of them.

    Raises
    ------
    ModelNotReadyError
        Some shapes were not described, or none; the collection stays where it is.
    """
    collection_id, name = claim.payload["collection_id"], claim.payload["model"]
    with bench.database.begin() as session:
        job = hold_lease(session, claim)
        collection = session.get(Collection, collection_id, with_for_update=True)
        missing = []
        if collection is not None:
            missing = undescribed_shapes(session, collection, name, with_failed=False)
            if not missing and not _finds_anything(session, collection, name):
                raise ModelNotReadyError(
                    f"none of the shapes could be described under {name!r}, so the collection "
                    f"stays under its model; {_first_reason(job)}"
                )
        if missing and job.failed:
            raise ModelNotReadyError(
                f"{len(missing)} shapes could not be described under {name!r}, "
                f"so the collection stays under its model; {_first_reason(job)}"
            )
        if missing:
            job.finale = part_to_json(activate_part(collection_id, name))
        elif collection is not None:
            collection.model = name
        parts = finish_part(session, claim, follow_up=describe_parts(missing, name))
    bench.send(parts)


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
