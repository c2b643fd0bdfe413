"""Small shapes of one upload, several at once: one claim, one transaction that stores them.

A tiny mesh is computed in a fraction of a second. Claiming and storing each by itself would be
two more transactions, each of which waits for the disk. Decision 33 has the reasons and figures.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import structlog

from workers.pipeline.outcome import Outcome
from workers.pipeline.workbench import Workbench
from workers.storage.parts import Claim
from workers.storage.several_parts import Share, give_back, is_held

log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class Bulk:
    """How many small shapes are ingested at once.

    Attributes
    ----------
    parts : int
        At most so many.
    n_bytes : int
        Their files have at most so many bytes together: those of a mesh of 5,000 vertices, about.
    shares : int
        Every process of the worker takes its part of what waits in so many claims or more.
    seconds : float
        Those that are not begun by then are given back.
    """

    parts: int = 16
    n_bytes: int = 256 << 10
    shares: int = 4
    seconds: float = 5.0

    def share(self, processes: int) -> Share:
        """What one process claims.

        Parameters
        ----------
        processes : int
            How many processes the worker has.

        Returns
        -------
        Share
            For `claim_more`.
        """
        return Share(self.parts, self.n_bytes, self.shares * processes)


BULK = Bulk()
INGESTED = "ingest"
"""The kind of parts that are claimed several at once."""


def in_turn(
    bench: Workbench,
    claims: Sequence[Claim],
    compute: Callable[[Claim], Outcome | None],
    *,
    seconds: float,
) -> list[tuple[Claim, Outcome]]:
    """Compute claimed parts one after another; give back what is not begun in time.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claims : sequence of Claim
        Parts of one job.
    compute : callable
        Computes one of them; None if the part has ended without anything to store.
    seconds : float
        Time for all of them, from now on. What has begun is finished.

    Returns
    -------
    list of (Claim, Outcome)
        What is to be stored.
    """
    started, found = time.monotonic(), []
    for number, claim in enumerate(claims):
        if number and time.monotonic() - started > seconds:
            _give_back(bench, claims[number:])
            break
        if number and not _is_held(bench, claim):  # its job was cancelled, or its lease ran out
            log.info("part left alone, it is no longer held", part=claim.part_id)
            continue
        outcome = compute(claim)
        if outcome is not None:
            found.append((claim, outcome))
    return found


def _give_back(bench: Workbench, claims: Sequence[Claim]) -> None:
    """Put parts back into the queue, and wake workers for them: their messages may be gone."""
    with bench.database.begin() as session:
        parts = give_back(session, claims, now=time.time())
    bench.send(parts)


def _is_held(bench: Workbench, claim: Claim) -> bool:
    with bench.database.read() as session:
        return is_held(session, claim)
