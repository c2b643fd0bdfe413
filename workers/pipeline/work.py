"""Runs one part of a job: claim it, do it, end it; whatever happens, the job's row says so."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import structlog
from sqlalchemy import select

from workers.errors import ProteusError
from workers.pipeline.commit import commit, commit_failure, commit_together
from workers.pipeline.outcome import Outcome, Verb
from workers.pipeline.small_parts import BULK, INGESTED, Bulk, in_turn
from workers.pipeline.verbs import VERBS
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Part
from workers.storage.parts import Claim, LeaseLostError, claim_part, release_part
from workers.storage.several_parts import can_be_claimed, claim_more

log = structlog.get_logger(__name__)
T = TypeVar("T")


def run_part(
    bench: Workbench,
    part_id: str,
    *,
    message: str,
    verbs: Mapping[str, Verb] = VERBS,
    bulk: Bulk = BULK,
) -> int:
    """Do the work of one part, if nobody else does; no error of the work is raised.

    Further shapes of the same upload are ingested with it, where they are small.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    part_id : str
        Id of the part's row; without such a row there is nothing to do.
    message : str
        Id of the message that woke this worker; its parent renews the lease by it.
    verbs : mapping of str to Verb
        What does each kind of part.
    bulk : Bulk
        How many small shapes are ingested at once.

    Returns
    -------
    int
        How many parts were claimed.
    """
    claims = _claim(bench, part_id, message, bulk)
    if len(claims) == 1:
        _run_alone(bench, claims[0], verbs)
    elif claims:
        _run_together(bench, claims, verbs, bulk)
    return len(claims)


def _claim(bench: Workbench, part_id: str, message: str, bulk: Bulk) -> list[Claim]:
    """The part, and small ones beside it; none if there is nothing to do."""
    now, seconds = time.time(), bench.settings.lease_seconds
    with bench.database.read() as session:  # of a bulk, most messages come too late
        if not can_be_claimed(session, part_id, now=now):
            return []
    with bench.database.begin() as session:
        first = claim_part(session, part_id, message=message, now=now, lease_seconds=seconds)
        if first is None:
            return []
        if first.kind != INGESTED or bench.settings.max_attempts < 2:  # a crash counts for all
            return [first]
        share = bulk.share(bench.settings.worker_processes)
        return [first, *claim_more(session, first, share, now=now, lease_seconds=seconds)]


def _run_alone(bench: Workbench, claim: Claim, verbs: Mapping[str, Verb]) -> None:
    started = time.monotonic()
    with structlog.contextvars.bound_contextvars(job_id=claim.job_id, part_id=claim.part_id):
        _log_end(claim, run_claim(bench, claim, verbs=verbs), started)


def _run_together(
    bench: Workbench, claims: Sequence[Claim], verbs: Mapping[str, Verb], bulk: Bulk
) -> None:
    """Compute parts one after another, and store all in one transaction if that can be."""
    begun: dict[str, float] = {}

    def compute(claim: Claim) -> Outcome | None:
        begun[claim.part_id] = time.monotonic()
        with structlog.contextvars.bound_contextvars(job_id=claim.job_id, part_id=claim.part_id):
            found = _attempt(bench, claim, lambda: verbs[claim.kind](bench, claim))
            if isinstance(found, Outcome):
                return found
            _log_end(claim, found, begun[claim.part_id])
            return None

    ended = in_turn(bench, claims, compute, seconds=bulk.seconds)
    together = len(ended) > 1 and commit_together(bench, ended)
    for claim, outcome in ended:
        with structlog.contextvars.bound_contextvars(job_id=claim.job_id, part_id=claim.part_id):
            state = "succeeded" if together else _store(bench, claim, outcome)
            _log_end(claim, state, begun[claim.part_id])


def _log_end(claim: Claim, state: str, started: float) -> None:
    log.info(
        "part ended",
        kind=claim.kind,
        outcome=state,
        attempt=claim.attempts,
        seconds=round(time.monotonic() - started, 3),
    )


def run_claim(bench: Workbench, claim: Claim, *, verbs: Mapping[str, Verb] = VERBS) -> str:
    """Do the work of a claimed part and end it.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        The part that this worker holds.
    verbs : mapping of str to Verb
        What does each kind of part.

    Returns
    -------
    str
        "succeeded", "failed", "released" if it is to be tried again, or "lost" if another worker
        holds it now: then nothing was stored.
    """
    if claim.attempts > bench.settings.max_attempts:
        detail = f"its computation ended {claim.attempts - 1} times without a result"
        return _fail(bench, claim, "computation-lost", detail)
    found = _attempt(bench, claim, lambda: verbs[claim.kind](bench, claim))
    return _store(bench, claim, found) if isinstance(found, Outcome) else found


def _store(bench: Workbench, claim: Claim, outcome: Outcome) -> str:
    found = _attempt(bench, claim, lambda: commit(bench, claim, outcome))
    return "succeeded" if found is None else found


def _attempt(bench: Workbench, claim: Claim, step: Callable[[], T]) -> T | str:
    """Do a step of the work; what stands in its way ends the part or gives it back."""
    try:
        return step()
    except LeaseLostError as error:
        log.warning("lease lost", reason=str(error))
        return "lost"
    except ProteusError as error:
        return _fail(bench, claim, error.kind, str(error))
    except Exception as error:  # the border of the task: nothing may kill the worker
        log.exception("part failed unexpectedly", kind=claim.kind)
        return _retry(bench, claim, error)


def run_pending(
    database: Database,
    blobs: BlobStore,
    settings: Settings,
    *,
    verbs: Mapping[str, Verb] = VERBS,
) -> int:
    """Run queued parts in this process until nothing is queued.

    Parameters
    ----------
    database : Database
        All rows.
    blobs : BlobStore
        All stored bytes.
    settings : Settings
        Of the service.
    verbs : mapping of str to Verb
        What does each kind of part.

    Returns
    -------
    int
        How many parts were run; a part that was tried again counts each time.
    """
    bench = Workbench(database, blobs, settings, _leave_queued)
    count = 0
    while True:
        with database.read() as session:
            queued = session.scalars(
                select(Part.id).where(Part.state == "queued").order_by(Part.id).limit(100)
            ).all()
        if not queued:
            return count
        for part_id in queued:
            count += run_part(bench, part_id, message=f"in-process-{part_id}", verbs=verbs)


def _retry(bench: Workbench, claim: Claim, error: Exception) -> str:
    """Give a part back to the queue, or fail it after the last attempt."""
    if claim.attempts >= bench.settings.max_attempts:
        detail = f"the computation failed {claim.attempts} times with {type(error).__name__}"
        return _fail(bench, claim, "internal-error", detail)
    try:
        with bench.database.begin() as session:
            release_part(session, claim, now=time.time())
    except LeaseLostError:
        return "lost"
    return "released"


def _fail(bench: Workbench, claim: Claim, kind: str, detail: str) -> str:
    try:
        commit_failure(bench, claim, kind, detail)
    except LeaseLostError:
        return "lost"
    return "failed"


def _leave_queued(_parts: Sequence[Part]) -> None:
    """Send no message: the loop finds what is queued."""
