"""The order in which descriptors changed, as every replica sees it.

The number is drawn from a counter row inside the committing transaction: its row lock is held
until the commit, so that the order of numbers is the order of commits and a reader that has
seen number n has seen all below it. A database sequence does not give that.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import insert, select, update
from sqlalchemy.orm import Session

from workers.storage.models import Counter, Descriptor

CHANGE = "change"


@dataclass(frozen=True)
class Change:
    """One descriptor's newest state; ``vector`` is None where the shape was deleted."""

    number: int
    shape_id: str
    vector: bytes | None


def ensure_counter(session: Session) -> None:
    """Make the counter's row if it is missing."""
    if session.get(Counter, CHANGE) is None:
        session.execute(insert(Counter).values(name=CHANGE, value=0))


def next_change(session: Session) -> int:
    """Draw the next number; call it as late in the transaction as can be."""
    raised = update(Counter).where(Counter.name == CHANGE).values(value=Counter.value + 1)
    return session.execute(raised.returning(Counter.value)).scalar_one()


def changes_after(
    session: Session, *, collection_id: str, model: str, number: int
) -> Iterator[Change]:
    """Changes of one (collection, model) above a number, in order, streamed."""
    rows = session.execute(
        select(Descriptor.change, Descriptor.shape_id, Descriptor.vector)
        .where(
            Descriptor.collection_id == collection_id,
            Descriptor.model == model,
            Descriptor.change > number,
        )
        .order_by(Descriptor.change, Descriptor.shape_id),
        execution_options={"yield_per": 5000},
    )
    for row in rows:
        yield Change(*row)
