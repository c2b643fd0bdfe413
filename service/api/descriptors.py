"""What the search compares: channels of a shape's descriptor, and of two shapes."""

from typing import Annotated

from fastapi import APIRouter, Query

from service.dependencies import FilterText, ServicesDep, ShapePath
from service.openapi import problems
from service.schemas.comparisons import ComparedWith, ComparisonAnswer, answer_comparison
from service.schemas.shapes import DistributionAnswer, answer_axis
from service.security import READS
from workers.errors import InvalidRequestError
from workers.retrieval.comparison import compare
from workers.retrieval.model import Entry, Model
from workers.storage.queries import get_query
from workers.storage.stored_meshes import mesh_of_shape
from workers.storage.trained_models import load_model
from workers.storage.vectors import query_vector, shape_vector

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
        own = mesh_of_shape(session, shape_id).model
        chosen = load_model(session, own if model is None else model)
        vector = shape_vector(session, shape_id, chosen.name)
    described = _channel(chosen, channel)
    return DistributionAnswer(
        shape_id=shape_id,
        model=chosen.name,
        channel=described.name,
        feature=described.feature,
        normalisation=described.normalisation,
        axis=answer_axis(described.axis),
        values=vector[chosen.slices[described.name]].tolist(),
    )


@router.get(
    "/comparison",
    summary="Show why the shape matches",
    dependencies=[READS],
    responses=problems(404, 409, 422),
)
def comparison(
    shape_id: ShapePath,
    services: ServicesDep,
    other: Annotated[
        FilterText, Query(alias="shape_id", description="the query, where it is a stored shape")
    ] = None,
    query_id: Annotated[
        FilterText,
        Query(description="the query, where it is a stored query; give exactly one of both"),
    ] = None,
    model: Annotated[
        FilterText, Query(description="the query's own, or else the collection's, if left out")
    ] = None,
    dissimilarity: Annotated[
        FilterText,
        Query(description="as in the query; if left out, that of the query under its model"),
    ] = None,
) -> ComparisonAnswer:
    """Take the distance of a match apart: what each channel compared, and what it adds.

    The distance is the one in the answer of a query; under a model that compares windows it is the
    one of the descriptors, before windows count. A model with points compares them on the first
    hundred shapes of an answer only, and counts them as not found on all others. Here they are
    always compared. Under another dissimilarity than the model's own they do not count.
    """
    if (other is None) == (query_id is None):
        raise InvalidRequestError("give exactly one of shape_id and query_id")
    with services.database.read() as session:
        stored = mesh_of_shape(session, shape_id)
        query = None if query_id is None else get_query(session, query_id)
        own = stored.model if query is None else query.model
        chosen = load_model(session, own if model is None else model)
        if dissimilarity is None and query is not None and chosen.name == query.model:
            dissimilarity = query.parameters.get("dissimilarity")
        if dissimilarity is not None:
            chosen.check_dissimilarity(dissimilarity)
        match = shape_vector(session, shape_id, chosen.name)
        if query is None:
            vector = shape_vector(session, other or "", chosen.name)
        else:
            vector = query_vector(session, query, chosen.name)
    return answer_comparison(
        compare(vector, match, chosen, dissimilarity=dissimilarity),
        chosen,
        shape_id=shape_id,
        asked_with=ComparedWith(shape_id=other, query_id=query_id),
    )


def _channel(model: Model, name: str | None) -> Entry:
    for entry in model.entries:
        if name in {None, entry.name}:
            return entry
    known = ", ".join(entry.name for entry in model.entries)
    raise InvalidRequestError(f"model {model.name!r} has no channel {name!r}; it has {known}")
