"""The order in which descriptors changed, as every replica sees it.

The number is drawn from a counter row inside the committing transaction. The lock of that row is
held until the commit, so the order of numbers is the order of commits. A reader that has seen
number n has seen all below it. A database sequence does not give that.

A deletion is a change too. Its row is pruned after some days. The newest one that was pruned is
noted for each (collection, model). A reader that has not come so far reads everything again.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import delete, func, insert, select, tuple_, update
from sqlalchemy.orm import Session

from workers.storage.models import (
    FEEDS,
    Collection,
    Counter,
    Descriptor,
    PrunedChange,
    Signature,
)

CHANGE = "change"
"""Name of the counter of changes."""


@dataclass(frozen=True)
class Change:
    """One descriptor's newest state; ``vector`` is None where the shape was deleted."""

    number: int
    shape_id: str
    vector: bytes | None


def ensure_counter(session: Session, name: str = CHANGE, *, value: int = 0) -> None:
    """Make a counter's row if it is missing.

    Parameters
    ----------
    session : Session
        That writes.
    name : str
        Of the counter.
    value : int
        Where it starts.
    """
    if session.get(Counter, name) is None:
        session.execute(insert(Counter).values(name=name, value=value))


def next_change(session: Session) -> int:
    """Draw the next number; call it as late in the transaction as can be.

    Parameters
    ----------
    session : Session
        That writes; others wait for the number until it commits.

    Returns
    -------
    A number above all that were drawn before.
    """
    raised = update(Counter).where(Counter.name == CHANGE).values(value=Counter.value + 1)
    return session.execute(raised.returning(Counter.value)).scalar_one()


def changes_after(
    session: Session,
    *,
    collection_id: str,
    model: str,
    number: int,
    feed: type[Descriptor | Signature] = Descriptor,
) -> Iterator[Change]:
    """Changes of one (collection, model) above a number, in order, streamed.

    Parameters
    ----------
    session : Session
        That reads.
    collection_id : str
        Id of the collection.
    model : str
        Name of the model.
    number : int
        The last change that was seen; 0 for all.
    feed : type
        The table.

    Yields
    ------
    Each descriptor once, in its newest state. Where ``number`` is above 0 and below
    ``pruned_up_to``, deletions are missing: then read all, from 0.
    """
    rows = session.execute(
        select(feed.change, feed.shape_id, feed.vector)
        .where(
            feed.collection_id == collection_id,
            feed.model == model,
            feed.change > number,
        )
        .order_by(feed.change, feed.shape_id),
        execution_options={"yield_per": 5000},
    )
    for row in rows:
        yield Change(*row)


def pruned_up_to(session: Session, *, collection_id: str, model: str) -> int:
    """Number of the newest deletion that was pruned.

    Parameters
    ----------
    session : Session
        Ask after the changes were read, not before: a deletion that was pruned between the two
        is then noticed.
    collection_id : str
        Id of the collection.
    model : str
        Name of the model.

    Returns
    -------
    0 if none was.
    """
    row = session.get(PrunedChange, (collection_id, model), populate_existing=True)
    return 0 if row is None else row.change


def count_deletions(session: Session, before: float) -> int:
    """How many deletions are older than a time.

    Parameters
    ----------
    session : Session
        That reads.
    before : float
        Seconds since 1970.

    Returns
    -------
    Rows of the change feeds.
    """
    counts = (
        select(func.count()).select_from(feed).where(feed.deleted_at < before) for feed in FEEDS
    )
    return sum(session.scalar(count) or 0 for count in counts)


def prune_deletions(session: Session, before: float, *, limit: int) -> int:
    """Remove old deletions from the change feeds, and note the newest of them.

    Parameters
    ----------
    session : Session
        That writes.
    before : float
        Those older than this go, in seconds since 1970.
    limit : int
        At most so many of each feed.

    Returns
    -------
    How many went.
    """
    gone = [row for feed in FEEDS for row in _prune(session, feed, before, limit)]
    newest: dict[tuple[str, str], int] = {}
    for collection_id, model, change in gone:
        newest[collection_id, model] = max(change, newest.get((collection_id, model), 0))
    for (collection_id, model), change in sorted(newest.items()):
        there = select(Collection.id).where(Collection.id == collection_id)
        if session.scalar(there.with_for_update(read=True)) is not None:
            row = session.get(PrunedChange, (collection_id, model), with_for_update=True)
            if row is None:
                session.add(PrunedChange(collection_id=collection_id, model=model, change=change))
            else:
                row.change = max(row.change, change)
    session.flush()
    return len(gone)


def _prune(
    session: Session, feed: type[Descriptor | Signature], before: float, limit: int
) -> list[tuple[str, str, int]]:
    """Remove old deletions from one feed: collection, model and number of each."""
    key = (feed.shape_id, feed.model)
    old = select(*key).where(feed.deleted_at < before).limit(limit)
    gone = session.execute(
        delete(feed)
        .where(tuple_(*key).in_(old), feed.deleted_at < before)
        .returning(feed.collection_id, feed.model, feed.change)
        .execution_options(synchronize_session=False)
    )
    return [(str(row[0]), str(row[1]), int(row[2])) for row in gone]
