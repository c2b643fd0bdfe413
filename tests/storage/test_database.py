"""Migrations, concurrent writers, ids, arrays and blobs."""

import io
import os
import subprocess
import sys
import threading
import time
import uuid

import numpy as np
import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import inspect, select, text

from tests.storage.rows import make_collection, make_shape
from workers.settings import Settings
from workers.storage.arrays import pack, unpack, vector_from_bytes, vector_to_bytes
from workers.storage.database import Database
from workers.storage.descriptors import get_vector, store_descriptors
from workers.storage.identifiers import new_id
from workers.storage.migrate import migrate_schema, migration_config
from workers.storage.models import Base, Counter, Signature, TrainedModel


def test_migrations_and_models_say_the_same(database: Database) -> None:
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []


def test_migrating_from_several_processes_at_once_does_no_harm(settings: Settings) -> None:
    url = settings.resolved_database_url
    environment = {**os.environ, "PROTEUS_DATABASE_URL": url, "PROTEUS_LOG_LEVEL": "error"}
    command = [sys.executable, "-m", "workers.storage.migrate"]
    processes = [subprocess.Popen(command, env=environment) for _ in range(3)]
    assert [process.wait(timeout=120) for process in processes] == [0, 0, 0]
    database = Database(settings.resolved_database_url)
    with database.read() as session:
        names = session.scalars(select(TrainedModel.name)).all()
    database.dispose()
    assert sorted(names) == ["biharmonic", "commute-time", "heat", "proteus", "shape-dna"]


def test_the_schema_can_be_taken_back(database: Database) -> None:
    with database.begin() as session:
        command.downgrade(migration_config(session.connection()), "base")
        migrate_schema(session)


def test_the_table_of_signatures_can_be_taken_back_alone(database: Database) -> None:
    """Descriptors stay as they are, and the table comes back as it was."""
    with database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
        row = (shape, "heat", b"1234")
        store_descriptors(session, zoo.id, [row], [row])
    with database.begin() as session:
        command.downgrade(migration_config(session.connection()), "0005")
        tables = inspect(session.connection()).get_table_names()
        assert "descriptors" in tables
        assert "signatures" not in tables
    with database.begin() as session:
        migrate_schema(session)
        assert get_vector(session, shape, "heat") == b"1234"
        assert session.scalars(select(Signature)).all() == []
        context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []


def test_many_writers_never_meet_a_locked_database(database: Database) -> None:
    def write() -> None:
        for _ in range(20):
            with database.begin() as session:
                counter = session.get_one(Counter, "change", with_for_update=True)
                counter.value += 1

    threads = [threading.Thread(target=write) for _ in range(5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as session:
        assert session.get_one(Counter, "change").value == 100


def test_a_block_that_fails_leaves_nothing(database: Database) -> None:
    def write_and_fail() -> None:
        with database.begin() as session:
            session.get_one(Counter, "change").value = 9
            session.flush()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_and_fail()
    with database.read() as session:
        assert session.get_one(Counter, "change").value == 0
        session.execute(text("SELECT 1"))


def test_ids_sort_by_time_and_are_uuids_of_version_7() -> None:
    ids = []
    for _ in range(50):
        ids.append(new_id())
        time.sleep(1e-4)
    assert ids == sorted(ids)
    assert {uuid.UUID(i).version for i in ids} == {7}


def test_arrays_come_back_and_equal_arrays_give_equal_bytes() -> None:
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([1], dtype=np.int32)}
    back = unpack(pack(arrays))
    assert {k: (v.dtype, v.tolist()) for k, v in back.items()} == {
        k: (v.dtype, v.tolist()) for k, v in arrays.items()
    }
    assert pack(arrays) == pack(dict(reversed(arrays.items())))
    vector = np.array([0.1, -2.5, 3e-9], dtype=np.float32)
    assert vector_from_bytes(vector_to_bytes(vector)).tolist() == vector.tolist()


def test_pickles_are_never_read() -> None:
    buffer = io.BytesIO()
    np.savez(buffer, a=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match="allow_pickle"):
        unpack(buffer.getvalue())
