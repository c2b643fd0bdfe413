"""Runs one part of a job: claim it, do it, end it; whatever happens, the job's row says so."""

import time
from collections.abc import Mapping, Sequence

import structlog
from sqlalchemy import select

from workers.errors import ProteusError
from workers.pipeline.commit import commit, commit_failure
from workers.pipeline.outcome import Verb
from workers.pipeline.verbs import VERBS
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Part
from workers.storage.parts import Claim, LeaseLostError, claim_part, release_part

log = structlog.get_logger(__name__)


def run_part(
    bench: Workbench, part_id: str, *, message: str, verbs: Mapping[str, Verb] = VERBS
) -> None:
    """Do the work of one part, if nobody else does; no error of the work is raised.

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
    """
    with bench.database.begin() as session:
        claim = claim_part(
            session,
            part_id,
            message=message,
            now=time.time(),
            lease_seconds=bench.settings.lease_seconds,
        )
    if claim is None:
        return
    started = time.monotonic()
    with structlog.contextvars.bound_contextvars(job_id=claim.job_id, part_id=part_id):
        state = run_claim(bench, claim, verbs=verbs)
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
    try:
        commit(bench, claim, verbs[claim.kind](bench, claim))
    except LeaseLostError as error:
        log.warning("lease lost", reason=str(error))
        return "lost"
    except ProteusError as error:
        return _fail(bench, claim, error.kind, str(error))
    except Exception as error:  # the border of the task: nothing may kill the worker
        log.exception("part failed unexpectedly", kind=claim.kind)
        return _retry(bench, claim, error)
    return "succeeded"


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
            run_part(bench, part_id, message=f"in-process-{part_id}", verbs=verbs)
            count += 1


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
