"""The one place that ends a part of a job: it holds the lease, stores, finishes and sends.

One transaction stores the result and ends the part, so a crash leaves either both or neither.
The order of its locks is job, part, collection, shape, counter.
"""

from collections.abc import Sequence

import structlog

from workers.pipeline.outcome import GoOn, Outcome
from workers.pipeline.workbench import Workbench
from workers.storage.models import Part, Shape
from workers.storage.parts import Claim, Failure, finish_part, hold_lease, item_of

log = structlog.get_logger(__name__)


def commit(bench: Workbench, claim: Claim, outcome: Outcome) -> None:
    """Store an outcome and end its part; then send what follows, and delete what is obsolete.

    A crash after the transaction loses nothing: the sweeper sends parts that wait for too long,
    and a blob that was not deleted only takes space.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        The part that this worker holds.
    outcome : Outcome
        What its verb returned.

    Raises
    ------
    LeaseLostError
        Another worker holds the part now, or its job was cancelled; nothing is stored.
    ProteusError
        The outcome cannot be stored, see its verb; nothing is stored.
    """
    while True:
        ended = _end_part(bench, claim, outcome)
        if not isinstance(ended, GoOn):
            break
        outcome = ended.compute()
    parts, obsolete = ended
    bench.send(parts)
    for key in obsolete:
        try:
            bench.blobs.delete(key)
        except OSError as error:  # the part has ended: a store that is away fails nothing
            log.warning("blob not deleted", key=key, error=str(error)[:200])


def commit_failure(bench: Workbench, claim: Claim, kind: str, detail: str) -> None:
    """End a part that failed, name it in its job, and mark its shape if it has one.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        The part that this worker holds.
    kind, detail : str
        Type of the error, and what was found.

    Raises
    ------
    LeaseLostError
        Another worker holds the part now, or its job was cancelled; nothing is stored.
    """
    with bench.database.begin() as session:
        hold_lease(session, claim)
        shape = session.get(Shape, claim.shape_id) if claim.shape_id else None
        if shape is not None:
            shape.error = {"type": kind, "detail": detail}
        item = item_of(claim.kind, claim.payload) if shape is None else shape.path
        parts = finish_part(session, claim, failure=Failure(item, kind, detail))
    bench.send(parts)


def _end_part(
    bench: Workbench, claim: Claim, outcome: Outcome
) -> tuple[list[Part], Sequence[str]] | GoOn:
    """Parts to send and blobs to delete, once all is committed; or what is still missing."""
    with bench.database.begin() as session:
        job = hold_lease(session, claim)
        if outcome.store is not None:
            decided = outcome.store(session, job)
            if isinstance(decided, GoOn):
                return decided
            outcome = outcome if decided is None else decided
        parts = finish_part(
            session,
            claim,
            failed_items=outcome.failures,
            skipped=outcome.skipped,
            follow_up=outcome.follow_up,
            finale=outcome.finale,
            again=outcome.again,
        )
    return parts, outcome.obsolete
