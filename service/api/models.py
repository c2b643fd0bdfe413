"""Models."""

from fastapi import APIRouter, Response

from service.dependencies import ModelPath, PageDep, ServicesDep
from service.openapi import problems
from service.schemas.models import ModelAnswer, answer_model
from service.schemas.pages import PageAnswer, answer_page
from service.security import ADMINISTERS, READS
from workers.storage.trained_models import delete_model, get_model_row, page_of_models

router = APIRouter(prefix="/v1/models", tags=["models"])


@router.get("", summary="List models", dependencies=[READS], responses=problems(422))
def list_all(page: PageDep, services: ServicesDep) -> PageAnswer[ModelAnswer]:
    """List models by name, the built-in ones among them."""
    with services.database.read() as session:
        found = page_of_models(session, limit=page.limit, cursor=page.cursor)
    return answer_page(found, answer_model)


@router.get("/{name}", summary="Show a model", dependencies=[READS], responses=problems(404, 422))
def show(name: ModelPath, services: ServicesDep) -> ModelAnswer:
    """Show a model: its channels, its kernels' curves, the report of its training."""
    with services.database.read() as session:
        return answer_model(get_model_row(session, name))


@router.delete(
    "/{name}",
    status_code=204,
    response_class=Response,
    summary="Delete a model",
    dependencies=[ADMINISTERS],
    responses=problems(404, 409, 422),
)
def delete(name: ModelPath, services: ServicesDep) -> None:
    """Delete a trained model and the descriptors under it, unless a collection uses it."""
    with services.database.begin() as session:
        delete_model(session, name)
    services.indexes.forget_model(name)
