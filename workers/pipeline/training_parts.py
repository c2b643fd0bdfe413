"""What trainings have in common: parts that are kept by content, and a fit once all have ended."""

import json
import time
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from numpy.typing import NDArray
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from workers.errors import (
    BlobNotFoundError,
    InsufficientTrainingDataError,
    InvalidMeshError,
    InvalidRequestError,
    KernelDomainError,
    ModelNotReadyError,
    SpectrumError,
)
from workers.pipeline.workbench import Workbench
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import failure_key, training_key
from workers.storage.jobs import OPEN, NewPart, part_to_json
from workers.storage.models import Json, Part, TrainedModel
from workers.storage.parts import Claim, Failure, finish_part, hold_lease, report_failures
from workers.storage.trained_models import READY, get_training

OWN_REASONS = (
    InsufficientTrainingDataError,
    InvalidMeshError,
    InvalidRequestError,
    KernelDomainError,
    SpectrumError,
)
"""Why a pair or a variant may fail again and again: the training goes on without it."""

PAIR, VARIANT = "pair", "variant"
"""Kinds of parts that models are learned from."""

Arrays = Mapping[str, NDArray[Any]]


class Planned(Protocol):
    """A pair or a variant: what a training has one part of."""

    @property
    def number(self) -> int:
        """Place in the plan."""

    @property
    def item(self) -> str:
        """What people call it."""

    @property
    def key(self) -> str:
        """Digest of all that what is computed of it depends on."""


P = TypeVar("P", bound=Planned)


@dataclass(frozen=True, eq=False)
class Material(Generic[P]):
    """What there is to learn from, in the order of the plan.

    Attributes
    ----------
    planned : sequence of Planned
        Those of which something is stored.
    arrays : sequence of Arrays
        What is stored of each of them.
    failures : sequence of Failure
        Of the others.
    missing : frozenset of int
        Numbers of those of which nothing is stored.
    """

    planned: Sequence[P]
    arrays: Sequence[Arrays]
    failures: Sequence[Failure]
    missing: frozenset[int]

    def failures_told(self, kind: str) -> Json:
        """What the report of a training says of them."""
        return {
            f"n_failed_{kind}s": len(self.failures),
            f"failed_{kind}s": [dict(vars(failure)) for failure in self.failures],
        }


def compute_kept(
    bench: Workbench, claim: Claim, kind: str, planned: Planned, compute: Callable[[], Arrays]
) -> None:
    """Store what is computed of a pair or variant, unless it is there; one that fails is named."""
    failures = []
    try:
        if not bench.blobs.exists(training_key(kind, planned.key)):
            bench.blobs.put(training_key(kind, planned.key), pack(compute()))
    except OWN_REASONS as error:
        failure = Failure(planned.item, error.kind, str(error))
        bench.blobs.put(failure_key(kind, planned.key), json.dumps(vars(failure)).encode())
        failures.append(failure)
    with bench.database.begin() as session:
        report_failures(session, claim, failures, are_counted=True)
        parts = finish_part(session, claim)
    bench.send(parts)


def load_kept(bench: Workbench, kind: str, planned: Planned) -> Arrays | Failure:
    """Return what is stored of a pair or variant, or the reason why there is nothing.

    Raises
    ------
    BlobNotFoundError
        It was not computed.
    """
    try:
        return unpack(bench.blobs.get(training_key(kind, planned.key)))
    except BlobNotFoundError:
        reason = json.loads(bench.blobs.get(failure_key(kind, planned.key)))
        return Failure(planned.item, reason["type"], reason["detail"])


def fit_model(
    bench: Workbench,
    claim: Claim,
    kind: str,
    read: Callable[[Mapping[str, Any]], P],
    finale: NewPart,
    define: Callable[[TrainedModel, Material[P]], Json],
) -> None:
    """Learn from all parts of a kind once they have ended; the model is then ready.

    After a retry this may be called while parts are still computed, or what is stored of some may
    be of an older version: then these are computed first, and it comes again.

    Parameters
    ----------
    read : callable
        From a part's payload to what is planned.
    finale : NewPart
        This one, to come again.
    define : callable
        From the row of the model that is asked for and the material to its definition.

    Raises
    ------
    ModelNotReadyError
        Parts were lost, so that a retry would give another model than this.
    InsufficientTrainingDataError
        All of them failed.
    ModelNotFoundError
        The model was deleted.
    """
    name = claim.payload["model"]
    payloads = _ended_payloads(bench, claim, kind, finale)
    if payloads is None:
        return
    with bench.database.read() as session:
        asked = get_training(session, name, job_id=claim.job_id)
    material = _gather(bench, kind, [read(payload) for payload in payloads])
    if material.missing:
        _compute_again(bench, claim, kind, material.missing, finale)
        return
    if not material.planned:
        first = material.failures[0]
        raise InsufficientTrainingDataError(
            f"all {len(material.failures)} {kind}s failed; the first, {first.item}: {first.detail}"
        )
    definition = _finite(define(asked, material))
    with bench.database.begin() as session:
        hold_lease(session, claim)
        row = get_training(session, name, job_id=claim.job_id)
        row.definition, row.state = definition, READY
        parts = finish_part(session, claim)
    bench.send(parts)


def _gather(bench: Workbench, kind: str, planned: Sequence[P]) -> Material[P]:
    """Read what is stored of each."""
    there: list[P] = []
    arrays: list[Arrays] = []
    failures: list[Failure] = []
    missing: set[int] = set()
    for one in planned:
        try:
            found = load_kept(bench, kind, one)
        except BlobNotFoundError:
            missing.add(one.number)
            continue
        if isinstance(found, Failure):
            failures.append(found)
        else:
            there.append(one)
            arrays.append(found)
    return Material(there, arrays, failures, frozenset(missing))


def _ended_payloads(
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


def _compute_again(
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


def _finite(definition: Json) -> Json:
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
