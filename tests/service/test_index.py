"""The search index: in step with the change feed, whole at every moment, and rebuilt if damaged."""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import update

from service.search.cache_file import Identity, read_cache, write_cache
from service.search.index import IndexSizes, SearchIndex
from tests.service.indexed import (
    DIMENSION,
    Rows,
    content,
    draw,
    forget,
    found,
    new_identity,
    store,
    vector_of,
)
from tests.service.running import closing_database, make_settings
from workers.geometry.arrays import Float32Array
from workers.storage.change_feed import prune_deletions
from workers.storage.collections import create_collection
from workers.storage.database import Database
from workers.storage.descriptors import store_descriptors
from workers.storage.identifiers import new_id
from workers.storage.migrate import migrate
from workers.storage.models import Counter

Open = Callable[[], SearchIndex]


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    settings = make_settings(tmp_path)
    migrate(settings)
    with closing_database(settings.resolved_database_url) as database:
        yield database


@pytest.fixture
def identity(database: Database) -> Identity:
    return new_identity(database, "zoo")


@pytest.fixture
def path(identity: Identity, tmp_path: Path) -> Path:
    return tmp_path / "cache" / identity.file_name


@pytest.fixture
def open_index(database: Database, identity: Identity, path: Path) -> Open:
    return lambda: SearchIndex(database, identity, path)


@pytest.fixture
def index(open_index: Open) -> SearchIndex:
    return open_index()


def test_any_history_ends_in_the_rows_of_the_database(
    database: Database, identity: Identity, open_index: Open, rng: np.random.Generator
) -> None:
    index = open_index()
    expected: Rows = {}
    for _ in range(60):
        ids = list(expected)
        step = rng.integers(4)
        if step == 0 and ids:
            gone = [ids[i] for i in rng.integers(len(ids), size=rng.integers(1, 40))]
            forget(database, gone)
            expected = {key: value for key, value in expected.items() if key not in gone}
        elif step == 1 and ids:
            changed = dict(zip(ids[::3], draw(rng, len(ids)).values(), strict=False))
            store(database, identity, changed)
            expected |= changed
        else:
            fresh = draw(rng, int(rng.integers(1, 60)))
            store(database, identity, fresh)
            expected |= fresh
        if rng.random() < 0.5:
            assert content(index.snapshot()) == expected
        if rng.random() < 0.2:
            index.save()
            index = open_index()
    assert content(index.snapshot()) == expected
    assert index.n_rows == len(expected)


def test_a_snapshot_stays_as_it_was(
    database: Database, identity: Identity, index: SearchIndex, rng: np.random.Generator
) -> None:
    rows = draw(rng, 400)
    store(database, identity, rows)
    snapshot = index.snapshot()
    for ids in (list(rows)[:5], list(rows)[5:200], list(rows)[200:]):
        forget(database, ids)
        store(database, identity, draw(rng, 600))
        index.snapshot()
        index.save()
        assert content(snapshot) == rows
    some = list(rows)[17:19]
    assert found(snapshot, [*some, "stranger"]).keys() == set(some)


def test_rows_of_a_snapshot_leave_out_what_was_deleted(
    database: Database, identity: Identity, index: SearchIndex, rng: np.random.Generator
) -> None:
    rows = draw(rng, 10)
    store(database, identity, rows)
    index.snapshot()
    gone, *left = rows
    forget(database, [gone])
    snapshot = index.snapshot()
    found = snapshot.rows_of([*left, gone, "stranger"])
    assert sorted(snapshot.ids[row] for row in found) == sorted(left)
    assert (np.diff(found) > 0).all()


def test_equal_bytes_again_change_nothing(
    database: Database, identity: Identity, index: SearchIndex, rng: np.random.Generator
) -> None:
    rows = draw(rng, 10)
    store(database, identity, rows)
    before = index.snapshot()
    store(database, identity, rows)
    after = index.snapshot()
    assert len(after.matrix) == len(before.matrix) == 10
    assert after.alive is None


def test_other_collections_and_models_are_not_in_it(
    database: Database, identity: Identity, index: SearchIndex, rng: np.random.Generator
) -> None:
    rows = draw(rng, 3)
    store(database, identity, rows)
    with database.begin() as session:
        other = create_collection(session, name="other", description="", model="heat")
        stray = [(key, "heat", value) for key, value in draw(rng, 3).items()]
        store_descriptors(session, other.id, stray)
        again = [(key, "biharmonic", value) for key, value in rows.items()]
        store_descriptors(session, identity.collection_id, again)
    assert content(index.snapshot()) == rows


def test_a_descriptor_of_a_wrong_size_is_left_out(
    database: Database, identity: Identity, index: SearchIndex, rng: np.random.Generator
) -> None:
    rows = draw(rng, 3)
    store(database, identity, rows | {new_id(): b"1234"})
    assert content(index.snapshot()) == rows
    first = next(iter(rows))
    store(database, identity, {first: b"12345678"})
    assert content(index.snapshot()).keys() == rows.keys() - {first}


def test_a_large_index_is_mapped_from_its_file_and_grows_beyond_it(
    database: Database,
    identity: Identity,
    path: Path,
    open_index: Open,
    rng: np.random.Generator,
) -> None:
    index = SearchIndex(database, identity, path, sizes=IndexSizes(batch=30, saved=100))
    expected: Rows = {}
    sizes = []
    for _ in range(12):
        fresh = draw(rng, 90)
        store(database, identity, fresh)
        expected |= fresh
        assert content(index.snapshot()) == expected
        sizes.append(path.stat().st_size if path.exists() else 0)
    assert len(set(sizes)) > 3
    cached = read_cache(path, identity)
    assert cached is not None
    assert isinstance(cached.matrix.base, np.memmap)
    assert content(open_index().snapshot()) == expected


