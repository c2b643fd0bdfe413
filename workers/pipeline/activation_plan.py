"""The job that describes a collection under another model, and then moves it there."""

from sqlalchemy.orm import Session

from workers.pipeline.part_kinds import activate_part, describe_parts
from workers.storage.collections import add_model, get_collection
from workers.storage.descriptors import undescribed_shapes
from workers.storage.jobs import create_job
from workers.storage.models import Job, Part
from workers.storage.trained_models import load_model


def plan_activation(session: Session, collection: str, model: str) -> tuple[Job, list[Part]]:
    """Make the job that describes a collection under a model and then moves it there.

    From the commit on, uploads are described under both. Shapes that the model compares by windows
    and that have none, since they were stored before, are described anew.

    Parameters
    ----------
    session : Session
        An open transaction.
    collection, model : str
        Their names.

    Returns
    -------
    (Job, list of Part)
        The parts are to be sent after the commit.

    Raises
    ------
    CollectionNotFoundError, ModelNotFoundError, ModelNotReadyError
        The collection or model does not exist, or the model is not trained yet.
    """
    row = get_collection(session, collection, lock=True)
    compares_windows = load_model(session, model).windows is not None
    add_model(session, row.id, model)
    session.flush()
    undescribed = undescribed_shapes(
        session, row, model, with_failed=True, with_unsigned=compares_windows
    )
    return create_job(
        session,
        kind="describe",
        unit="shapes",
        parts=describe_parts(undescribed, model),
        collection=row.name,
        model=model,
        finale=activate_part(row.id, model),
    )
