"""A mesh that takes longer than its share of time fails for that, at once."""

from dataclasses import replace
from typing import Any

from sqlalchemy.orm import Session

from workers.errors import TimeLimitError
from workers.pipeline.commit import commit_failure
from workers.pipeline.workbench import Workbench
from workers.storage.jobs import NewPart
from workers.storage.models import Part, Shape
from workers.storage.parts import Claim, Failure, LeaseLostError, finish_part, hold_lease
from workers.storage.watching import claim_of


def fail_overtime(
    bench: Workbench, part_id: str, owner: str, *, shape_id: str | None, step: str
) -> bool:
    """Fail what took too long, for good: it would take as long again.

    Afterwards the worker that is at it can store nothing. In a part of several shapes only the
    one whose turn it was fails; the others are queued again.

    Parameters
    ----------
    bench : Workbench
        Rows, settings, and how parts are sent.
    part_id, owner : str
        Id of the part, and what its claim drew.
    shape_id : str or None
        The shape whose turn it is, in a part of several.
    step : str
        What was being done; the message names it.

    Returns
    -------
    bool
        False if the claim stood no longer: then nothing has changed.
    """
    with bench.database.read() as session:
        claim = claim_of(session, part_id, owner)
    if claim is None:
        return False
    error = TimeLimitError(
        f"was still at {step!r} after {bench.settings.shape_seconds:g} s, the limit that "
        "PROTEUS_SHAPE_SECONDS sets"
    )
    try:
        if shape_id is None:
            commit_failure(bench, claim, error.kind, str(error))
        else:
            _fail_one(bench, claim, shape_id, error)
    except LeaseLostError:
        return False
    return True


def _fail_one(bench: Workbench, claim: Claim, shape_id: str, error: TimeLimitError) -> None:
    """Fail one shape of a part of several, and queue the others as a part of their own."""
    with bench.database.begin() as session:
        job = hold_lease(session, claim)
        part = session.get_one(Part, claim.part_id)
        others = [i for i in claim.payload["shape_ids"] if i != shape_id]
        rest = _part_of(part, others, weight=min(len(others), part.weight)) if others else None
        if rest is not None:
            part.payload = {**part.payload, "shape_ids": [shape_id]}
            part.weight -= rest.weight
            job.total -= rest.weight  # queued below, it counts again
        failure = _failure_of(session, shape_id, claim.payload, error)
        follow_up = [] if rest is None else [rest]
        session.flush()
        parts = finish_part(session, claim, failed_items=[failure], follow_up=follow_up)
    bench.send(parts)


def _part_of(part: Part, shape_ids: list[str], *, weight: int) -> NewPart:
    whole = NewPart(part.kind, part.queue, part.payload, part.weight)
    return replace(whole, payload={**part.payload, "shape_ids": shape_ids}, weight=weight)


def _failure_of(session: Session, shape_id: str, payload: Any, error: TimeLimitError) -> Failure:
    """What the job says of a shape; the shape says it too where its part marks shapes."""
    shape = session.get(Shape, shape_id)
    if shape is not None and payload.get("marks_shapes", True):
        shape.error = {"type": error.kind, "detail": str(error)}
    return Failure(shape_id if shape is None else shape.path, error.kind, str(error))