def test_what_is_added_to_a_mapping_never_reaches_the_file(tmp_path: Path) -> None:
    identity = Identity(new_id(), "heat", "0" * 64, 2)
    matrix: Float32Array = np.arange(6, dtype=np.float32).reshape(3, 2)
    path = tmp_path / "file"
    ids = [new_id() for _ in range(3)]
    write_cache(path, identity, ids=ids, matrix=matrix, number=9, capacity=10)
    before = path.read_bytes()
    cached = read_cache(path, identity)
    assert cached is not None
    assert (cached.ids, cached.number, cached.matrix.shape) == (ids, 9, (10, 2))
    np.testing.assert_array_equal(cached.matrix[:3], matrix)
    cached.matrix[:] = 7
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_any_damage_to_the_file_is_noticed_and_mended(
    database: Database,
    identity: Identity,
    path: Path,
    open_index: Open,
    rng: np.random.Generator,
) -> None:
    index = open_index()
    rows = draw(rng, 50)
    store(database, identity, rows)
    index.snapshot()
    index.save()
    whole = path.read_bytes()
    header = 16 + int.from_bytes(whole[8:16], "little")
    used = [*range(header), *range(4096, 4096 + 36 * 50), *range(8192, 8192 + 4 * DIMENSION * 50)]
    for place in rng.choice(used, size=150, replace=False):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        assert read_cache(path, identity) is None, f"a bit at {place} was not noticed"
    for cut in (0, 7, 20, 4096, 5000, len(whole) - 1):
        path.write_bytes(whole[:cut])
        assert content(open_index().snapshot()) == rows
    path.write_bytes(whole + b"x")
    assert read_cache(path, identity) is None
    for other in (
        Identity(new_id(), "heat", identity.fingerprint, DIMENSION),
        Identity(identity.collection_id, "heat", "e" * 64, DIMENSION),
        Identity(identity.collection_id, "heat", identity.fingerprint, DIMENSION + 1),
    ):
        path.write_bytes(whole)
        assert read_cache(path, other) is None


def test_without_a_place_for_its_file_an_index_works_all_the_same(
    database: Database, identity: Identity, rng: np.random.Generator, tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("a file, no folder")
    index = SearchIndex(database, identity, tmp_path / "taken" / "x.index")
    rows = draw(rng, 20)
    store(database, identity, rows)
    assert content(index.snapshot()) == rows
    index.save()
    assert content(index.snapshot()) == rows


def test_a_database_put_back_to_an_earlier_state_is_read_anew(
    database: Database, identity: Identity, open_index: Open, rng: np.random.Generator
) -> None:
    index = open_index()
    rows, lost = draw(rng, 5), draw(rng, 5)
    store(database, identity, rows)
    store(database, identity, lost)
    assert content(index.snapshot()) == rows | lost
    index.save()
    with database.begin() as session:
        from workers.storage.models import Descriptor

        session.execute(Descriptor.__table__.delete().where(Descriptor.shape_id.in_(lost)))  # type: ignore[attr-defined]
        session.execute(update(Counter).values(value=1))
    assert content(index.snapshot()) == rows
    assert content(open_index().snapshot()) == rows


def test_an_index_that_missed_a_pruned_deletion_is_read_anew(
    database: Database, identity: Identity, rng: np.random.Generator, tmp_path: Path
) -> None:
    """Whether it is in memory, comes from its file, or has seen the deletion."""
    asleep, awake = (SearchIndex(database, identity, tmp_path / name) for name in ("a", "b"))
    rows, later = draw(rng, 6), draw(rng, 2)
    store(database, identity, rows)
    for index in (asleep, awake):
        assert content(index.snapshot()) == rows
        index.save()
    gone, *left = rows
    forget(database, [gone])
    expected = {shape_id: rows[shape_id] for shape_id in left}
    assert content(awake.snapshot()) == expected
    with database.begin() as session:
        assert prune_deletions(session, time.time() + 1, limit=10) == 1
    assert content(asleep.snapshot()) == expected
    assert content(SearchIndex(database, identity, tmp_path / "a").snapshot()) == expected
    store(database, identity, later)
    assert content(awake.snapshot()) == content(asleep.snapshot()) == expected | later


def test_readers_see_whole_transactions_while_writers_work(
    database: Database, identity: Identity, index: SearchIndex, rng: np.random.Generator
) -> None:
    """Each transaction moves a pair together: a reader sees both of them or neither."""
    pairs = [(new_id(), new_id()) for _ in range(20)]
    done = threading.Event()

    def write() -> None:
        for round_number in range(5):
            for first, second in pairs:
                vector = vector_of(round_number)
                store(database, identity, {first: vector, second: vector})
        done.set()

    def read() -> int:
        seen = 0
        while not done.is_set():
            rows = content(index.snapshot())
            assert all(rows.get(first) == rows.get(second) for first, second in pairs)
            seen += 1
        return seen

    with ThreadPoolExecutor(4) as pool:
        readers = [pool.submit(read) for _ in range(3)]
        pool.submit(write).result()
        assert all(reader.result() > 0 for reader in readers)
