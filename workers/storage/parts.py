"""How a part of a job is claimed, held, finished or lost.

A message only wakes a worker. The worker claims the part with one conditional update, and its
parent renews the lease. The result is stored in the transaction that ends the part. Each claim
draws a new owner, which that transaction compares: whoever lost the lease stores nothing.
Locks are taken in one order everywhere: job, part, collection, shape, counter.
Times are given by the caller, in seconds since 1970; a fleet's clocks may differ by less
than a lease.
"""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import or_, select, update
from sqlalchemy.orm import Session

from workers.errors import ConflictError
from workers.storage.identifiers import new_id
from workers.storage.jobs import (
    MAX_ERRORS,
    NewPart,
    Skipped,
    add_parts,
    end_if_all_ended,
    estimate_seconds_left,
    get_job,
    note_skipped,
    part_to_json,
)
from workers.storage.models import Job, Part, Shape


class LeaseLostError(ConflictError):
    """Somebody else works on this part now, or its job was cancelled: store nothing."""


@dataclass(frozen=True)
class Claim:
    """A part that this worker, and no other, may finish."""

    part_id: str
    job_id: str
    kind: str
    payload: Mapping[str, Any]
    shape_id: str | None
    owner: str
    attempts: int


@dataclass(frozen=True)
class Failure:
    """Why an item failed, as its client reads it."""

    item: str
    type: str
    detail: str


def item_of(kind: str, payload: Mapping[str, Any]) -> str:
    """Name a part that is of no shape, for the list of what failed.

    Parameters
    ----------
    kind : str
        Kind of the part.
    payload : mapping of str
        Of the part.

    Returns
    -------
    str
        Its item, or its file, or else its kind.
    """
    return str(payload.get("item") or payload.get("filename") or kind)


def claim_part(
    session: Session, part_id: str, *, message: str, now: float, lease_seconds: float
) -> Claim | None:
    """Claim a part that is queued, or whose lease ran out.

    Parameters
    ----------
    session : Session
        An open transaction.
    part_id : str
        Id of the part's row.
    message : str
        Id of the message whose process works on it.
    now : float
        Seconds since 1970.
    lease_seconds : float
        How long the claim stands unless it is renewed.

    Returns
    -------
    Claim or None
        None if somebody else works on it, or it has ended, or its row is gone.
    """
    job_id = session.scalar(select(Part.job_id).where(Part.id == part_id))
    if job_id is None:
        return None
    job = get_job(session, job_id, lock=True)
    owner = new_id()
    claimable = or_(Part.state == "queued", (Part.state == "running") & (Part.lease_until < now))
    row = session.execute(
        update(Part)
        .where(Part.id == part_id, claimable)
        .values(
            state="running",
            owner=owner,
            message=message,
            lease_until=now + lease_seconds,
            attempts=Part.attempts + 1,
        )
        .returning(Part.kind, Part.payload, Part.shape_id, Part.attempts)
    ).one_or_none()
    if row is None:
        return None
    if job.state == "queued":
        job.state, job.started_at = "running", now
        job.revision += 1
    job.attempts = max(job.attempts, row.attempts)
    return Claim(part_id, job_id, row.kind, row.payload, row.shape_id, owner, row.attempts)


def renew_leases(session: Session, messages: Iterable[str], *, until: float) -> int:
    """Lengthen the leases of parts whose messages are being worked on.

    Parameters
    ----------
    session : Session
        An open transaction.
    messages : iterable of str
        Ids of the messages.
    until : float
        When the leases end, in seconds since 1970.

    Returns
    -------
    int
        How many leases were renewed.
    """
    ids = list(messages)
    if not ids:
        return 0
    renewed = session.scalars(
        update(Part)
        .where(Part.message.in_(ids), Part.state == "running")
        .values(lease_until=until)
        .returning(Part.id)
    )
    return len(renewed.all())


def hold_lease(session: Session, claim: Claim) -> Job:
    """Make sure, until the commit, that the claim still stands.

    Parameters
    ----------
    session : Session
        An open transaction.
    claim : Claim
        The part that this worker holds.

    Returns
    -------
    Job
        The part's job; its row and that of the part are locked.

    Raises
    ------
    LeaseLostError
        It does not.
    """
    job = get_job(session, claim.job_id, lock=True)
    held = select(Part.id).where(
        Part.id == claim.part_id, Part.owner == claim.owner, Part.state == "running"
    )
    if session.scalar(held.with_for_update()) is None:
        raise LeaseLostError(f"part {claim.part_id} is no longer held by this worker")
    return job


