"""Whoever has seen change n has seen all changes below it."""

import threading
import time
from pathlib import Path

from tests.storage.rows import make_collection, make_shape
from workers.storage.change_feed import (
    changes_after,
    count_deletions,
    next_change,
    prune_deletions,
    pruned_up_to,
)
from workers.storage.database import Database
from workers.storage.descriptors import (
    get_vector,
    mark_deleted,
    store_descriptors,
    undescribed_shapes,
)
from workers.storage.shapes import delete_shape


def feed(database: Database, collection: str, number: int = 0) -> list[tuple[str, bytes | None]]:
    with database.read() as session:
        changes = changes_after(session, collection_id=collection, model="heat", number=number)
        return [(change.shape_id, change.vector) for change in changes]


def test_descriptors_come_in_order_and_a_deletion_is_a_change(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        one, two = (make_shape(session, zoo, n) for n in range(2))
        store_descriptors(session, zoo.id, [(two, "heat", b"2222")])
        store_descriptors(session, zoo.id, [(one, "heat", b"1111")])
    assert feed(database, zoo.id) == [(two, b"2222"), (one, b"1111")]
    with database.begin() as session:
        delete_shape(session, two)
    assert feed(database, zoo.id) == [(one, b"1111"), (two, None)]
    assert feed(database, zoo.id, number=2) == [(two, None)]


def test_a_descriptor_that_is_stored_again_replaces_the_first(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        one = make_shape(session, zoo, 1)
        store_descriptors(session, zoo.id, [(one, "heat", b"old!")])
    with database.begin() as session:
        store_descriptors(session, zoo.id, [(one, "heat", b"new!")])
        assert get_vector(session, one, "heat") == b"new!"
    assert feed(database, zoo.id, number=1) == [(one, b"new!")]


def test_the_order_of_numbers_is_the_order_of_commits(database: Database) -> None:
    """A transaction that drew a number keeps all others from drawing until it has committed."""
    with database.begin() as session:
        zoo = make_collection(session)
        first, second = (make_shape(session, zoo, n) for n in range(2))
    drawn = threading.Event()

    def slow() -> None:
        with database.begin() as session:
            store_descriptors(session, zoo.id, [(first, "heat", b"slow")])
            drawn.set()
            time.sleep(0.3)

    thread = threading.Thread(target=slow)
    thread.start()
    drawn.wait()
    with database.begin() as session:
        store_descriptors(session, zoo.id, [(second, "heat", b"fast")])
    seen = feed(database, zoo.id)
    thread.join()
    assert seen == [(first, b"slow"), (second, b"fast")]


def test_numbers_have_no_twins_under_many_writers(database: Database) -> None:
    numbers: list[int] = []

    def draw() -> None:
        for _ in range(10):
            with database.begin() as session:
                numbers.append(next_change(session))

    threads = [threading.Thread(target=draw) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(numbers) == list(range(1, 61))


def test_undescribed_are_those_found_now_but_not_under_the_other_model(
    database: Database, tmp_path: Path
) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        both, old, _unready = (make_shape(session, zoo, n) for n in range(3))
        store_descriptors(session, zoo.id, [(s, "heat", b"1234") for s in (both, old)])
        store_descriptors(session, zoo.id, [(both, "commute-time", b"1234")])
        assert undescribed_shapes(session, zoo, "commute-time", with_failed=True) == [old]
        mark_deleted(session, [both])
        assert undescribed_shapes(session, zoo, "commute-time", with_failed=True) == [old]


def test_old_deletions_are_pruned_and_the_newest_of_them_is_noted(database: Database) -> None:
    with database.begin() as session:
        zoo, park = make_collection(session), make_collection(session, "park")
        shapes = [make_shape(session, zoo, n) for n in range(4)]
        other = make_shape(session, park, 1)
        store_descriptors(session, zoo.id, [(shape, "heat", b"1234") for shape in shapes])
        store_descriptors(session, park.id, [(other, "heat", b"1234")])
    for shape in shapes[:3]:
        with database.begin() as session:
            delete_shape(session, shape)
    before = time.time()
    with database.begin() as session:
        assert count_deletions(session, before - 60) == 0
        assert prune_deletions(session, before - 60, limit=10) == 0
        assert count_deletions(session, before) == 3
        assert [prune_deletions(session, before, limit=2) for _ in range(3)] == [2, 1, 0]
    assert feed(database, zoo.id) == [(shapes[3], b"1234")]
    with database.read() as session:
        assert pruned_up_to(session, collection_id=zoo.id, model="heat") == 5
        assert pruned_up_to(session, collection_id=park.id, model="heat") == 0


def test_deletions_of_a_collection_that_is_gone_are_pruned_too(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
        store_descriptors(session, zoo.id, [(shape, "heat", b"1234")])
        delete_shape(session, shape)
        session.delete(zoo)
    with database.begin() as session:
        assert prune_deletions(session, time.time() + 1, limit=10) == 1
    with database.read() as session:
        assert pruned_up_to(session, collection_id=zoo.id, model="heat") == 0


def test_a_descriptor_that_is_there_again_is_no_deletion(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
        store_descriptors(session, zoo.id, [(shape, "heat", b"1234")])
        mark_deleted(session, [shape])
        store_descriptors(session, zoo.id, [(shape, "heat", b"1234")])
        assert prune_deletions(session, time.time() + 1, limit=10) == 0
    assert feed(database, zoo.id) == [(shape, b"1234")]
