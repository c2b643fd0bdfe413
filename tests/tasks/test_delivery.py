"""Parts travel over a real broker to real workers; killed or forgotten, they are done."""

import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import pytest
from sqlalchemy import func, select

from tests.pipeline.uploads import potato, store_upload
from tests.servers import postgres_database, redis_server, valkey_server
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.collections import create_collection
from workers.storage.database import Database
from workers.storage.descriptors import get_vector
from workers.storage.migrate import migrate
from workers.storage.models import Part
from workers.storage.shapes import get_shapes
from workers.tasks.dispatch import Dispatcher
from workers.tasks.sweep import sweep

pytestmark = [pytest.mark.server, pytest.mark.slow]


@dataclass
class Fleet:
    """A database, a broker, and workers that are started when a test wants them."""

    settings: Settings
    database: Database
    blobs: BlobStore
    dispatcher: Dispatcher

    def upload(self, *files: bytes, collection: str = "zoo") -> list[str]:
        return store_upload(self.database, self.blobs, collection, *files)[1]

    def send_all(self) -> None:
        with self.database.read() as session:
            parts = session.scalars(select(Part).where(Part.state == "queued")).all()
        self.dispatcher.send(parts)

    @contextmanager
    def worker(
        self,
        *options: str,
        processes: int = 1,
        log: IO[bytes] | None = None,
        **values: str,
    ) -> Iterator[subprocess.Popen[bytes]]:
        names = ("database_url", "broker_url", "blob_url", "queue_prefix")
        values |= {n: str(getattr(self.settings, n)) for n in names}
        values = {
            "data_dir": str(self.settings.data_path),
            "lease_seconds": "3",
            "sweep_seconds": "0.5",
            "resend_seconds": "1",
            "log_level": "warning",
            **values,
        }
        environment = os.environ | {f"PROTEUS_{k.upper()}": v for k, v in values.items()}
        queues = ",".join(f"{self.settings.queue_prefix}.{q}" for q in ("light", "ingest"))
        command = [sys.executable, "-m", "celery", "-A", "workers.tasks.app", "worker"]
        command += ["-Q", queues, "--concurrency", str(processes), "--without-gossip"]
        command += ["-n", f"{uuid.uuid4().hex}@test", "--without-mingle", *options]
        process = subprocess.Popen(
            command, env=environment, start_new_session=True, stdout=log, stderr=log
        )
        try:
            yield process
        finally:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()

    def wait_until(self, holds: Callable[[], bool], seconds: float = 120) -> None:
        deadline = time.monotonic() + seconds
        while not holds():
            assert time.monotonic() < deadline, "it did not come about in time"
            time.sleep(0.1)

    def all_ended(self) -> bool:
        with self.database.read() as session:
            open_parts = select(func.count()).where(Part.state.in_(("queued", "running")))
            return session.scalar(open_parts) == 0

    def states(self, shapes: list[str]) -> set[str]:
        with self.database.read() as session:
            return {view.state for view in get_shapes(session, shapes).values()}


@pytest.fixture(params=["sqlite and valkey", "postgresql and redis"])
def fleet(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Fleet]:
    if request.param == "sqlite and valkey":
        with valkey_server(tmp_path) as broker:
            yield from make_fleet(tmp_path, "", broker)
    else:
        server = request.getfixturevalue("postgres")
        with postgres_database(server) as url, redis_server() as broker:
            yield from make_fleet(tmp_path, url, broker)


def make_fleet(folder: Path, database_url: str, broker_url: str, **options: Any) -> Iterator[Fleet]:
    url = database_url or f"sqlite:///{folder / 'rows.sqlite3'}"
    settings = Settings(
        data_dir=folder,
        database_url=url,
        broker_url=broker_url,
        blob_url=f"file://{folder / 'blobs'}",
        queue_prefix=f"test-{uuid.uuid4().hex[:8]}",
        **options,
    )
    migrate(settings)
    database = Database(settings.resolved_database_url)
    with database.begin() as session:
        for name in ("zoo", "other"):
            create_collection(session, name=name, description="", model="heat")
    dispatcher = Dispatcher(settings)
    yield Fleet(settings, database, BlobStore(settings.resolved_blob_url), dispatcher)
    dispatcher.drop_messages()
    dispatcher.close()
    database.dispose()


def test_what_is_sent_is_done(fleet: Fleet) -> None:
    shapes = fleet.upload(*(potato(n) for n in range(3)))
    with fleet.worker():
        fleet.send_all()
        fleet.wait_until(fleet.all_ended)
    assert fleet.states(shapes) == {"ready"}


def test_a_broker_that_forgets_everything_loses_nothing(fleet: Fleet) -> None:
    shapes = fleet.upload(*(potato(n) for n in range(4)))
    fleet.send_all()
    fleet.dispatcher.drop_messages()
    assert fleet.dispatcher.waiting("ingest") == 0
    with fleet.worker():
        fleet.wait_until(fleet.all_ended)
    assert fleet.states(shapes) == {"ready"}


def test_a_backlog_is_not_sent_twice(fleet: Fleet) -> None:
    fleet.upload(*(potato(n) for n in range(3)))
    fleet.send_all()
    impatient = fleet.settings.model_copy(update={"resend_seconds": 0.001})
    time.sleep(0.01)
    assert sweep(impatient, fleet.database, fleet.dispatcher) == 0
    assert fleet.dispatcher.waiting("ingest") == 3
    fleet.dispatcher.drop_messages()
    assert sweep(impatient, fleet.database, fleet.dispatcher) == 3


def test_a_worker_killed_in_the_middle_loses_nothing(fleet: Fleet) -> None:
    shapes = fleet.upload(*(potato(n) for n in range(4)))

    def running() -> bool:
        with fleet.database.read() as session:
            return session.scalar(select(Part.id).where(Part.state == "running")) is not None

    with fleet.worker():
        fleet.send_all()
        fleet.wait_until(running)
    with fleet.worker():
        fleet.wait_until(fleet.all_ended)
    assert fleet.states(shapes) == {"ready"}
    with fleet.database.read() as session:
        assert 2 <= (session.scalar(select(func.max(Part.attempts))) or 0) <= 3


def test_two_workers_give_the_same_bytes(fleet: Fleet) -> None:
    """Each collection is computed by a worker of its own, from nothing."""
    meshes = [potato(n) for n in range(2)]
    found = []
    for collection in ("zoo", "other"):
        shapes = fleet.upload(*meshes, collection=collection)
        with fleet.worker(processes=2):
            fleet.send_all()
            fleet.wait_until(fleet.all_ended)
        with fleet.database.read() as session:
            found.append([get_vector(session, shape, "heat") for shape in shapes])
        for blob in (fleet.settings.data_path / "blobs" / "spectra").rglob("*.npz"):
            blob.unlink()
    assert None not in found[0]
    assert found[0] == found[1]


def test_no_pool_process_outlives_a_killed_worker(fleet: Fleet) -> None:
    fleet.upload(potato(1))
    with fleet.worker(processes=2) as worker:
        fleet.send_all()
        fleet.wait_until(fleet.all_ended)
        children = Path(f"/proc/{worker.pid}/task/{worker.pid}/children").read_text().split()
        os.kill(worker.pid, signal.SIGKILL)
        assert len(children) >= 2
        fleet.wait_until(lambda: not any(_is_alive(child) for child in children), seconds=10)


def _is_alive(process: str) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False
