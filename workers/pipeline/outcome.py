"""What a verb gives back: what to store, what failed, what follows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from sqlalchemy.orm import Session

from workers.pipeline.workbench import Workbench
from workers.storage.jobs import NewPart, Skipped
from workers.storage.models import Job
from workers.storage.parts import Claim, Failure


@dataclass(frozen=True)
class Outcome:
    """The end of a part, not stored yet; `workers.pipeline.commit` stores it.

    Attributes
    ----------
    store : callable, optional
        Writes the result. It runs in the transaction that ends the part, after the rows of the job
        and of the part were locked, and takes its own locks in the order collection, shape,
        counter. What it returns takes the place of this outcome: another `Outcome` if what failed
        or follows depends on the rows that it locked, `GoOn` if something is still missing.
    failures : sequence of Failure
        Items of this part that failed. Its weight counts them already; the part has succeeded.
    skipped : sequence of Skipped
        Files of an upload that are no meshes; no progress counts them.
    follow_up : sequence of NewPart
        Parts to be queued.
    finale : NewPart, optional
        The part that runs once all others have ended; it replaces the job's finale.
    again : sequence of str
        Ids of parts of this job that have ended and are to be done once more.
    obsolete : sequence of str
        Keys of blobs that nobody needs once this is committed; they are deleted after it.
    """

    store: "Store | None" = None
    failures: Sequence[Failure] = ()
    skipped: Sequence[Skipped] = ()
    follow_up: Sequence[NewPart] = ()
    finale: NewPart | None = None
    again: Sequence[str] = ()
    obsolete: Sequence[str] = ()


@dataclass(frozen=True)
class GoOn:
    """The part does not end yet: `store` has written nothing, and something is still missing.

    Attributes
    ----------
    compute : callable
        Computes the rest outside of the transaction, and returns the outcome that is stored next.
    """

    compute: Callable[[], Outcome]


Store: TypeAlias = Callable[[Session, Job], Outcome | GoOn | None]
Verb: TypeAlias = Callable[[Workbench, Claim], Outcome]
