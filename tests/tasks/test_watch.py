"""A real worker tells what it is at; what is in vain, or takes too long, is stopped."""

import time
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import pytest
from sqlalchemy import select

from tests.pipeline.uploads import potato
from tests.servers import valkey_server
from tests.tasks.test_delivery import Fleet, make_fleet
from workers.pipeline.part_kinds import query_part
from workers.storage.blobs import mesh_key
from workers.storage.jobs import cancel_job, create_job, get_job, retry_job
from workers.storage.models import Job, Part
from workers.storage.shapes import get_shapes

pytestmark = [pytest.mark.server, pytest.mark.slow]
HOLDING = ("-I", "tests.tasks.holding")  # in workers alone: it changes what verbs do
HOLD = b"hold "


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[Fleet]:
    with valkey_server(tmp_path) as broker:
        yield from make_fleet(tmp_path, "", broker)


def ask(fleet: Fleet, data: bytes) -> str:
    """Store a query and send its message; returns the job."""
    digest = sha256(data).hexdigest()
    fleet.blobs.put(mesh_key(digest), data)
    with fleet.database.begin() as session:
        part = query_part(digest, "heat", "asked.off")
        job, parts = create_job(session, kind="query", unit="meshes", parts=[part])
    fleet.dispatcher.send(parts)
    return job.id


def job_of(fleet: Fleet, job_id: str) -> Job:
    with fleet.database.read() as session:
        return get_job(session, job_id)


def pool_of(worker: int) -> set[str]:
    """Numbers of the processes of a worker."""
    return set(Path(f"/proc/{worker}/task/{worker}/children").read_text().split())


def assert_no_crash(log: Path) -> None:
    text = log.read_text()
    for word in ("Traceback", "ERROR", "CRITICAL", "WorkerLost", "SIGKILL", "failed, tries again"):
        assert word not in text, text


def test_a_cancelled_query_stops_though_it_hears_nothing_and_others_go_on(
    fleet: Fleet, tmp_path: Path
) -> None:
    """The process that worked on it is gone; what another works on, and what waits, is done."""
    with (
        (tmp_path / "log").open("wb") as log,
        fleet.worker(*HOLDING, processes=2, log=log) as worker,
    ):
        held, other = ask(fleet, HOLD + b"spectrum"), ask(fleet, HOLD + b"describing")
        fleet.wait_until(lambda: job_of(fleet, held).step == "spectrum")
        fleet.wait_until(lambda: job_of(fleet, other).step == "describing")
        before = pool_of(worker.pid)
        with fleet.database.begin() as session:
            cancel_job(session, held)
        shapes = fleet.upload(*(potato(n) for n in range(2)))
        fleet.send_all()
        fleet.wait_until(lambda: len(before - pool_of(worker.pid)) == 1, seconds=10)
        fleet.wait_until(lambda: fleet.states(shapes) == {"ready"})
        assert job_of(fleet, other).state == "running"
        assert (job_of(fleet, held).state, job_of(fleet, held).step) == ("cancelled", None)
        with fleet.database.read() as session:
            assert set(session.scalars(select(Part.attempts))) == {1}
    assert_no_crash(tmp_path / "log")


def test_a_mesh_that_takes_too_long_fails_once_and_says_why(fleet: Fleet, tmp_path: Path) -> None:
    with (
        (tmp_path / "log").open("wb") as log,
        fleet.worker(*HOLDING, log=log, shape_seconds="1.5"),
    ):
        asked = ask(fleet, HOLD + b"spectrum")
        shapes = fleet.upload(HOLD + b"simplifying", potato(1))
        fleet.send_all()
        fleet.wait_until(fleet.all_ended)
    sentence = "was still at '{}' after 1.5 s, the limit that PROTEUS_SHAPE_SECONDS sets"
    job = job_of(fleet, asked)
    assert (job.state, job.step, job.attempts) == ("failed", None, 1)
    reason = {"type": "time-limit", "detail": sentence.format("spectrum")}
    assert job.errors == [{"item": "asked.off", **reason}]
    with fleet.database.read() as session:
        slow, quick = (get_shapes(session, shapes)[shape] for shape in shapes)
    assert (slow.state, quick.state) == ("failed", "ready")
    assert slow.row.error == {"type": "time-limit", "detail": sentence.format("simplifying")}
    assert_no_crash(tmp_path / "log")


def test_what_takes_long_without_being_about_one_mesh_has_no_limit(fleet: Fleet) -> None:
    with fleet.worker(*HOLDING, shape_seconds="0.2"):
        asked = ask(fleet, HOLD + b"learning")
        fleet.wait_until(lambda: job_of(fleet, asked).step == "learning")
        time.sleep(1.0)
        assert job_of(fleet, asked).state == "running"


def test_a_cancelled_job_can_be_tried_again_by_the_same_worker(fleet: Fleet) -> None:
    with fleet.worker(*HOLDING, shape_seconds="3"):
        asked = ask(fleet, HOLD + b"spectrum")
        fleet.wait_until(lambda: job_of(fleet, asked).step == "spectrum")
        with fleet.database.begin() as session:
            cancel_job(session, asked)
        with fleet.database.begin() as session:
            _, parts = retry_job(session, asked)
        fleet.dispatcher.send(parts)
        fleet.wait_until(fleet.all_ended)
    assert job_of(fleet, asked).errors[0]["type"] == "time-limit"
    assert job_of(fleet, asked).attempts == 1
