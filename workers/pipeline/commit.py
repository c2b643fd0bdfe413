"""The one place that ends a part of a job: it holds the lease, stores, finishes and sends.

One transaction stores the result and ends the part, so a crash leaves either both or neither.
The order of its locks is job, part, collection, shape, counter.
"""

from collections.abc import Sequence

import structlog
from sqlalchemy.orm import Session

from workers.pipeline.outcome import GoOn, Outcome
from workers.pipeline.workbench import Workbench
from workers.storage.models import Job, Part, Shape
from workers.storage.parts import Claim, Failure, finish_part, hold_lease, item_of
from workers.storage.several_parts import hold_leases

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
    _follow_up(bench, *ended)


def commit_together(bench: Workbench, ended: Sequence[tuple[Claim, Outcome]]) -> bool:
    """Store the outcomes of several parts of one job, and end them, in one transaction.

    It is for the plain case. If a part is no longer held, if it needs another model by then or if
    anything else is in its way, nothing is stored, and `commit` is to be called for each alone.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    ended : sequence of (Claim, Outcome)
        Parts of shapes, all of one job, with what their verbs returned.

    Returns
    -------
    bool
        Whether all is stored.
    """
    queued: list[Part] = []
    obsolete: list[str] = []
    try:
        with bench.database.begin() as session:
            job = hold_leases(session, [claim for claim, _ in ended])
            for claim, outcome in ended:
                found = _store_and_finish(session, job, claim, outcome)
                if isinstance(found, GoOn):
                    raise _NotTogether
                queued += found[0]
                obsolete += found[1]
    except _NotTogether:
        return False
    except Exception as error:  # whatever it is: alone, that part ends with its own reason
        log.info("parts are stored one by one", parts=len(ended), reason=repr(error)[:200])
        return False
    _follow_up(bench, queued, obsolete)
    return True


class _NotTogether(Exception):
    """Rolls back what several parts have stored: one of them goes on."""


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
        return _store_and_finish(session, hold_lease(session, claim), claim, outcome)


def _store_and_finish(
    session: Session, job: Job, claim: Claim, outcome: Outcome
) -> tuple[list[Part], Sequence[str]] | GoOn:
    """The same within a transaction that holds the lease."""
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


def _follow_up(bench: Workbench, parts: Sequence[Part], obsolete: Sequence[str]) -> None:
    """After the commit: send what was queued, and delete what nobody needs."""
    bench.send(parts)
    for key in obsolete:
        try:
            bench.blobs.delete(key)
        except OSError as error:  # the part has ended: a store that is away fails nothing
            log.warning("blob not deleted", key=key, error=str(error)[:200])
