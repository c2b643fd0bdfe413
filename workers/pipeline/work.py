"""Runs one part of a job: claim, do, finish; whatever happens, the job learns of it."""

import time
from collections.abc import Callable, Mapping, Sequence

import structlog
from sqlalchemy import select

from workers.errors import IncompletePartsError, ProteusError
from workers.pipeline.activate import activate
from workers.pipeline.evaluate import evaluate
from workers.pipeline.ingest import ingest
from workers.pipeline.pair import compute_pair
from workers.pipeline.query import answer_query
from workers.pipeline.rank import rank
from workers.pipeline.redescribe import redescribe
from workers.pipeline.train import fit
from workers.pipeline.train_bank import fit_bank
from workers.pipeline.unpack import unpack
from workers.pipeline.variant import compute_variant
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Part, Shape
from workers.storage.parts import (
    Claim,
    Failure,
    LeaseLostError,
    claim_part,
    finish_part,
    hold_lease,
    item_of,
    release_part,
)

log = structlog.get_logger(__name__)

VERBS: Mapping[str, Callable[[Workbench, Claim], None]] = {
    "ingest": ingest,
    "unpack": unpack,
    "query": answer_query,
    "describe": redescribe,
    "activate": activate,
    "pair": compute_pair,
    "fit": fit,
    "variant": compute_variant,
    "fit-bank": fit_bank,
    "rank": rank,
    "evaluate": evaluate,
}


def run_part(bench: Workbench, part_id: str, *, message: str) -> None:
    """Do one part's work, if it is there to be done; raises nothing that a job could cause."""
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
        outcome = _run_claim(bench, claim)
        log.info(
            "part ended",
            kind=claim.kind,
            outcome=outcome,
            attempt=claim.attempts,
            seconds=round(time.monotonic() - started, 3),
        )


def _run_claim(bench: Workbench, claim: Claim) -> str:
    if claim.attempts > bench.settings.max_attempts:
        detail = f"its computation ended {claim.attempts - 1} times without a result"
        return _fail(bench, claim, "computation-lost", detail)
    try:
        VERBS[claim.kind](bench, claim)
    except LeaseLostError as error:
        log.warning("lease lost", reason=str(error))
        return "lost"
    except IncompletePartsError as error:
        return _retry(bench, claim, error)
    except ProteusError as error:
        return _fail(bench, claim, error.kind, str(error))
    except Exception as error:  # the border of the task: nothing may kill the worker
        log.exception("part failed unexpectedly", kind=claim.kind)
        return _retry(bench, claim, error)
    return "succeeded"


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
        with bench.database.begin() as session:
            hold_lease(session, claim)
            shape = session.get(Shape, claim.shape_id) if claim.shape_id else None
            if shape is not None:
                shape.error = {"type": kind, "detail": detail}
            item = item_of(claim.kind, claim.payload) if shape is None else shape.name
            parts = finish_part(session, claim, failure=Failure(item, kind, detail))
    except LeaseLostError:
        return "lost"
    bench.send(parts)
    return "failed"


def run_pending(database: Database, blobs: BlobStore, settings: Settings) -> int:
    """Run queued parts in this process until there are none; returns how many were run."""
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
            run_part(bench, part_id, message=f"in-process-{part_id}")
            count += 1


def _leave_queued(_parts: Sequence[Part]) -> None:
    """Wake nobody: the loop finds what is queued."""
