"""What the last part of every training does: gather what was computed, learn, make the model."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from workers.errors import (
    BlobNotFoundError,
    InsufficientTrainingDataError,
    KernelDomainError,
    ModelNotReadyError,
)
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import LEARNING
from workers.pipeline.training.results import Arrays, load_result
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import BlobStore
from workers.storage.jobs import OPEN, NewPart
from workers.storage.models import Job, Json, Part, TrainedModel
from workers.storage.parts import Claim, Failure
from workers.storage.trained_models import READY, get_training
from workers.training.examples import Example

E = TypeVar("E", bound=Example)


@dataclass(frozen=True, eq=False)
class Material(Generic[E]):
    """What there is to learn from, in the order of the examples' numbers.

    Attributes
    ----------
    examples : sequence of Example
        Those of which something is stored.
    arrays : sequence of mapping
        What is stored of each of them.
    failures : sequence of Failure
        Of examples that failed.
    missing : frozenset of int
        Numbers of examples of which nothing is stored.
    """

    examples: Sequence[E]
    arrays: Sequence[Arrays]
    failures: Sequence[Failure]
    missing: frozenset[int]

    def only(self, chosen: Callable[[E], bool]) -> "Material[E]":
        """Some of the examples; failures stay with the whole.

        Parameters
        ----------
        chosen : callable
            Whether an example is among them.

        Returns
        -------
        Material
            In the same order.
        """
        pairs = list(zip(self.examples, self.arrays, strict=True))
        kept = [(example, arrays) for example, arrays in pairs if chosen(example)]
        return Material([e for e, _ in kept], [a for _, a in kept], (), frozenset())

    def failure_report(self, kind: str) -> Json:
        """Return what the report of a training says of the examples that failed.

        Parameters
        ----------
        kind : str
            Of the examples.

        Returns
        -------
        dict
            Their number, and each with its reason.
        """
        return {
            f"n_failed_{kind}s": len(self.failures),
            f"failed_{kind}s": [dict(vars(failure)) for failure in self.failures],
        }


def fit_model(
    bench: Workbench,
    claim: Claim,
    examples: type[E],
    finale: NewPart,
    define: Callable[[TrainedModel, Material[E]], Json],
) -> Outcome:
    """Learn from all examples of a job once their parts have ended; the model is then ready.

    After a retry, this may run while parts are still computed. After an update of the program,
    nothing may be stored of some parts. Both are computed first, and then this runs again.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the model.
    examples : type of Example
        What the job's parts compute: `Pair` or `Variant`.
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
    name, kind = claim.payload["model"], examples.kind
    bench.progress.enter(LEARNING)
    with bench.database.read() as session:
        states = _states(session, claim.job_id, kind)
        if states.keys() & set(OPEN):
            return Outcome(finale=finale)
        rows = session.execute(_parts(claim.job_id, kind).with_only_columns(Part.id, Part.payload))
        parts = sorted(rows, key=lambda row: int(row.payload["number"]))
        asked = get_training(session, name, job_id=claim.job_id)
    _require_all(states, kind)
    material = gather(bench.blobs, [examples.from_payload(part.payload) for part in parts])
    if material.missing:
        again = [part.id for part in parts if part.payload["number"] in material.missing]
        return Outcome(again=again, finale=finale)
    if not material.examples:
        first = material.failures[0]
        raise InsufficientTrainingDataError(
            f"all {len(material.failures)} {kind}s failed; the first, {first.item}: {first.detail}"
        )
    definition = _finite(define(asked, material))
    return Outcome(store=partial(_store, name, definition))


def gather(blobs: BlobStore, examples: Sequence[E]) -> Material[E]:
    """Read what is stored of each example.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    examples : sequence of Example
        In the order of their numbers.

    Returns
    -------
    Material
    """
    there: list[E] = []
    arrays: list[Arrays] = []
    failures: list[Failure] = []
    missing: set[int] = set()
    for example in examples:
        try:
            found = load_result(blobs, example)
        except BlobNotFoundError:
            missing.add(example.number)
            continue
        if isinstance(found, Failure):
            failures.append(found)
        else:
            there.append(example)
            arrays.append(found)
    return Material(there, arrays, failures, frozenset(missing))


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


def _finite(definition: Json) -> Json:
    """Return a learned model's definition, unless it has a number that is not finite."""
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
