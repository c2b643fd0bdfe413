"""Maintenance: what is kept for some time only, and freeing it."""

import time

from fastapi import APIRouter, Response
from fastapi.concurrency import run_in_threadpool

from service.api.answers import describe_job
from service.dependencies import Services, ServicesDep, Wait
from service.openapi import job_answers, problems
from service.schemas.jobs import JobAccepted, answer_job
from service.schemas.maintenance import FreeableAnswer, answer_freeable
from service.security import ADMINISTERS
from service.waiting import hold_on
from workers.pipeline.prune import plan_pruning
from workers.storage.models import Job
from workers.storage.pruning import KINDS, Store, measure

router = APIRouter(prefix="/v1/prune", tags=["service"])


@router.get(
    "",
    summary="Show what can be freed",
    dependencies=[ADMINISTERS],
    responses=problems(),
)
def show(services: ServicesDep) -> FreeableAnswer:
    """Count what is older than it has to be kept, by kind; nothing is changed.

    All stored files are listed for it: with a million shapes that takes minutes. A run may
    free more than this, since what only old rows needed goes with them.
    """
    store = Store(services.database, services.blobs, services.settings, time.time())
    return answer_freeable({name: measure(store, name) for name in KINDS}, services.settings)


@router.post(
    "",
    status_code=202,
    summary="Free what is no longer needed",
    dependencies=[ADMINISTERS],
    response_model=JobAccepted,
    responses=job_answers(accepted=JobAccepted, result=JobAccepted) | problems(422),
)
async def prune(services: ServicesDep, response: Response, wait: Wait = 0) -> JobAccepted:
    """Free what is older than it has to be kept, while all else goes on.

    The job's `result` says what was freed. If such a job is running, the answer names that one.
    """
    job = await run_in_threadpool(_plan, services)
    job = await hold_on(services.database, job.id, wait)
    describe_job(response, job)
    return JobAccepted(job=answer_job(job))


def _plan(services: Services) -> Job:
    with services.database.begin() as session:
        job, parts = plan_pruning(session, now=time.time())
    services.dispatcher.send(parts)
    return job
