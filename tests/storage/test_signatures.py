"""The feed of signatures, beside that of descriptors: stored, deleted and pruned with them."""

import time

import pytest
from sqlalchemy import func, select

from tests.storage.rows import make_collection, make_model, make_shape
from workers.storage.change_feed import (
    changes_after,
    count_deletions,
    prune_deletions,
    pruned_up_to,
)
from workers.storage.collections import delete_collection
from workers.storage.database import Database
from workers.storage.descriptors import mark_deleted, store_descriptors
from workers.storage.models import Counter, Descriptor, Signature
from workers.storage.shapes import delete_shape
from workers.storage.trained_models import delete_model

Feed = type[Descriptor] | type[Signature]
BOTH = pytest.mark.parametrize("table", [Descriptor, Signature])


def feed(
    database: Database, collection: str, table: Feed, *, number: int = 0, model: str = "heat"
) -> list[tuple[int, str, bytes | None]]:
    with database.read() as session:
        changes = changes_after(
            session, collection_id=collection, model=model, number=number, feed=table
        )
        return [(change.number, change.shape_id, change.vector) for change in changes]


def described(database: Database, count: int = 2, model: str = "heat") -> tuple[str, list[str]]:
    """A collection of shapes with a descriptor and a signature each."""
    with database.begin() as session:
        zoo = make_collection(session)
        if model != "heat":
            make_model(session, model)
        shapes = [make_shape(session, zoo, n) for n in range(count)]
        store_descriptors(
            session,
            zoo.id,
            [(shape, model, b"1234") for shape in shapes],
            [(shape, model, b"windows!") for shape in shapes],
        )
    return zoo.id, sorted(shapes)


def test_what_is_stored_together_has_one_number(database: Database) -> None:
    zoo, shapes = described(database)
    assert feed(database, zoo, Descriptor) == [(1, shape, b"1234") for shape in shapes]
    assert feed(database, zoo, Signature) == [(1, shape, b"windows!") for shape in shapes]
    with database.begin() as session:
        store_descriptors(session, zoo, [], [(shapes[0], "heat", b"windows?")])
        store_descriptors(session, zoo, [], [])  # nothing is no change
        assert session.get_one(Counter, "change").value == 2
    assert feed(database, zoo, Descriptor, number=1) == []
    assert feed(database, zoo, Signature, number=1) == [(2, shapes[0], b"windows?")]


def test_a_shape_may_have_no_signature(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
        store_descriptors(session, zoo.id, [(shape, "heat", b"1234")])
        mark_deleted(session, [shape])
    assert feed(database, zoo.id, Signature) == []
    assert feed(database, zoo.id, Descriptor) == [(2, shape, None)]


@BOTH
def test_a_deletion_is_a_change_of_both_feeds(database: Database, table: Feed) -> None:
    zoo, (gone, stays) = described(database)
    with database.begin() as session:
        delete_shape(session, gone)
    assert feed(database, zoo, table, number=1) == [(2, gone, None)]
    assert {shape for _, shape, vector in feed(database, zoo, table) if vector} == {stays}


@BOTH
def test_a_signature_that_is_there_again_is_no_deletion(database: Database, table: Feed) -> None:
    zoo, (one, _) = described(database)
    with database.begin() as session:
        mark_deleted(session, [one])
        store_descriptors(session, zoo, [(one, "heat", b"1234")], [(one, "heat", b"1234")])
        assert prune_deletions(session, time.time() + 1, limit=10) == 0
    assert (3, one, b"1234") in feed(database, zoo, table)


def test_both_feeds_are_pruned_and_the_newest_deletion_is_noted_once(database: Database) -> None:
    zoo, shapes = described(database, 3)
    for shape in shapes[:2]:
        with database.begin() as session:
            delete_shape(session, shape)
    later = time.time() + 1
    with database.begin() as session:
        assert count_deletions(session, later) == 4
        assert [prune_deletions(session, later, limit=1) for _ in range(3)] == [2, 2, 0]
    for table in (Descriptor, Signature):
        assert [shape for _, shape, _ in feed(database, zoo, table)] == [shapes[2]]
    with database.read() as session:
        assert pruned_up_to(session, collection_id=zoo, model="heat") == 3


def count(database: Database, table: Feed) -> int:
    with database.read() as session:
        return session.scalar(select(func.count()).select_from(table)) or 0


@BOTH
def test_rows_go_with_their_collection(database: Database, table: Feed) -> None:
    described(database)
    with database.begin() as session:
        other = make_collection(session, "park")
        shape = make_shape(session, other, 5)
        row = (shape, "heat", b"1234")
        store_descriptors(session, other.id, [row], [row])
    with database.begin() as session:
        delete_collection(session, "zoo")
    assert count(database, table) == 1


@BOTH
def test_rows_go_with_their_model(database: Database, table: Feed) -> None:
    zoo, shapes = described(database, model="trained")
    with database.begin() as session:
        store_descriptors(session, zoo, [(shapes[0], "heat", b"1234")], [(shapes[0], "heat", b"1")])
    with database.begin() as session:
        delete_model(session, "trained")
    assert feed(database, zoo, table, model="trained") == []
    assert count(database, table) == 1
