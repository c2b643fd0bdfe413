"""Rows of jobs: making, reading, cancelling and retrying them.

`workers.storage.parts` says how workers claim and end their parts.
"""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from workers.errors import ConflictError, JobNotFoundError
from workers.storage.identifiers import new_id
from workers.storage.models import Job, Part, Shape
from workers.storage.paging import Page, cut_page, decode_cursor

OPEN = ("queued", "running")
ENDED = ("succeeded", "failed", "cancelled")
MAX_ERRORS = 1000
FEWEST_DONE = 5  # of a job, before they say how long the others will take


@dataclass(frozen=True)
class NewPart:
    """Work to be queued: what a worker does with ``payload`` is decided by ``kind``.

    Attributes
    ----------
    queue : {"light", "ingest"}
        Which workers are woken: eigenproblems are ``ingest``, all that is quick is ``light``.
    weight : int
        What it adds to the job's progress; 0 for work the client did not count.
    shape_id : str, optional
        The shape that is ``processing`` while this runs, and failed if it is cancelled.
    """

    kind: str
    queue: str
    payload: Mapping[str, Any]
    weight: int = 1
    shape_id: str | None = None


@dataclass(frozen=True)
class Skipped:
    """A file of an upload that is no mesh, and in short what it is."""

    item: str
    detail: str


def note_skipped(job: Job, skipped: Sequence[Skipped]) -> None:
    """Count files that were skipped, and name the first of them in the job.

    Parameters
    ----------
    job : Job
        Its row, locked or new.
    skipped : sequence of Skipped
        What was found beside the meshes.
    """
    room = max(0, MAX_ERRORS - len(job.skipped))
    job.skipped = [*job.skipped, *(dict(vars(one)) for one in skipped[:room])]
    job.skipped_count += len(skipped)


def part_to_json(part: NewPart) -> dict[str, Any]:
    """Write a part that is to be queued later.

    Parameters
    ----------
    part : NewPart
        Work to be queued.

    Returns
    -------
    dict
        Plain JSON; ``NewPart(**...)`` reads it.
    """
    return dict(vars(part), payload=dict(part.payload))


def create_job(
    session: Session,
    *,
    kind: str,
    unit: str,
    parts: Iterable[NewPart] = (),
    done: int = 0,
    collection: str | None = None,
    model: str | None = None,
    finale: NewPart | None = None,
) -> tuple[Job, list[Part]]:
    """Make a job and its parts; without any part it has succeeded already.

    Parameters
    ----------
    session : Session
        An open transaction.
    kind : str
        What the job does, as its client reads it.
    unit : str
        What its progress counts.
    parts : iterable of NewPart
        Its work.
    done : int
        Progress that was there before: shapes that existed already.
    collection, model : str, optional
        Names of what the job works on.
    finale : NewPart, optional
        Queued when all other parts have ended.

    Returns
    -------
    (Job, list of Part)
        Their rows; the parts are to be sent after the commit.
    """
    now = time.time()
    job = Job(
        id=new_id(),
        kind=kind,
        state="queued",
        done=done,
        done_before=done,
        total=done,
        unit=unit,
        errors=[],
        failed=0,
        skipped=[],
        skipped_count=0,
        attempts=0,
        collection=collection,
        model=model,
        finale=None if finale is None else part_to_json(finale),
        revision=1,
        created_at=now,
    )
    session.add(job)
    session.flush()
    rows = add_parts(session, job, parts)
    if not rows:
        rows = end_if_all_ended(session, job)
    return job, rows


def add_parts(session: Session, job: Job, parts: Iterable[NewPart]) -> list[Part]:
    """Queue further parts of a job.

    Parameters
    ----------
    session : Session
        An open transaction.
    job : Job
        Its row, locked.
    parts : iterable of NewPart
        Further work.

    Returns
    -------
    list of Part
        Their rows, to be sent after the commit.
    """
    now = time.time()
    rows = [
        Part(
            id=new_id(),
            job_id=job.id,
            kind=part.kind,
            queue=part.queue,
            payload=dict(part.payload),
            shape_id=part.shape_id,
            weight=part.weight,
            state="queued",
            attempts=0,
            sent_at=now,
        )
        for part in parts
    ]
    session.add_all(rows)
    job.total += sum(row.weight for row in rows)
    session.flush()
    return rows


def end_if_all_ended(session: Session, job: Job) -> list[Part]:
    """Queue the finale, or end the job, once no part is open.

    Parameters
    ----------
    session : Session
        An open transaction.
    job : Job
        Its row, locked.

    Returns
    -------
    list of Part
        The finale, if it was queued.
    """
    parts = (Part.job_id == job.id, Part.state.in_(OPEN))
    if session.scalar(select(func.count()).select_from(Part).where(*parts)):
        return []
    if job.finale is not None:
        finale, job.finale = NewPart(**job.finale), None
        return add_parts(session, job, [finale])
    all_failed = job.failed > 0 and job.failed >= job.total
    job.state = "failed" if all_failed or _failed_uncounted(session, job) else "succeeded"
    job.finished_at = time.time()
    return []


