"""What trainings have in common: parts that are kept by content, and a fit once all have ended."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
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
from workers.pipeline.outcome import Outcome
from workers.pipeline.workbench import Workbench
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import failure_key, training_key
from workers.storage.jobs import OPEN, NewPart
from workers.storage.models import Job, Json, Part, TrainedModel
from workers.storage.parts import Claim, Failure
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
    bench: Workbench, kind: str, planned: Planned, compute: Callable[[], Arrays]
) -> Outcome:
    """Store what is computed of a pair or variant, unless it is there; one that fails is named."""
    try:
        if not bench.blobs.exists(training_key(kind, planned.key)):
            bench.blobs.put(training_key(kind, planned.key), pack(compute()))
    except OWN_REASONS as error:
        failure = Failure(planned.item, error.kind, str(error))
        bench.blobs.put(failure_key(kind, planned.key), json.dumps(vars(failure)).encode())
        return Outcome(failures=[failure])
    return Outcome()


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
) -> Outcome:
    """Learn from all parts of a kind once they have ended; the model is then ready.

    After a retry this may run while parts are still computed, or what is stored of some may be of
    an older version: then these are computed first, and this runs again.

    Parameters
    ----------
    bench : Workbench
    claim : Claim
        Its payload names the model.
    kind : str
        PAIR or VARIANT.
    read : callable
        From a part's payload to what is planned.
    finale : NewPart
        This part, to run again.
    define : callable
        From the row of the model that is asked for and the material to its definition.

    Returns
    -------
    Outcome
        Stores the model; or has parts computed again, with this as the finale.

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
    with bench.database.read() as session:
        states = _states(session, claim.job_id, kind)
        if states.keys() & set(OPEN):
            return Outcome(finale=finale)
        rows = session.execute(_parts(claim.job_id, kind).with_only_columns(Part.id, Part.payload))
        parts = sorted(rows, key=lambda row: int(row.payload["number"]))
        asked = get_training(session, name, job_id=claim.job_id)
    _require_all(states, kind)
    material = _gather(bench, kind, [read(part.payload) for part in parts])
    if material.missing:
        again = [part.id for part in parts if part.payload["number"] in material.missing]
        return Outcome(again=again, finale=finale)
    if not material.planned:
        first = material.failures[0]
        raise InsufficientTrainingDataError(
            f"all {len(material.failures)} {kind}s failed; the first, {first.item}: {first.detail}"
        )
    definition = _finite(define(asked, material))
    return Outcome(store=partial(_store, name, definition))


def _store(name: str, definition: Json, session: Session, job: Job) -> None:
    """Make the model ready, unless it was deleted."""
    row = get_training(session, name, job_id=job.id)
    row.definition, row.state = definition, READY


def _require_all(states: Mapping[str, int], kind: str) -> None:
    """Refuse to learn where parts were lost: a retry would give another model."""
    total = sum(states.values())
    lost = total - states.get("succeeded", 0)
    if lost:
        raise ModelNotReadyError(
            f"{lost} of {total} {kind}s were not computed, so nothing is learned from the "
            "others; retry the job"
        )


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
