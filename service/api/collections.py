"""Collections, and the model that each is searched under."""

from fastapi import APIRouter, Response
from fastapi.concurrency import run_in_threadpool
from sqlalchemy import update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from service.api.answers import describe_job
from service.dependencies import CollectionPath, PageDep, Services, ServicesDep, Wait
from service.openapi import job_answers, problems
from service.schemas.collections import (
    CollectionAnswer,
    CollectionChange,
    ModelChoice,
    NewCollection,
    answer_collection,
)
from service.schemas.jobs import JobAccepted, answer_job
from service.schemas.pages import PageAnswer, answer_page
from service.security import ADMINISTERS, READS, WRITES
from service.waiting import hold_on
from workers.errors import NameTakenError
from workers.pipeline.activation_plan import plan_activation
from workers.storage.collections import (
    count_shapes,
    create_collection,
    delete_collection,
    get_collection,
    page_of_collections,
)
from workers.storage.evaluations import rename_in_evaluations
from workers.storage.models import Collection, Job

router = APIRouter(prefix="/v1/collections", tags=["collections"])


@router.post(
    "",
    status_code=201,
    summary="Make a collection",
    dependencies=[WRITES],
    responses=problems(404, 409, 413, 415, 422),
)
def create(body: NewCollection, services: ServicesDep, response: Response) -> CollectionAnswer:
    """Make an empty collection, searched under the model named or the service's default."""
    with services.database.begin() as session:
        row = create_collection(
            session,
            name=body.name,
            description=body.description or "",
            model=body.model or services.settings.default_model,
        )
        session.flush()
        answer = _answer(session, row)
    response.headers["Location"] = f"/v1/collections/{answer.name}"
    return answer


@router.get("", summary="List collections", dependencies=[READS], responses=problems(422))
def list_all(page: PageDep, services: ServicesDep) -> PageAnswer[CollectionAnswer]:
    """List collections by name."""
    with services.database.read() as session:
        found = page_of_collections(session, limit=page.limit, cursor=page.cursor)
        counts = count_shapes(session, found.items)
    return answer_page(found, lambda row: answer_collection(row, counts[row.id]))


@router.get(
    "/{collection}",
    summary="Show a collection",
    dependencies=[READS],
    responses=problems(404, 422),
)
def show(collection: CollectionPath, services: ServicesDep) -> CollectionAnswer:
    """Show a collection and how many of its shapes can be found."""
    with services.database.read() as session:
        return _answer(session, get_collection(session, collection))


@router.patch(
    "/{collection}",
    summary="Rename or describe a collection",
    dependencies=[WRITES],
    responses=problems(404, 409, 413, 415, 422),
)
def change(
    collection: CollectionPath, body: CollectionChange, services: ServicesDep
) -> CollectionAnswer:
    """Change what is named in the body; the model is moved by `PUT …/model`."""
    given = body.model_fields_set
    with services.database.begin() as session:
        if "name" in given:  # jobs before collections: locks are taken in one order
            renamed = update(Job).where(Job.collection == collection)
            session.execute(renamed.values(collection=body.name))
            rename_in_evaluations(session, collection, body.name)
        row = get_collection(session, collection, lock=True)
        if "description" in given:
            row.description = body.description or ""
        if "name" in given:
            _rename(session, row, body.name)
        return _answer(session, row)


@router.delete(
    "/{collection}",
    status_code=204,
    response_class=Response,
    summary="Delete a collection with its shapes",
    dependencies=[ADMINISTERS],
    responses=problems(404, 422),
)
def delete(collection: CollectionPath, services: ServicesDep) -> None:
    """Delete a collection, its shapes and their descriptors; parts that wait are not computed."""
    with services.database.begin() as session:
        collection_id = get_collection(session, collection).id
        delete_collection(session, collection)
    services.indexes.forget_collection(collection_id)


@router.put(
    "/{collection}/model",
    status_code=202,
    summary="Move a collection to a model",
    dependencies=[WRITES],
    response_model=JobAccepted,
    responses=job_answers(accepted=JobAccepted, result=JobAccepted)
    | problems(404, 409, 413, 415, 422),
)
async def move(
    collection: CollectionPath,
    body: ModelChoice,
    services: ServicesDep,
    response: Response,
    wait: Wait = 0,
) -> JobAccepted:
    """Describe every shape under the model from its stored spectra, then move in one step.

    Searches go on under the old model until then. Uploads that arrive meanwhile are described
    under both.
    """
    job = await run_in_threadpool(_plan_move, services, collection, body.model)
    job = await hold_on(services.database, job.id, wait)
    describe_job(response, job)
    return JobAccepted(job=answer_job(job))


def _plan_move(services: Services, collection: str, model: str) -> Job:
    with services.database.begin() as session:
        job, parts = plan_activation(session, collection, model)
    services.dispatcher.send(parts)
    return job


def _rename(session: Session, row: Collection, name: str) -> None:
    row.name = name
    try:
        session.flush()
    except IntegrityError:
        raise NameTakenError(f"a collection named {name!r} exists already") from None


def _answer(session: Session, row: Collection) -> CollectionAnswer:
    return answer_collection(row, count_shapes(session, [row])[row.id])