def estimate_seconds_left(job: Job, *, now: float) -> float | None:
    """How long a job will still take if it goes on as it did since it was begun.

    Parameters
    ----------
    job : Job
        Its row.
    now : float
        Seconds since 1970; something was done just now.

    Returns
    -------
    float or None
        None while too little was done to tell, and if nothing is left that is counted.
    """
    done, left = job.done - job.done_before, job.total - job.done
    if job.started_at is None or done < FEWEST_DONE or left <= 0:
        return None
    return max(0.0, now - job.started_at) * left / done


def _failed_uncounted(session: Session, job: Job) -> bool:
    """Whether something failed that no progress counts: unpacking or activation."""
    failed = (Part.job_id == job.id, Part.state == "failed", Part.weight == 0)
    return session.scalar(select(Part.id).where(*failed).limit(1)) is not None


def get_job(session: Session, job_id: str, *, lock: bool = False) -> Job:
    """Return a job.

    Parameters
    ----------
    session : Session
        An open transaction.
    job_id : str
        Id of its row.
    lock : bool
        Whether its row is held until the commit.

    Returns
    -------
    Job
        Its row.

    Raises
    ------
    JobNotFoundError
        There is none with this id.
    """
    job = session.get(Job, job_id, with_for_update=lock or None, populate_existing=lock)
    if job is None:
        raise JobNotFoundError(f"there is no job {job_id!r}")
    return job


def page_of_jobs(
    session: Session,
    *,
    limit: int,
    cursor: str | None,
    kind: str | None = None,
    state: str | None = None,
    collection: str | None = None,
) -> Page[Job]:
    """List jobs, the newest first.

    Parameters
    ----------
    session : Session
        An open transaction.
    limit : int
        At most so many.
    cursor : str or None
        Where the page before this one ended.
    kind, state, collection : str, optional
        Only jobs that have these.

    Returns
    -------
    Page of Job
        With the cursor of the next page.
    """
    statement = select(Job).order_by(Job.id.desc()).limit(limit + 1)
    for column, value in ((Job.kind, kind), (Job.state, state), (Job.collection, collection)):
        if value is not None:
            statement = statement.where(column == value)
    if (before := decode_cursor(cursor)) is not None:
        statement = statement.where(Job.id < before)
    return cut_page(session.scalars(statement).all(), limit, lambda job: job.id)


def cancel_job(session: Session, job_id: str) -> Job:
    """End a job now: what waits does not start, and what runs can no longer store anything.

    Parameters
    ----------
    session : Session
        An open transaction.
    job_id : str
        Id of its row.

    Returns
    -------
    Job
        Its row.

    Raises
    ------
    JobNotFoundError, ConflictError
        There is none with this id; it has ended already.
    """
    job = get_job(session, job_id, lock=True)
    if job.state in ENDED:
        raise ConflictError(f"the job has {job.state} already, so it cannot be cancelled")
    cancelled = list(
        session.scalars(
            update(Part)
            .where(Part.job_id == job_id, Part.state.in_(OPEN))
            .values(state="cancelled", owner=None, lease_until=None)
            .returning(Part.shape_id)
        )
    )
    reason = {"type": "cancelled", "detail": "its job was cancelled before it was computed"}
    _set_shape_errors(session, cancelled, reason)
    job.state, job.step, job.seconds_left = "cancelled", None, None
    job.finished_at = time.time()
    job.revision += 1
    return job


def retry_job(session: Session, job_id: str) -> tuple[Job, list[Part]]:
    """Queue again what failed or was cancelled.

    Parameters
    ----------
    session : Session
        An open transaction.
    job_id : str
        Id of its row.

    Returns
    -------
    (Job, list of Part)
        The parts are to be sent after the commit.

    Raises
    ------
    JobNotFoundError, ConflictError
        No job has this id; it has not ended; nothing in it failed.
    """
    job = get_job(session, job_id, lock=True)
    if job.state not in ENDED:
        raise ConflictError(f"the job is {job.state}, so it cannot be retried yet")
    failed = session.scalars(
        select(Part).where(Part.job_id == job_id, Part.state.in_(("failed", "cancelled")))
    ).all()
    if not failed and job.finale is None:
        raise ConflictError("nothing in the job failed, so there is nothing to retry")
    for part in failed:
        job.done -= part.weight if part.state == "failed" else 0
        part.state, part.attempts, part.sent_at = "queued", 0, time.time()
    _set_shape_errors(session, [part.shape_id for part in failed], None)
    job.state, job.errors, job.failed, job.done_before = "queued", [], 0, job.done
    job.seconds_left = None
    job.started_at = job.finished_at = None
    job.revision += 1
    session.flush()
    return job, list(failed) or end_if_all_ended(session, job)


def _set_shape_errors(
    session: Session, shape_ids: Sequence[str | None], error: dict[str, str] | None
) -> None:
    known = [shape_id for shape_id in shape_ids if shape_id is not None]
    for start in range(0, len(known), 500):
        chunk = known[start : start + 500]
        session.execute(update(Shape).where(Shape.id.in_(chunk)).values(error=error))
