"""Jobs: their progress, cancelling, retrying, and their changes as events."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.exceptions import HTTPException

from service.api.answers import RETRY_SECONDS, is_known, not_modified
from service.dependencies import FilterText, JobPath, PageDep, ServicesDep
from service.openapi import ETAG, RETRY_AFTER, problems
from service.schemas.jobs import JobAnswer, JobKind, JobState, answer_job
from service.schemas.pages import PageAnswer, answer_page
from service.security import READS, WRITES
from service.waiting import read_job
from workers.errors import JobNotFoundError
from workers.storage.jobs import ENDED, cancel_job, page_of_jobs, retry_job
from workers.storage.models import Job

FIRST_PAUSE_SECONDS = 0.1
LONGEST_PAUSE_SECONDS = 1.0
RECONNECT_MILLISECONDS = 2000
router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


@router.get("", summary="List jobs", dependencies=[READS], responses=problems(422))
def list_all(
    page: PageDep,
    services: ServicesDep,
    kind: Annotated[JobKind | None, Query()] = None,
    state: Annotated[JobState | None, Query()] = None,
    collection: FilterText = None,
) -> PageAnswer[JobAnswer]:
    """List jobs, the newest first."""
    with services.database.read() as session:
        found = page_of_jobs(
            session,
            limit=page.limit,
            cursor=page.cursor,
            kind=kind,
            state=state,
            collection=collection,
        )
    return answer_page(found, answer_job)


@router.get(
    "/{job_id}",
    summary="Show a job",
    dependencies=[READS],
    responses={
        200: {"headers": {"ETag": ETAG, "Retry-After": RETRY_AFTER}},
        304: {"description": "nothing has changed since the ETag"},
        **problems(404, 422),
    },
)
def show(job_id: JobPath, services: ServicesDep, request: Request, response: Response) -> JobAnswer:
    """Show a job; with If-None-Match, the answer is 304 while nothing has changed."""
    job = read_job(services.database, job_id)
    headers = {"ETag": _tag(job), "Cache-Control": "no-cache"}
    if job.state not in ENDED:
        headers["Retry-After"] = str(RETRY_SECONDS)
    if is_known(request, _tag(job)):
        unchanged = not_modified(_tag(job))
        unchanged.headers.update(headers)
        return unchanged  # type: ignore[return-value]
    response.headers.update(headers)
    return answer_job(job)


@router.post(
    "/{job_id}/cancel",
    summary="Cancel a job",
    dependencies=[WRITES],
    responses=problems(404, 409, 422),
)
def cancel(job_id: JobPath, services: ServicesDep) -> JobAnswer:
    """End a job. Parts that wait never start; parts that run store nothing; what is done stays."""
    with services.database.begin() as session:
        job = cancel_job(session, job_id)
    return answer_job(job)


@router.post(
    "/{job_id}/retry",
    summary="Try again what failed",
    dependencies=[WRITES],
    responses=problems(404, 409, 422),
)
def retry(job_id: JobPath, services: ServicesDep) -> JobAnswer:
    """Queue again what failed in an ended job, or was cancelled."""
    with services.database.begin() as session:
        job, parts = retry_job(session, job_id)
    services.dispatcher.send(parts)
    return answer_job(job)


def _watched(
    job_id: JobPath,
    services: ServicesDep,
    last_event_id: Annotated[str | None, Header()] = None,
) -> Job:
    """Job that is to be watched; 204 tells a browser that has seen its end not to come back."""
    job = read_job(services.database, job_id)
    if job.state in ENDED and last_event_id == str(job.revision):
        raise HTTPException(204)
    return job


@router.get(
    "/{job_id}/events",
    summary="Watch a job",
    dependencies=[READS],
    response_class=EventSourceResponse,
    responses={
        204: {"description": "the end of the job was the last event that was seen"},
        **problems(404, 422),
    },
)
async def events(
    services: ServicesDep, job: Annotated[Job, Depends(_watched)]
) -> AsyncIterator[ServerSentEvent]:
    """Send the job as an event `job` now and at every change, until it has ended.

    Each event's data is a Job, its id counts the changes. Comments keep the line open.
    """
    pause = FIRST_PAUSE_SECONDS
    seen = 0
    while True:
        if job.revision != seen:
            seen, pause = job.revision, FIRST_PAUSE_SECONDS
            yield ServerSentEvent(
                data=answer_job(job),
                event="job",
                id=str(seen),
                retry=RECONNECT_MILLISECONDS,
            )
        if job.state in ENDED:
            return
        await asyncio.sleep(pause)
        pause = min(1.5 * pause, LONGEST_PAUSE_SECONDS)
        try:
            job = await run_in_threadpool(read_job, services.database, job.id)
        except JobNotFoundError:
            return


def _tag(job: Job) -> str:
    return f'"{job.id}.{job.revision}"'
