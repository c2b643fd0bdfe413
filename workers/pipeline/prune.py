"""The job that frees what is no longer needed, one kind after another.

Each part of the job frees one kind for some time, then follows up with the rest. So no part runs
into the hard limit of a task. After a crash a part begins again where it began.
"""

import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.pipeline.outcome import Outcome
from workers.pipeline.workbench import Workbench
from workers.settings import LIGHT, Settings
from workers.storage.database import Database
from workers.storage.jobs import OPEN, NewPart, create_job
from workers.storage.models import Counter, Job, Json, Part
from workers.storage.parts import Claim
from workers.storage.pruning import KINDS, PRUNED, Store, free
from workers.storage.retention import Amount

SECONDS_A_PART = 60.0
HOUR = 3600.0


def plan_pruning(session: Session, *, now: float) -> tuple[Job, list[Part]]:
    """Make the job that frees what is no longer needed, unless one is at work.

    Parameters
    ----------
    session : Session
        That writes; one job at a time is planned.
    now : float
        Seconds since 1970.

    Returns
    -------
    job : Job
        The new one, or the one that is at work.
    parts : list of Part
        To be sent after the commit.
    """
    last = _last_planned(session, lock=True)
    at_work = select(Job).where(Job.kind == "prune", Job.state.in_(OPEN)).limit(1)
    if (job := session.scalar(at_work)) is not None:
        return job, []
    last.value = int(now)
    return create_job(
        session, kind="prune", unit="kinds", parts=[prune_part(list(KINDS), {}, after="")]
    )


def plan_pruning_if_due(database: Database, settings: Settings, *, now: float) -> list[Part]:
    """Make the job if the last one was asked for long enough ago.

    Parameters
    ----------
    database : Database
        Where jobs are; it is written to only if a job is due.
    settings : Settings
        They say how often.
    now : float
        Seconds since 1970.

    Returns
    -------
    Parts to be sent, of a job that is committed.
    """
    if not settings.prune_hours:
        return []
    due = now - settings.prune_hours * HOUR
    with database.read() as session:
        if _last_planned(session).value > due:
            return []
    with database.begin() as session:
        if _last_planned(session, lock=True).value > due:  # another worker was quicker
            return []
        return plan_pruning(session, now=now)[1]


def prune_part(kinds: Sequence[str], freed: Mapping[str, Amount], *, after: str) -> NewPart:
    """Free what is old of some kinds.

    Parameters
    ----------
    kinds : sequence of str
        Those of ``KINDS`` that are left, in their order.
    freed : Mapping
        What earlier parts of the job freed, by kind.
    after : str
        The last folder of the first kind that an earlier part has done.

    Returns
    -------
    NewPart
        Its weight is 0: `prune` itself counts kinds.
    """
    amounts = {name: vars(amount) for name, amount in freed.items()}
    payload = {"kinds": list(kinds), "freed": amounts, "after": after}
    return NewPart("prune", LIGHT, payload, weight=0)


def prune(bench: Workbench, claim: Claim, *, seconds: float = SECONDS_A_PART) -> Outcome:
    """Free what is old of a kind, until all is done or the time is up.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings, which say how long each kind is kept.
    claim : Claim
        Its payload names the kinds that are left, and what earlier parts freed.
    seconds : float
        After so long the rest is left to another part.

    Returns
    -------
    Outcome
        Notes in the job what was freed so far, and follows up with what is left.
    """
    kinds: list[str] = claim.payload["kinds"]
    freed = {name: Amount(**amount) for name, amount in claim.payload["freed"].items()}
    store = Store(bench.database, bench.blobs, bench.settings, time.time())
    until = time.monotonic() + seconds
    name, after = kinds[0], claim.payload["after"]
    freed.setdefault(name, Amount())
    left = kinds[1:]
    for step in free(store, name, after=after):
        freed[name] += step.freed
        if time.monotonic() > until:
            left, after = kinds, step.folder
            break
    else:
        after = ""
    follow_up = [prune_part(left, freed, after=after)] if left else []
    return Outcome(store=partial(_report, freed, len(left)), follow_up=follow_up)


def _report(freed: Mapping[str, Amount], left: int, _session: Session, job: Job) -> None:
    job.total, job.done = len(KINDS), len(KINDS) - left
    job.result = report(freed)


def report(freed: Mapping[str, Amount]) -> Json:
    """What a run freed, as the job's result says it.

    Parameters
    ----------
    freed : Mapping
        Amounts by kind.

    Returns
    -------
    ``count`` and ``bytes`` of all, and ``kinds``, a list with both for each kind.
    """
    total: dict[str, Any] = dict(vars(sum(freed.values(), Amount())))
    kinds = [{"kind": name, **vars(amount)} for name, amount in freed.items()]
    return {**total, "kinds": kinds}


def _last_planned(session: Session, *, lock: bool = False) -> Counter:
    statement = select(Counter).where(Counter.name == PRUNED)
    return session.scalars(statement.with_for_update() if lock else statement).one()
