"""A snapshot of the search index stays as it was, whatever the index does afterwards."""

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    rule,
    run_state_machine_as_test,
)

from service.search.index import IndexSizes, SearchIndex, Snapshot
from service.search.shape_rows import ShapeRows
from tests.service.indexed import Rows, content, draw, forget, found, new_identity, store, vector_of
from tests.service.running import closing_database, make_settings
from workers.storage.database import Database
from workers.storage.identifiers import new_id
from workers.storage.migrate import migrate

SMALL = IndexSizes(first=2, batch=3, saved=4)
"""Grows, saves and drops dead rows after a few changes."""


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    directory = make_settings(tmp_path)
    migrate(directory)
    with closing_database(directory.resolved_database_url) as database:
        yield database


def test_a_snapshot_finds_by_id_what_was_deleted_or_replaced_afterwards(
    database: Database, rng: np.random.Generator, tmp_path: Path
) -> None:
    identity = new_identity(database, "zoo")
    index = SearchIndex(database, identity, tmp_path / identity.file_name)
    rows = draw(rng, 20)
    ids = list(rows)
    store(database, identity, rows)
    snapshot = index.snapshot()
    forget(database, ids[:5])
    store(database, identity, {shape_id: vector_of(7.0) for shape_id in ids[5:10]})
    later = index.snapshot()
    assert found(snapshot, ids) == rows
    assert found(later, ids) == {key: later_value(key, rows, ids) for key in ids[5:]}


def later_value(shape_id: str, rows: Rows, ids: list[str]) -> bytes:
    return vector_of(7.0) if shape_id in ids[5:10] else rows[shape_id]


@pytest.mark.parametrize("below", [0, 1, 2, 4, 5, 9])
def test_the_newest_row_below_a_limit_is_the_last_one_of_a_list(below: int) -> None:
    ids = ["a", "b", "a", "c", "a"]
    rows = ShapeRows(ids)
    for shape_id in "abcd":
        expected = max((r for r, i in enumerate(ids[:below]) if i == shape_id), default=None)
        assert rows.newest(shape_id, below=below) == expected


class Histories(RuleBasedStateMachine):
    """An index beside a dictionary, and all snapshots beside copies of it."""

    def __init__(self, database: Database, folder: Path) -> None:
        super().__init__()
        self.database = database
        self.identity = new_identity(database, f"c{new_id()}")
        self.path = folder / self.identity.file_name
        self.ids = [new_id() for _ in range(6)]
        self.expected: Rows = {}
        self.kept: list[tuple[Snapshot, Rows]] = []
        self.open()

    def open(self) -> None:
        self.index = SearchIndex(self.database, self.identity, self.path, sizes=SMALL)

    @rule(values=st.dictionaries(st.integers(0, 5), st.integers(0, 3), min_size=1))
    def store(self, values: dict[int, int]) -> None:
        rows = {self.ids[shape]: vector_of(value) for shape, value in values.items()}
        store(self.database, self.identity, rows)
        self.expected |= rows

    @rule(shapes=st.sets(st.integers(0, 5), min_size=1))
    def delete(self, shapes: set[int]) -> None:
        gone = [self.ids[shape] for shape in sorted(shapes)]
        forget(self.database, gone)
        self.expected = {k: value for k, value in self.expected.items() if k not in gone}

    @rule()
    def take_snapshot(self) -> None:
        self.kept.append((self.index.snapshot(), dict(self.expected)))

    @rule()
    def save(self) -> None:
        self.index.save()

    @rule()
    def save_and_open_again(self) -> None:
        self.index.save()
        self.open()

    @rule()
    def put_a_damaged_file_in_place(self) -> None:
        other = self.path.with_name("other")
        other.parent.mkdir(exist_ok=True)
        other.write_bytes(b"damaged")
        other.replace(self.path)  # as the index does: a mapped file is never written to
        self.open()

    @invariant()
    def snapshots_are_as_they_were(self) -> None:
        for snapshot, expected in self.kept:
            assert content(snapshot) == expected
            assert found(snapshot, [*self.ids, "stranger"]) == expected


def test_snapshots_of_any_history_stay_as_they_were(database: Database, tmp_path: Path) -> None:
    class HistoriesHere(Histories):
        def __init__(self) -> None:
            super().__init__(database, tmp_path / "cache")

    run_state_machine_as_test(
        HistoriesHere,
        settings=settings(
            max_examples=25,
            stateful_step_count=20,
            deadline=None,
            suppress_health_check=list(HealthCheck),
        ),
    )


def test_snapshots_stay_as_they_were_while_threads_update_the_index(
    database: Database, tmp_path: Path
) -> None:
    """Each transaction gives all shapes one new value, or deletes them all but the first."""
    identity = new_identity(database, "zoo")
    path = tmp_path / "cache" / identity.file_name
    index = SearchIndex(database, identity, path, sizes=IndexSizes(first=8, batch=16, saved=40))
    ids = [new_id() for _ in range(12)]
    store(database, identity, dict.fromkeys(ids, vector_of(0)))
    stopped = threading.Event()

    def write() -> None:
        try:
            for number in range(1, 60):
                if number % 3:
                    store(database, identity, dict.fromkeys(ids, vector_of(number)))
                else:
                    forget(database, ids[1:])
        finally:
            stopped.set()

    def read() -> int:
        checked = 0
        kept: list[tuple[Snapshot, Rows]] = []
        while not stopped.is_set():
            snapshot = index.snapshot()
            rows = content(snapshot)
            assert len(set(rows.values())) == 1, "a transaction was seen in part"
            assert rows.keys() in ({ids[0]}, set(ids))
            kept = [*kept[-8:], (snapshot, rows)]
            for older, expected in kept:
                assert found(older, ids) == content(older) == expected
                checked += 1
        return checked

    with ThreadPoolExecutor(5) as pool:
        readers = [pool.submit(read) for _ in range(4)]
        pool.submit(write).result()
        assert all(reader.result() > 0 for reader in readers)
