"""All indexes of a process: which is dropped, and which cache files there are."""

import os
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import update

from service.search.cache_file import Identity, write_cache
from service.search.index import SearchIndex
from service.search.indexes import SearchIndexes, SearchModel, load_search_model
from tests.service.indexed import draw, forget, new_identity, store
from tests.service.running import ZOO, Api, closing_database, make_settings
from workers.geometry.arrays import Float32Array
from workers.storage.arrays import vector_to_bytes
from workers.storage.collections import create_collection, delete_collection
from workers.storage.database import Database
from workers.storage.descriptors import store_descriptors
from workers.storage.identifiers import new_id
from workers.storage.migrate import migrate
from workers.storage.models import TrainedModel


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    settings = make_settings(tmp_path)
    migrate(settings)
    with closing_database(settings.resolved_database_url) as database:
        yield database


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "cache"


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []


def described(database: Database, *names: str, models: tuple[str, ...] = ("heat",)) -> list[str]:
    """Ids of new collections with one shape each that is described under these models."""
    ids = []
    with database.begin() as session:
        for name in names:
            row = create_collection(session, name=name, description="", model="heat")
            ids.append(row.id)
            shape_id = new_id()
            for model in models:
                dimension = load_search_model(session, model).model.dimension
                vector = vector_to_bytes(np.zeros(dimension, dtype=np.float32))
                store_descriptors(session, row.id, [(shape_id, model, vector)])
    return ids


def loaded(database: Database, name: str) -> SearchModel:
    with database.read() as session:
        return load_search_model(session, name)


def test_a_collection_that_is_deleted_leaves_no_file(database: Database, folder: Path) -> None:
    first, second = described(database, "first", "second")
    indexes = SearchIndexes(database, folder)
    for collection_id in (first, second):
        indexes.snapshot(collection_id, loaded(database, "heat"))
    indexes.close()
    assert len(files(folder)) == 2
    indexes.forget_collection(first)
    assert [name[:36] for name in files(folder)] == [second]


def test_a_model_that_is_deleted_leaves_no_file(database: Database, folder: Path) -> None:
    """Of an index that was written, of one that is open, and of one that is written later."""
    ids = described(database, "first", "second", models=("heat", "biharmonic"))
    indexes = SearchIndexes(database, folder)
    for collection_id in ids:
        for model in ("heat", "biharmonic"):
            indexes.snapshot(collection_id, loaded(database, model))
    indexes.close()
    assert len(files(folder)) == 4
    indexes.snapshot(ids[0], loaded(database, "biharmonic"))
    indexes.forget_model("biharmonic")
    indexes.close()
    assert sorted(name[:36] for name in files(folder)) == sorted(ids)
    assert len({name.split(".")[1] for name in files(folder)}) == 1


def test_the_file_of_a_model_goes_when_the_model_is_deleted_over_http(zoo: Api) -> None:
    """The collection was searched under the model, and then moved away from it."""
    cache = zoo.settings.data_path / "cache"
    body = {"name": "mine", "method": "biharmonic"}
    zoo.post("/v1/models?wait=10", 201, json=body)
    for model in ("mine", "heat"):
        zoo.put("/v1/collections/zoo/model", json={"model": model})
        zoo.work()
        zoo.ask("zoo", shape_id=zoo.shape_ids[ZOO[0]])
    zoo.services.indexes.close()
    assert len(files(cache)) == 2
    zoo.delete("/v1/models/mine")
    assert len(files(cache)) == 1


def test_an_index_that_was_discarded_writes_no_file(
    database: Database, folder: Path, rng: np.random.Generator
) -> None:
    identity = new_identity(database, "zoo")
    index = SearchIndex(database, identity, folder / identity.file_name)
    store(database, identity, draw(rng, 3))
    index.snapshot()
    index.save()
    index.discard()
    store(database, identity, draw(rng, 3))
    assert len(index.snapshot().rows) == 6
    index.save()
    assert files(folder) == []


def test_indexes_that_are_dropped_while_they_are_saved_leave_no_file(
    database: Database, folder: Path
) -> None:
    """Each search evicts the index of another collection, and saves it, as they are deleted."""
    indexes = SearchIndexes(database, folder, max_bytes=1)
    search = loaded(database, "heat")
    names = [f"c{number}" for number in range(12)]
    ids = described(database, *names)

    def ask(start: int) -> None:
        for step in range(40):
            indexes.snapshot(ids[(start + step) % len(ids)], search)

    with ThreadPoolExecutor(4) as pool:
        asked = [pool.submit(ask, start) for start in range(3)]
        for name, collection_id in zip(names[1:], ids[1:], strict=True):
            with database.begin() as session:
                delete_collection(session, name)
            indexes.forget_collection(collection_id)
        for future in asked:
            future.result()
    indexes.close()
    assert {name[:36] for name in files(folder)} <= {ids[0]}


def test_files_of_what_is_no_more_are_removed(database: Database, folder: Path) -> None:
    matrix: Float32Array = np.zeros((1, 2), dtype=np.float32)
    ids = [new_id(), new_id()]
    for collection_id in ids:
        for model in ("heat", "gone"):
            identity = Identity(collection_id, model, "0" * 64, 2)
            path = folder / identity.file_name
            write_cache(path, identity, ids=[new_id()], matrix=matrix, number=1, capacity=1)
    kept = Identity(ids[0], "heat", "0" * 64, 2).file_name
    fresh, old = folder / f".{kept}.1.partial", folder / f".{kept}.2.partial"
    for path in (fresh, old, folder / "older-layout.index"):
        path.write_bytes(b"half")
    os.utime(old, (0, time.time() - 7200))
    SearchIndexes(database, folder).keep_only({ids[0]}, {"heat"})
    assert files(folder) == sorted([kept, fresh.name])


def test_the_least_recently_asked_index_goes_first(database: Database, folder: Path) -> None:
    indexes = SearchIndexes(database, folder, max_bytes=1)
    with database.begin() as session:
        search = load_search_model(session, "heat")
        ids = [
            create_collection(session, name=f"c{n}", description="", model="heat").id
            for n in range(3)
        ]
        vector = vector_to_bytes(np.zeros(search.model.dimension, dtype=np.float32))
        for collection_id in ids:
            store_descriptors(session, collection_id, [(new_id(), "heat", vector)])
    for collection_id in (*ids, ids[0]):
        snapshot = indexes.snapshot(collection_id, search)
        assert len(snapshot.matrix) == 1
        assert list(indexes.sizes()) == [(collection_id, "heat")]
    indexes.close()
    assert len(files(folder)) == 3


def test_a_model_that_took_an_old_name_has_an_index_of_its_own(
    database: Database, folder: Path
) -> None:
    indexes = SearchIndexes(database, folder)
    with database.begin() as session:
        row = create_collection(session, name="zoo", description="", model="heat")
        first = load_search_model(session, "heat")
        vector = vector_to_bytes(np.zeros(first.model.dimension, dtype=np.float32))
        store_descriptors(session, row.id, [(new_id(), "heat", vector)])
    assert len(indexes.snapshot(row.id, first).matrix) == 1
    with database.begin() as session:
        session.execute(update(TrainedModel).values(created_at=1.0))
    with database.read() as session:
        second = load_search_model(session, "heat")
    assert second.fingerprint != first.fingerprint
    indexes.close()
    (old,) = files(folder)
    forget(database, indexes.snapshot(row.id, second).ids[:1])  # type: ignore[arg-type]
    assert indexes.snapshot(row.id, second).rows.tolist() == []
    indexes.close()
    assert old not in files(folder)
