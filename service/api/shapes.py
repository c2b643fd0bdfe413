"""Shapes: listing, showing, changing and deleting them."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from service.dependencies import CollectionPath, FilterText, PageDep, ServicesDep, ShapePath
from service.openapi import problems
from service.schemas.pages import PageAnswer, answer_page
from service.schemas.shapes import ShapeAnswer, ShapeChange, ShapeState, answer_shape
from service.schemas.text import Text
from service.security import READS, WRITES
from workers.storage.collections import get_collection
from workers.storage.shapes import delete_shape, get_shape, page_of_shapes

router = APIRouter(prefix="/v1", tags=["shapes"])


@router.get(
    "/collections/{collection}/shapes",
    summary="List shapes",
    dependencies=[READS],
    responses=problems(404, 422),
)
def list_all(
    collection: CollectionPath,
    page: PageDep,
    services: ServicesDep,
    label: FilterText = None,
    transformation: FilterText = None,
    name: FilterText = None,
    path: Annotated[
        Text | None,
        Query(max_length=1024, description="the path of a shape, or a folder: all that is below"),
    ] = None,
    state: Annotated[ShapeState | None, Query()] = None,
) -> PageAnswer[ShapeAnswer]:
    """List the shapes of a collection in the order they came."""
    with services.database.read() as session:
        found = page_of_shapes(
            session,
            get_collection(session, collection).id,
            limit=page.limit,
            cursor=page.cursor,
            state=state,
            path=path,
            label=label,
            transformation=transformation,
            name=name,
        )
    return answer_page(found, answer_shape)


@router.get(
    "/shapes/{shape_id}",
    summary="Show a shape",
    dependencies=[READS],
    responses=problems(404, 422),
)
def show(shape_id: ShapePath, services: ServicesDep) -> ShapeAnswer:
    """Show a shape and what was found out about it."""
    with services.database.read() as session:
        return answer_shape(get_shape(session, shape_id))


@router.patch(
    "/shapes/{shape_id}",
    summary="Relabel or rename a shape",
    dependencies=[WRITES],
    responses=problems(404, 413, 415, 422),
)
def change(shape_id: ShapePath, body: ShapeChange, services: ServicesDep) -> ShapeAnswer:
    """Change what is named in the body; nothing is computed again."""
    given = body.model_fields_set
    with services.database.begin() as session:
        view = get_shape(session, shape_id)
        if "label" in given:
            view.row.label = body.label
        if "metadata" in given:
            view.row.attributes = body.metadata or {}
        if "name" in given:
            view.row.name = body.name
        return answer_shape(view)


@router.delete(
    "/shapes/{shape_id}",
    status_code=204,
    response_class=Response,
    summary="Delete a shape",
    dependencies=[WRITES],
    responses=problems(404, 422),
)
def delete(shape_id: ShapePath, services: ServicesDep) -> None:
    """Delete a shape; from the next query on it is not found any more."""
    with services.database.begin() as session:
        delete_shape(session, shape_id)
