"""Which contents rows refer to, and the lock that keeps a new reference and a deletion apart.

A blob is stored before the row that refers to it is committed. So a transaction that makes a
reference calls ``hold_blobs`` and looks whether the blob is still there. One that deletes a blob
calls ``lock_blobs`` and looks whether a row refers to it by now. One of the two then waits for the
other, and sees what it did.
"""

import re
from collections.abc import Collection as Members
from collections.abc import Iterator
from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from workers.storage.models import Counter, Job, Part, Query, Shape

BLOBS = "blobs"
"""Name of the counter whose row is that lock; its value means nothing."""

SHA256 = re.compile(r"[0-9a-f]{64}")
CHUNK = 500


def hold_blobs(session: Session) -> None:
    """Let no blob be deleted until the commit; many may hold them at once.

    Parameters
    ----------
    session : Session
        That writes. On SQLite it excludes all other writers anyway.
    """
    session.execute(_row().with_for_update(read=True))


def lock_blobs(session: Session) -> None:
    """Let nobody refer to a blob until the commit.

    Parameters
    ----------
    session : Session
        That writes.
    """
    session.execute(_row().with_for_update())


def referred(session: Session, contents: Members[str]) -> set[str]:
    """Those of some contents that a shape or a query has.

    Parameters
    ----------
    session : Session
        That reads.
    contents : collection of str
        Hashes (SHA-256) of uploaded files.

    Returns
    -------
    The hashes that rows of shapes or queries hold.
    """
    found: set[str] = set()
    wanted = sorted(contents)
    for start in range(0, len(wanted), CHUNK):
        chunk = wanted[start : start + CHUNK]
        for column in (Shape.sha256, Query.sha256):
            found |= set(session.scalars(select(column).where(column.in_(chunk)).distinct()))
    return found


def contents_of_parts(session: Session, *, after: str = "") -> set[str]:
    """Contents that work may still read: of jobs that are not done, or that can be retried.

    Parameters
    ----------
    session : Session
        That reads.
    after : str
        Only of parts whose ids are above this one: ids sort by time.

    Returns
    -------
    Hashes (SHA-256) that stand as ``sha256`` in the payloads of parts.
    """
    retryable = or_(Job.state != "succeeded", Part.state.in_(("failed", "cancelled")))
    payloads = session.scalars(
        select(Part.payload).join(Job, Job.id == Part.job_id).where(Part.id > after, retryable),
        execution_options={"yield_per": 1000},
    )
    return {content for payload in payloads for content in _contents(payload)}


def _row() -> Any:
    return select(Counter.value).where(Counter.name == BLOBS)


def _contents(value: Any) -> Iterator[str]:
    """Hashes in a payload, at any depth."""
    if isinstance(value, dict):
        for name, inner in value.items():
            if name == "sha256" and isinstance(inner, str) and SHA256.fullmatch(inner):
                yield inner
            else:
                yield from _contents(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _contents(inner)
