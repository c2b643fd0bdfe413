"""What a worker's parent asks and changes about the parts that its processes work on."""

from collections.abc import Mapping

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from workers.storage.jobs import OPEN
from workers.storage.models import Job, Part
from workers.storage.parts import Claim


def claims_standing(session: Session, owners: Mapping[str, str]) -> dict[str, str]:
    """Which claims still stand.

    Parameters
    ----------
    session : Session
        That reads.
    owners : mapping of str to str
        What each claim drew as its owner, by the id of its part.

    Returns
    -------
    dict of str to str
        The ids of their jobs by those of their parts. A part is not among them if its job was
        cancelled, if somebody else holds it, or if its row is gone.
    """
    held = select(Part.id, Part.owner, Part.job_id).where(
        Part.id.in_(list(owners)), Part.state == "running"
    )
    return {part: job for part, owner, job in session.execute(held) if owner == owners[part]}


def claim_of(session: Session, part_id: str, owner: str) -> Claim | None:
    """The claim of a part, as the worker has it that holds it.

    Parameters
    ----------
    session : Session
        That reads.
    part_id, owner : str
        Id of the part, and what the claim drew.

    Returns
    -------
    Claim or None
        None if it stands no longer.
    """
    part = session.get(Part, part_id)
    if part is None or part.state != "running" or part.owner != owner:
        return None
    return Claim(part.id, part.job_id, part.kind, part.payload, part.shape_id, owner, part.attempts)


def is_last_open(session: Session, part_id: str, job_id: str) -> bool:
    """Whether no other part of a job is open: then its step is that of the whole job.

    Parameters
    ----------
    session : Session
        That reads.
    part_id, job_id : str
        Ids of the part and its job.

    Returns
    -------
    bool
        True if there is no other one.
    """
    others = select(Part.id).where(Part.job_id == job_id, Part.state.in_(OPEN), Part.id != part_id)
    return session.scalar(others.limit(1)) is None


def store_step(session: Session, job_id: str, step: str) -> None:
    """Note in a running job what is done now; its watchers are told.

    Parameters
    ----------
    session : Session
        An open transaction.
    job_id : str
        Id of its row.
    step : str
        Name of the step.
    """
    running = update(Job).where(Job.id == job_id, Job.state == "running")
    session.execute(running.values(step=step, revision=Job.revision + 1))


def release_owned(session: Session, owner: str, *, now: float) -> list[Part]:
    """Give back whatever else a process had claimed that was killed because of one part.

    Parameters
    ----------
    session : Session
        An open transaction.
    owner : str
        What its claim drew; the part because of which it was killed has ended.
    now : float
        Seconds since 1970.

    Returns
    -------
    list of Part
        To be sent after the commit. The attempt does not count: it was not theirs to fail.
    """
    held = update(Part).where(Part.owner == owner, Part.state == "running")
    values = {"state": "queued", "owner": None, "lease_until": None, "sent_at": now}
    released = held.values(**values, attempts=Part.attempts - 1).returning(Part)
    return list(session.scalars(released))
