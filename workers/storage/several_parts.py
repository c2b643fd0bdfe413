"""Several parts of one job: claimed, held and given back together.

Decision 33 says which, and why only the first one's lease is renewed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from workers.storage.jobs import get_job
from workers.storage.models import Collection, Job, Part, Shape
from workers.storage.parts import Claim, LeaseLostError


@dataclass(frozen=True)
class Share:
    """How much one worker claims at once.

    Attributes
    ----------
    parts : int
        At most so many.
    n_bytes : int
        Their files have at most so many bytes together.
    divisor : int
        The claim takes no more than one in so many of the parts that wait. So it gets smaller
        towards the end of a job, and all processes end together.
    """

    parts: int
    n_bytes: int
    divisor: int


def claim_more(
    session: Session, first: Claim, share: Share, *, now: float, lease_seconds: float
) -> list[Claim]:
    """Claim further parts of the same job whose files are small; call it after `claim_part`.

    Parts that were tried before are left alone: one of them may kill every worker that takes it.

    Parameters
    ----------
    session : Session
        The transaction that claimed the first part; it holds the job's row.
    first : Claim
        A part of a shape; nothing more is claimed if it was tried before.
    share : Share
        How much.
    now : float
        Seconds since 1970.
    lease_seconds : float
        How long the claims stand: nobody renews them.

    Returns
    -------
    list of Claim
        In the order in which they were queued; they have the first one's owner.
    """
    if first.attempts > 1 or first.shape_id is None or share.parts < 2:
        return []
    own = session.scalar(select(Shape.n_bytes).where(Shape.id == first.shape_id))
    if own is None or own >= share.n_bytes:
        return []
    waiting = session.execute(
        select(Part.id, Shape.n_bytes)
        .join(Shape, Shape.id == Part.shape_id)
        .where(
            Part.job_id == first.job_id,
            Part.state == "queued",
            Part.kind == first.kind,
            Part.attempts == 0,
        )
        .order_by(Part.id)
        .limit(share.parts * share.divisor)
        .with_for_update(of=Part, skip_locked=True)
    ).all()
    count, room = min(share.parts - 1, len(waiting) // share.divisor), share.n_bytes - own
    chosen: list[str] = []
    for part_id, n_bytes in waiting:
        if n_bytes <= room and len(chosen) < count:
            chosen.append(part_id)
            room -= n_bytes
    if not chosen:
        return []
    claimed = session.execute(
        update(Part)
        .where(Part.id.in_(chosen), Part.state == "queued")
        .values(
            state="running",
            owner=first.owner,
            message=None,
            lease_until=now + lease_seconds,
            attempts=Part.attempts + 1,
        )
        .returning(Part.id, Part.payload, Part.shape_id, Part.attempts)
    ).all()
    return [
        replace(first, part_id=row.id, payload=row.payload, shape_id=row.shape_id, attempts=1)
        for row in sorted(claimed, key=lambda row: str(row.id))
    ]


def can_be_claimed(session: Session, part_id: str, *, now: float) -> bool:
    """Whether a message may find something to do; it locks nothing.

    Parameters
    ----------
    session : Session
        That reads.
    part_id : str
        Id of the part's row.
    now : float
        Seconds since 1970.

    Returns
    -------
    bool
        False if somebody works on the part, or it has ended, or its row is gone.
    """
    row = session.execute(select(Part.state, Part.lease_until).where(Part.id == part_id)).first()
    if row is None:
        return False
    ran_out = row.state == "running" and row.lease_until is not None and row.lease_until < now
    return row.state == "queued" or ran_out


def is_held(session: Session, claim: Claim) -> bool:
    """Whether a claim still stands; it locks nothing.

    Parameters
    ----------
    session : Session
        That reads.
    claim : Claim
        Of this worker.

    Returns
    -------
    bool
        False if its job was cancelled, or another worker has the part.
    """
    held = (Part.id == claim.part_id, Part.owner == claim.owner, Part.state == "running")
    return session.scalar(select(Part.id).where(*held)) is not None


def hold_leases(session: Session, claims: Sequence[Claim]) -> Job:
    """Make sure, until the commit, that claims on parts of one job stand; lock their shapes, too.

    The order of the locks is that of all transactions: job, parts, collection, shapes.

    Parameters
    ----------
    session : Session
        An open transaction.
    claims : sequence of Claim
        Parts of shapes, all of one job.

    Returns
    -------
    Job
        Their job.

    Raises
    ------
    LeaseLostError
        One of them does not stand.
    """
    job = get_job(session, claims[0].job_id, lock=True)
    if len(_held(session, claims)) < len(claims):
        raise LeaseLostError(f"not all of {len(claims)} parts are held by this worker")
    shapes = [claim.shape_id for claim in claims if claim.shape_id is not None]
    of_shapes = select(Shape.collection_id).where(Shape.id.in_(shapes))
    collections = select(Collection.id).where(Collection.id.in_(of_shapes)).order_by(Collection.id)
    session.execute(collections.with_for_update(read=True)).all()
    rows = select(Shape.id).where(Shape.id.in_(shapes)).order_by(Shape.id)
    session.execute(rows.with_for_update()).all()
    return job


def give_back(session: Session, claims: Sequence[Claim], *, now: float) -> list[Part]:
    """Put parts that were claimed, but not begun, back into the queue as if they never were.

    Parameters
    ----------
    session : Session
        An open transaction.
    claims : sequence of Claim
        Parts of one job; what is no longer held is left alone.
    now : float
        Seconds since 1970.

    Returns
    -------
    list of Part
        What was given back, to be sent after the commit.
    """
    get_job(session, claims[0].job_id, lock=True)
    ids = _held(session, claims)
    back = select(Part).where(Part.id.in_(ids)).order_by(Part.id)
    parts = list(session.scalars(back))
    for part in parts:
        part.state, part.owner, part.lease_until = "queued", None, None
        part.attempts, part.sent_at = part.attempts - 1, now
    session.flush()
    return parts


def _held(session: Session, claims: Sequence[Claim]) -> Sequence[str]:
    """Ids of those parts that are still held, with their rows locked in order."""
    held = select(Part.id).where(
        Part.id.in_([claim.part_id for claim in claims]),
        Part.owner == claims[0].owner,
        Part.state == "running",
    )
    return session.scalars(held.order_by(Part.id).with_for_update()).all()
