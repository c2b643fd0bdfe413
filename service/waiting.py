"""Holding on for a job without holding a thread."""

import asyncio
import time

from fastapi.concurrency import run_in_threadpool

from workers.storage.database import Database
from workers.storage.jobs import ENDED, get_job
from workers.storage.models import Job

FIRST_PAUSE_SECONDS = 0.05
LONGEST_PAUSE_SECONDS = 0.5


def read_job(database: Database, job_id: str) -> Job:
    """Return a job as it is now.

    Raises
    ------
    JobNotFoundError
        There is none with this id.
    """
    with database.read() as session:
        return get_job(session, job_id)


async def hold_on(database: Database, job_id: str, seconds: float) -> Job:
    """Return a job once it has ended, or as it is after so many seconds.

    The pauses grow, and between them no thread and no connection is held: hundreds of clients
    may wait at once.
    """
    until = time.monotonic() + seconds
    pause = FIRST_PAUSE_SECONDS
    while True:
        job = await run_in_threadpool(read_job, database, job_id)
        left = until - time.monotonic()
        if job.state in ENDED or left <= 0:
            return job
        await asyncio.sleep(min(pause, left))
        pause = min(1.5 * pause, LONGEST_PAUSE_SECONDS)
