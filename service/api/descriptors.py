"""What the search compares: the channels of a shape's descriptor."""

from fastapi import APIRouter

from service.dependencies import FilterText, ServicesDep, ShapePath
from service.openapi import problems
from service.schemas.shapes import DistributionAnswer, answer_axis
from service.search.ranking import shape_vector
from service.security import READS
from service.subjects import subject_of_shape
from workers.errors import InvalidRequestError
from workers.retrieval.channels import Channel
from workers.retrieval.model import Model
from workers.storage.trained_models import load_model

router = APIRouter(prefix="/v1/shapes/{shape_id}", tags=["shapes"])


@router.get(
    "/distribution",
    summary="Show one channel of the descriptor",
    dependencies=[READS],
    responses=problems(404, 409, 422),
)
def distribution(
    shape_id: ShapePath,
    services: ServicesDep,
    model: FilterText = None,
    channel: FilterText = None,
) -> DistributionAnswer:
    """Show what the search compares: by default the first channel of the collection's model."""
    with services.database.read() as session:
        subject = subject_of_shape(session, shape_id)
        chosen = load_model(session, subject.model if model is None else model)
        vector = shape_vector(session, shape_id, chosen.name)
    described = _channel(chosen, channel)
    return DistributionAnswer(
        shape_id=shape_id,
        model=chosen.name,
        channel=described.name,
        feature=described.feature,
        normalisation=described.normalisation,
        axis=answer_axis(described),
        values=vector[chosen.slices[described.name]].tolist(),
    )


def _channel(model: Model, name: str | None) -> Channel:
    for channel in model.channels:
        if name in {None, channel.name}:
            return channel
    known = ", ".join(channel.name for channel in model.channels)
    raise InvalidRequestError(f"model {model.name!r} has no channel {name!r}; it has {known}")
