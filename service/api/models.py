"""Models: list, show, make, train and delete them."""

from fastapi import APIRouter, Response
from fastapi.concurrency import run_in_threadpool

from service.api.answers import describe_job
from service.dependencies import ModelPath, PageDep, Services, ServicesDep, Wait
from service.openapi import job_answers, problems
from service.schemas.jobs import answer_job
from service.schemas.models import ModelAnswer, answer_model
from service.schemas.pages import PageAnswer, answer_page
from service.schemas.training import Learned, ModelAccepted, NewBank, NewModel, Untrained
from service.security import ADMINISTERS, READS, WRITES
from service.waiting import hold_on
from workers.geometry.views import View, named_view
from workers.pipeline.solve import parse_upload
from workers.pipeline.training.training_plan import (
    add_untrained,
    choose_pairs,
    choose_variants,
    plan_training,
)
from workers.retrieval.untrained import untrained_model
from workers.storage.models import Job
from workers.storage.trained_models import (
    ModelView,
    delete_model,
    get_model,
    page_of_models,
    require_free_name,
)
from workers.training.examples import Pair, Variant
from workers.training.sources import StoredSource

router = APIRouter(prefix="/v1/models", tags=["models"])


@router.get("", summary="List models", dependencies=[READS], responses=problems(422))
def list_all(page: PageDep, services: ServicesDep) -> PageAnswer[ModelAnswer]:
    """List models by name, the built-in ones among them."""
    with services.database.read() as session:
        found = page_of_models(session, limit=page.limit, cursor=page.cursor)
    return answer_page(found, answer_model)


@router.post(
    "",
    status_code=202,
    summary="Make a model",
    dependencies=[WRITES],
    response_model=ModelAccepted,
    responses=job_answers(ended=201, accepted=ModelAccepted, result=ModelAccepted)
    | problems(404, 409, 413, 415, 422),
)
async def create(
    body: NewModel, services: ServicesDep, response: Response, wait: Wait = 0
) -> ModelAccepted:
    """Make a model that is ready at once, or learn a kernel or a bank of channels.

    The methods `spline`, `grid` and `heat-time` learn a kernel from pairs of shapes: a shape, and a
    transformation of it. The spectra of both are computed. The kernel is the one that changes least
    under the transformations, compared with how far it tells shapes apart.

    The method `bank` learns from shapes and their transformed copies. Each is described under many
    candidate channels. Those are chosen and weighted under which a copy finds its own shape first.
    It needs neither labels nor correspondences.

    The job's errors name what fails; the rest goes on. The same request gives the same model, bit
    for bit. What was computed before is not computed again.
    """
    job = await run_in_threadpool(_make, services, body)
    job = await hold_on(services.database, job.id, wait)
    describe_job(response, job, ended=201)
    view = await run_in_threadpool(_read, services, body.root.name)
    return ModelAccepted(model=answer_model(view), job=answer_job(job))


@router.get("/{name}", summary="Show a model", dependencies=[READS], responses=problems(404, 422))
def show(name: ModelPath, services: ServicesDep) -> ModelAnswer:
    """Show a model: its channels, its kernels' curves, the report of its training."""
    with services.database.read() as session:
        return answer_model(get_model(session, name))


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


def _make(services: Services, body: NewModel) -> Job:
    """Check and plan, rows, commit, dispatch."""
    wanted = body.root
    parameters = wanted.parameters.model_dump()
    if isinstance(wanted, Untrained):
        view = _view(services, wanted.parameters.view)
        model = untrained_model(wanted.name, wanted.method, parameters, view=view)
        with services.database.begin() as session:
            return add_untrained(session, model)
    pairs = [] if isinstance(wanted, NewBank) else _pairs(services, wanted)
    variants = _variants(services, wanted) if isinstance(wanted, NewBank) else []
    with services.database.begin() as session:
        job, parts = plan_training(
            session,
            name=wanted.name,
            method=wanted.method,
            parameters=parameters,
            training=wanted.training.to_request().to_json(),
            pairs=pairs,
            variants=variants,
        )
    services.dispatcher.send(parts)
    return job


def _view(services: Services, name: str) -> View:
    return named_view(name, working_vertices=services.settings.working_vertices)


def _pairs(services: Services, wanted: Learned) -> list[Pair]:
    """Plan what a kernel is learned from, while others may write."""

    def count_vertices(source: StoredSource) -> int:
        name = source.name
        parsed = parse_upload(
            services.blobs, source.sha256, filename=name, settings=services.settings
        )
        return parsed.mesh.n_vertices

    with services.database.read() as session:
        require_free_name(session, wanted.name)
        return choose_pairs(
            session,
            wanted.training.to_request(),
            view=_view(services, wanted.parameters.view),
            criterion=wanted.parameters.criterion,
            working_vertices=services.settings.working_vertices,
            count_vertices=count_vertices,
        )


def _variants(services: Services, wanted: NewBank) -> list[Variant]:
    """Plan what a bank is learned from, while others may write."""
    with services.database.read() as session:
        require_free_name(session, wanted.name)
        return choose_variants(
            session,
            wanted.training.to_request(),
            views=[_view(services, name) for name in wanted.parameters.views],
            working_vertices=services.settings.working_vertices,
        )


def _read(services: Services, name: str) -> ModelView:
    with services.database.read() as session:
        return get_model(session, name)