def finish_part(
    session: Session,
    claim: Claim,
    *,
    failure: Failure | None = None,
    failed_items: Sequence[Failure] = (),
    skipped: Sequence[Skipped] = (),
    follow_up: Sequence[NewPart] = (),
    finale: NewPart | None = None,
    again: Sequence[str] = (),
) -> list[Part]:
    """End a part and count it; call it last in the transaction that stores the result.

    Parameters
    ----------
    session : Session
        An open transaction.
    claim : Claim
        The part that this worker holds.
    failure : Failure, optional
        Why the part failed as a whole.
    failed_items : sequence of Failure
        Items that failed inside of a part that succeeded; its weight counts them already.
    skipped : sequence of Skipped
        Files that are no meshes; no progress counts them.
    follow_up : sequence of NewPart
        Parts to be queued.
    finale : NewPart, optional
        The part that runs once all others have ended; it replaces the job's finale.
    again : sequence of str
        Ids of parts of this job that have ended and are to be done once more.

    Returns
    -------
    list of Part
        What is to be sent after the commit: all that was queued, or else the job's finale.

    Raises
    ------
    LeaseLostError
        The claim stands no longer: the transaction must be given up.
    """
    job = hold_lease(session, claim)
    ended = update(Part).where(Part.id == claim.part_id)
    state = "succeeded" if failure is None else "failed"
    weight = session.scalar(
        ended.values(state=state, owner=None, lease_until=None).returning(Part.weight)
    )
    job.done += weight or 0
    job.failed += len(failed_items) + (0 if failure is None else weight or 0)
    job.step, job.seconds_left = None, estimate_seconds_left(job, now=time.time())
    job.revision += 1
    named = [*failed_items, *([] if failure is None else [failure])]
    room = max(0, MAX_ERRORS - len(job.errors))
    job.errors = [*job.errors, *(dict(vars(one)) for one in named[:room])]
    note_skipped(job, skipped)
    if finale is not None:
        job.finale = part_to_json(finale)
    queued = [*_queue_again(session, job, again), *add_parts(session, job, follow_up)]
    return queued or end_if_all_ended(session, job)


def _queue_again(session: Session, job: Job, part_ids: Sequence[str]) -> list[Part]:
    """Queue ended parts once more, up to their last attempt; the job forgets what they reported."""
    if not part_ids:
        return []
    chosen = select(Part).where(Part.id.in_(part_ids)).order_by(Part.id).with_for_update()
    parts = list(session.scalars(chosen))
    for part in parts:
        part.state, part.sent_at = "queued", time.time()
        job.done -= part.weight
    items = {item_of(part.kind, part.payload) for part in parts}
    kept = [error for error in job.errors if error["item"] not in items]
    job.failed -= len(job.errors) - len(kept)
    job.errors = kept
    session.flush()
    return parts


def release_part(session: Session, claim: Claim, *, now: float) -> None:
    """Give a part back to the queue; only its attempts show that it was claimed.

    Parameters
    ----------
    session : Session
        An open transaction.
    claim : Claim
        The part that this worker holds.
    now : float
        Seconds since 1970.

    Raises
    ------
    LeaseLostError
        The claim stands no longer.
    """
    hold_lease(session, claim).step = None
    session.execute(
        update(Part)
        .where(Part.id == claim.part_id)
        .values(state="queued", owner=None, lease_until=None, sent_at=now)
    )


def parts_to_send(
    session: Session, *, now: float, resend_seconds: float, limit: int = 500
) -> list[Part]:
    """Find parts that nobody seems to work on: sent long ago, or with a lease that ran out.

    Parameters
    ----------
    session : Session
        An open transaction.
    now : float
        Seconds since 1970.
    resend_seconds : float
        How long a queued part may wait before its message counts as lost.
    limit : int
        At most so many parts.

    Returns
    -------
    list of Part
        The oldest first.
    """
    lost = or_(
        (Part.state == "queued") & (Part.sent_at < now - resend_seconds),
        (Part.state == "running") & (Part.lease_until < now),
    )
    return list(session.scalars(select(Part).where(lost).order_by(Part.id).limit(limit)))


def mark_sent(session: Session, part_ids: Sequence[str], *, now: float) -> None:
    """Note that the parts' messages were sent just now.

    Parameters
    ----------
    session : Session
        An open transaction.
    part_ids : sequence of str
        Ids of their rows.
    now : float
        Seconds since 1970.
    """
    session.execute(update(Part).where(Part.id.in_(part_ids)).values(sent_at=now))


def fail_exhausted(session: Session, part_id: str, *, now: float, max_attempts: int) -> list[Part]:
    """Fail a part whose workers died as often as is allowed.

    Parameters
    ----------
    session : Session
        An open transaction.
    part_id : str
        Id of the part's row.
    now : float
        Seconds since 1970.
    max_attempts : int
        How often a part may be claimed.

    Returns
    -------
    list of Part
        What is to be sent after the commit: the job's finale, if this was its last part.
    """
    exhausted = select(Part).where(
        Part.id == part_id,
        Part.state == "running",
        Part.lease_until < now,
        Part.attempts >= max_attempts,
    )
    part = session.scalar(exhausted)
    if part is None:
        return []
    get_job(session, part.job_id, lock=True)
    part = session.scalar(exhausted.with_for_update().execution_options(populate_existing=True))
    if part is None:
        return []
    part.owner, part.lease_until = new_id(), now + 60.0
    session.flush()
    detail = f"its computation ended {part.attempts} times without a result"
    shape = session.get(Shape, part.shape_id) if part.shape_id else None
    if shape is not None:
        shape.error = {"type": "computation-lost", "detail": detail}
    claim = Claim(
        part.id, part.job_id, part.kind, part.payload, part.shape_id, part.owner, part.attempts
    )
    item = item_of(part.kind, part.payload) if shape is None else shape.path
    return finish_part(
        session, claim, failure=Failure(item=item, type="computation-lost", detail=detail)
    )
