"""A collection moves to another model, in one step."""

from workers.errors import ModelNotReadyError
from workers.pipeline.plans import activate_part, describe_parts
from workers.pipeline.workbench import Workbench
from workers.storage.descriptors import undescribed_shapes
from workers.storage.jobs import part_to_json
from workers.storage.models import Collection
from workers.storage.parts import Claim, finish_part, hold_lease


def activate(bench: Workbench, claim: Claim) -> None:
    """Point a collection at a model under which all of its shapes are described.

    Shapes that arrived meanwhile without it are described first, and this runs again.

    Raises
    ------
    ModelNotReadyError
        Some shapes could not be described; the collection stays where it is.
    """
    collection_id, name = claim.payload["collection_id"], claim.payload["model"]
    with bench.database.begin() as session:
        job = hold_lease(session, claim)
        collection = session.get(Collection, collection_id, with_for_update=True)
        missing = []
        if collection is not None:
            missing = undescribed_shapes(session, collection, name, with_failed=False)
        if missing and job.failed:
            raise ModelNotReadyError(
                f"{len(missing)} shapes could not be described under {name!r}, "
                "so the collection stays under its model; retry the job"
            )
        if missing:
            job.finale = part_to_json(activate_part(collection_id, name))
        elif collection is not None:
            collection.model = name
        parts = finish_part(session, claim, follow_up=describe_parts(missing, name))
    bench.send(parts)
