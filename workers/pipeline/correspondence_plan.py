"""The job that finds a correspondence: made once for two meshes, and found again."""

import time
import uuid
from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.pipeline.part_kinds import CORRESPONDENCE, correspondence_part
from workers.storage.jobs import OPEN, create_job
from workers.storage.models import Job, Part
from workers.storage.references import hold_blobs

REMEMBERED_SECONDS = 600
"""So long a failure is the answer; then it is tried again."""

LOOKED_AT = 1000
"""So many jobs are looked through for one of the same meshes."""


def find_job(session: Session, first: str, second: str) -> Job | None:
    """Look for the job of two meshes among the newest: one at work, or one that failed just now.

    Parameters
    ----------
    session : Session
        That reads.
    first, second : str
        SHA-256 of the uploaded meshes.

    Returns
    -------
    Job or None
        None if there is none, so that one is to be made.
    """
    earliest = str(uuid.UUID(int=int(1000 * (time.time() - REMEMBERED_SECONDS)) << 80))
    newest = (
        select(Job, Part.payload)
        .join(Part, Part.job_id == Job.id)
        .where(Job.kind == CORRESPONDENCE)
        .where(Job.state.in_(OPEN) | ((Job.state == "failed") & (Job.id > earliest)))
        .order_by(Job.id.desc())
        .limit(LOOKED_AT)
    )
    wanted = dict(correspondence_part(first, second).payload)
    for job, payload in session.execute(newest):
        if payload == wanted:
            return job
    return None


def store_job(session: Session, first: str, second: str) -> tuple[Job, Sequence[Part]]:
    """Make the job of two meshes, unless there is one.

    Parameters
    ----------
    session : Session
        That writes.
    first, second : str
        SHA-256 of the uploaded meshes.

    Returns
    -------
    The job, and parts to dispatch after the commit.
    """
    hold_blobs(session)  # nobody prunes what the job is going to read
    job = find_job(session, first, second)
    if job is not None:
        return job, []
    part = correspondence_part(first, second)
    return create_job(session, kind=CORRESPONDENCE, unit="pairs", parts=[part])
