"""What trainings have in common: parts that all must have ended; some are computed again."""

import json
import time
from collections.abc import Mapping, Set
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from workers.errors import KernelDomainError, ModelNotReadyError
from workers.pipeline.workbench import Workbench
from workers.storage.jobs import OPEN, NewPart, part_to_json
from workers.storage.models import Json, Part
from workers.storage.parts import Claim, finish_part, hold_lease


def ended_payloads(
    bench: Workbench, claim: Claim, kind: str, finale: NewPart
) -> list[Mapping[str, Any]] | None:
    """Payloads of the job's parts of a kind in the order of the plan.

    None while one of them is open: then the finale comes again after it.

    Raises
    ------
    ModelNotReadyError
        Parts were lost, so that a retry would give another model than this.
    """
    with bench.database.begin() as session:
        job = hold_lease(session, claim)
        states = _states(session, claim.job_id, kind)
        if any(states.get(state) for state in OPEN):
            job.finale = part_to_json(finale)
            finish_part(session, claim)  # sends nothing: parts are open
            return None
        rows = session.scalars(_parts(claim.job_id, kind).with_only_columns(Part.payload)).all()
    lost = sum(states.values()) - states.get("succeeded", 0)
    if lost:
        raise ModelNotReadyError(
            f"{lost} of {len(rows)} {kind}s were not computed, so nothing is learned from the "
            "others; retry the job"
        )
    return sorted(rows, key=lambda payload: int(payload["number"]))


def compute_again(
    bench: Workbench, claim: Claim, kind: str, numbers: Set[int], finale: NewPart
) -> None:
    """Queue parts of a kind once more, up to their last attempt, and the finale after them."""
    with bench.database.begin() as session:
        job = hold_lease(session, claim)
        parts = session.scalars(_parts(claim.job_id, kind).order_by(Part.id).with_for_update())
        again = [part for part in parts if part.payload["number"] in numbers]
        for part in again:
            part.state, part.sent_at = "queued", time.time()
            job.done -= part.weight
        job.finale = part_to_json(finale)
        finish_part(session, claim)
    bench.send(again)


def finite_json(definition: Json) -> Json:
    """Return a learned model's definition, unless it has a number that is not finite.

    Raises
    ------
    KernelDomainError
        It has one.
    """
    try:
        json.dumps(definition, allow_nan=False)
    except ValueError as error:
        raise KernelDomainError("the learned model has a number that is not finite") from error
    return definition


def _parts(job_id: str, kind: str) -> Any:
    return select(Part).where(Part.job_id == job_id, Part.kind == kind)


def _states(session: Session, job_id: str, kind: str) -> dict[str, int]:
    """How many parts of a kind are in which state."""
    counted = _parts(job_id, kind).with_only_columns(Part.state, func.count())
    return {state: count for state, count in session.execute(counted.group_by(Part.state))}
