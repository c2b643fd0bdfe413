"""Evaluations: models measured on a labelled collection."""

from fastapi import APIRouter, Response
from fastapi.concurrency import run_in_threadpool

from service.api.answers import describe_job
from service.dependencies import EvaluationPath, FilterText, PageDep, Services, ServicesDep, Wait
from service.openapi import job_answers, problems
from service.schemas.evaluations import (
    EvaluationAccepted,
    EvaluationAnswer,
    NewEvaluation,
    answer_evaluation,
)
from service.schemas.jobs import answer_job
from service.schemas.pages import PageAnswer, answer_page
from service.security import READS, WRITES
from service.waiting import hold_on
from workers.pipeline.evaluation_plan import (
    EvaluationRequest,
    frame_to_evaluate,
    plan_evaluation,
    store_frame,
)
from workers.storage.evaluations import EvaluationView, get_evaluation, page_of_evaluations
from workers.storage.identifiers import new_id

router = APIRouter(prefix="/v1/evaluations", tags=["evaluations"])


@router.post(
    "",
    status_code=202,
    summary="Measure models on a collection",
    dependencies=[WRITES],
    response_model=EvaluationAccepted,
    responses=job_answers(ended=201, accepted=EvaluationAccepted, result=EvaluationAccepted)
    | problems(404, 409, 413, 415, 422),
)
async def create(
    body: NewEvaluation, services: ServicesDep, response: Response, wait: Wait = 0
) -> EvaluationAccepted:
    """Rank the other shapes for every transformed shape, under each model.

    Queries are the shapes whose `transformation` is set and not `null`; targets are all others. If
    no shape is transformed, each labelled shape is a query against the rest. A target is relevant
    if it has the query's label. The evaluation takes the shapes as they are now. Those that are not
    described under a model yet are described; the collection is searched as before.
    """
    request = EvaluationRequest(body.collection, tuple(body.models), body.dissimilarity)
    evaluation_id, job_id = await run_in_threadpool(_plan, services, request)
    job = await hold_on(services.database, job_id, wait)
    describe_job(response, job, ended=201)
    view = await run_in_threadpool(_read, services, evaluation_id)
    evaluation = answer_evaluation(view, with_ranks=True)
    return EvaluationAccepted(evaluation=evaluation, job=answer_job(job))


@router.get("", summary="List evaluations", dependencies=[READS], responses=problems(422))
def list_all(
    page: PageDep, services: ServicesDep, collection: FilterText = None
) -> PageAnswer[EvaluationAnswer]:
    """List evaluations, the newest first; their `ranks` are left out."""
    with services.database.read() as session:
        found = page_of_evaluations(
            session, limit=page.limit, cursor=page.cursor, collection=collection
        )
    return answer_page(found, lambda view: answer_evaluation(view, with_ranks=False))


@router.get(
    "/{evaluation_id}",
    summary="Show an evaluation",
    dependencies=[READS],
    responses=problems(404, 422),
)
def show(evaluation_id: EvaluationPath, services: ServicesDep) -> EvaluationAnswer:
    """Show an evaluation: its tables, how sure they are, and what each query found."""
    return answer_evaluation(_read(services, evaluation_id), with_ranks=True)


def _plan(services: Services, request: EvaluationRequest) -> tuple[str, str]:
    """Check, blob, rows, commit, dispatch."""
    evaluation_id = new_id()
    with services.database.read() as session:
        frame = frame_to_evaluate(session, request)
    digest = store_frame(services.blobs, evaluation_id, frame)
    with services.database.begin() as session:
        _, job, parts = plan_evaluation(session, request, evaluation_id=evaluation_id, frame=digest)
    services.dispatcher.send(parts)
    return evaluation_id, job.id


def _read(services: Services, evaluation_id: str) -> EvaluationView:
    with services.database.read() as session:
        return get_evaluation(session, evaluation_id)
