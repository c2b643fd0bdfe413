"""What a worker's parent makes of its processes' notes, on both databases, without a worker."""

import os
import shutil
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import select

from tests.storage.rows import make_collection, make_shape
from workers.pipeline.part_kinds import describe_parts, ingest_part, query_part
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.jobs import NewPart, cancel_job, create_job, get_job
from workers.storage.models import Job, Part, Shape
from workers.storage.parts import Claim, claim_part, release_part
from workers.tasks.notes import NotedProgress, Notes
from workers.tasks.watch import WORTH_TELLING_SECONDS, Watcher

HERE = os.getpid()
SOON = 0.01


class Parent:
    """A worker's parent whose one process is this one."""

    def __init__(self, database: Database, blobs: BlobStore, settings: Settings, folder: Path):
        self.database = database
        self.sent: list[str] = []
        self.killed: list[int] = []
        self.notes = Notes(folder)
        self.writer = self.notes.writer(HERE)
        self.progress = NotedProgress(self.writer)
        self._bench = Workbench(database, blobs, settings, self._send)
        self.watcher = self.with_limit(settings.shape_seconds)

    def _send(self, parts: Sequence[Part]) -> None:
        self.sent += [part.id for part in parts]

    def with_limit(self, seconds: float) -> Watcher:
        settings = self._bench.settings.model_copy(update={"shape_seconds": seconds})
        self.watcher = Watcher(
            replace(self._bench, settings=settings), self.notes, self.killed.append
        )
        return self.watcher

    def queue(self, *parts: NewPart, kind: str = "query") -> str:
        with self.database.begin() as session:
            return create_job(session, kind=kind, unit="meshes", parts=parts)[0].id

    def claim(self, job_id: str, number: int = 0, *, message: str = "m") -> Claim:
        with self.database.begin() as session:
            ids = session.scalars(select(Part.id).where(Part.job_id == job_id).order_by(Part.id))
            part_id = ids.all()[number]
            now = time.time()
            claim = claim_part(session, part_id, message=message, now=now, lease_seconds=30)
        assert claim is not None
        return claim

    def job(self, job_id: str) -> Job:
        with self.database.read() as session:
            return get_job(session, job_id)

    def parts(self, job_id: str) -> list[Part]:
        with self.database.read() as session:
            rows = select(Part).where(Part.job_id == job_id).order_by(Part.id)
            return list(session.scalars(rows))

    def age(self, seconds: float) -> None:
        """Let this process have begun its mesh earlier."""
        note = self.notes.read(HERE)
        assert note is not None
        self.writer.write(replace(note, since=note.since - seconds))


@pytest.fixture
def parent(database: Database, blobs: BlobStore, settings: Settings, tmp_path: Path) -> Parent:
    folder = tmp_path / "notes"
    folder.mkdir()
    return Parent(database, blobs, settings, folder)


def asked(number: int = 1) -> NewPart:
    return query_part(f"{number:064x}", "heat", "asked.off")


def test_a_query_says_what_is_done_until_it_has_ended(parent: Parent) -> None:
    job_id = parent.queue(asked())
    claim = parent.claim(job_id)
    parent.progress.begin(claim)
    parent.watcher.look()
    assert parent.job(job_id).step is None
    for step in ("reading", "simplifying", "spectrum"):
        parent.progress.enter(step)
        before = parent.job(job_id).revision
        parent.watcher.look()
        parent.watcher.look()
        assert parent.job(job_id).step == step
        assert parent.job(job_id).revision == before + 1, "its watchers are told once"
    with parent.database.begin() as session:
        release_part(session, claim, now=time.time())
    assert parent.job(job_id).step is None
    assert parent.killed == []


def test_small_uploads_cost_no_transaction_and_long_ones_say_their_step(parent: Parent) -> None:
    job_id = parent.queue(ingest_part("gone"), kind="ingest")
    parent.progress.begin(parent.claim(job_id))
    parent.progress.enter("spectrum")
    parent.watcher.look()
    assert parent.job(job_id).step is None
    parent.age(WORTH_TELLING_SECONDS)
    parent.watcher.look()
    assert parent.job(job_id).step == "spectrum"


def test_a_job_that_does_several_things_at_once_has_no_step(parent: Parent) -> None:
    job_id = parent.queue(asked(1), asked(2))
    parent.progress.begin(parent.claim(job_id))
    parent.progress.enter("spectrum")
    parent.watcher.look()
    assert parent.job(job_id).step is None


@pytest.mark.parametrize("limit", [120.0, SOON])
def test_what_was_cancelled_is_stopped_and_what_came_with_it_goes_back(
    parent: Parent, limit: float
) -> None:
    """Whether or not it would have been too long as well."""
    watcher = parent.with_limit(limit)
    vain, other = parent.queue(asked(1)), parent.queue(asked(2))
    claim, with_it = parent.claim(vain), parent.claim(other)
    elsewhere = parent.claim(parent.queue(asked(3)))
    with parent.database.begin() as session:
        session.get_one(Part, with_it.part_id).owner = claim.owner
    parent.progress.begin(claim)
    parent.progress.enter("spectrum")
    with parent.database.begin() as session:
        cancel_job(session, vain)
    time.sleep(2 * SOON)
    watcher.look()
    watcher.look()
    assert parent.killed == [HERE]
    assert parent.sent == [with_it.part_id]
    (released,) = parent.parts(other)
    assert (released.state, released.attempts, released.owner) == ("queued", 0, None)
    assert parent.parts(elsewhere.job_id)[0].state == "running"
    assert parent.job(vain).errors == []


def test_a_part_that_somebody_else_holds_by_now_is_stopped(parent: Parent) -> None:
    job_id = parent.queue(asked())
    claim = parent.claim(job_id)
    parent.progress.begin(claim)
    parent.progress.enter("spectrum")
    with parent.database.begin() as session:
        release_part(session, claim, now=time.time())
    held = parent.claim(job_id, message="of another process")
    parent.watcher.look()
    assert parent.killed == [HERE]
    (part,) = parent.parts(job_id)
    assert (part.state, part.owner) == ("running", held.owner)


def test_a_process_that_has_just_ended_its_work_is_not_killed(
    parent: Parent, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It does something else by the time at which the rows were read."""
    vain = parent.claim(parent.queue(asked(1)))
    parent.progress.begin(vain)
    parent.progress.enter("spectrum")
    old = parent.notes.read_all()
    monkeypatch.setattr(parent.notes, "read_all", lambda: old)
    with parent.database.begin() as session:
        cancel_job(session, vain.job_id)
    parent.progress.begin(parent.claim(parent.queue(asked(2)), message="next"))
    parent.progress.enter("reading")
    parent.watcher.look()
    assert parent.killed == []


def test_a_mesh_has_its_time_over_all_its_steps_and_each_mesh_its_own(parent: Parent) -> None:
    watcher = parent.with_limit(60.0)
    job_id = parent.queue(asked())
    claim = parent.claim(job_id)
    parent.progress.begin(claim)
    parent.progress.enter("reading")
    since = parent.notes.read_all()[HERE].since
    parent.progress.enter("spectrum")
    assert parent.notes.read_all()[HERE].since == since
    time.sleep(SOON)
    parent.progress.begin(claim, "the next")
    parent.progress.enter("reading")
    assert parent.notes.read_all()[HERE].since > since
    watcher.look()
    assert parent.killed == []
    parent.progress.begin(claim)
    parent.progress.enter("describing")
    parent.age(60.0)
    watcher.look()
    assert parent.killed == [HERE]
    (error,) = parent.job(job_id).errors
    assert error == {
        "item": "asked.off",
        "type": "time-limit",
        "detail": "was still at 'describing' after 60 s, the limit that PROTEUS_SHAPE_SECONDS sets",
    }
    assert parent.parts(job_id)[0].state == "failed"


@pytest.mark.parametrize("marks_shapes", [True, False])
def test_of_several_shapes_only_the_one_fails_whose_turn_it_was(
    parent: Parent, marks_shapes: bool
) -> None:
    with parent.database.begin() as session:
        row = make_collection(session)
        shapes = [make_shape(session, row, number) for number in range(3)]
    parts = describe_parts(shapes, "heat", marks_shapes=marks_shapes)
    job_id = parent.queue(*parts, kind="describe")
    parent.progress.begin(parent.claim(job_id), shapes[1])
    parent.progress.enter("spectrum")
    watcher = parent.with_limit(SOON)
    time.sleep(2 * SOON)
    watcher.look()
    job = parent.job(job_id)
    assert (job.done, job.total, job.failed) == (1, 3, 1)
    assert [(error["item"], error["type"]) for error in job.errors] == [("1.off", "time-limit")]
    first, rest = parent.parts(job_id)
    assert (first.state, first.payload["shape_ids"]) == ("succeeded", [shapes[1]])
    assert (rest.state, rest.payload["shape_ids"]) == ("queued", [shapes[0], shapes[2]])
    assert rest.payload["marks_shapes"] is marks_shapes
    assert parent.sent == [rest.id]
    with parent.database.read() as session:
        marked = [session.get_one(Shape, shape).error is not None for shape in shapes]
    assert marked == [False, marks_shapes, False]


def test_the_last_of_several_shapes_that_fails_ends_its_job(parent: Parent) -> None:
    with parent.database.begin() as session:
        shape = make_shape(session, make_collection(session), 1)
    job_id = parent.queue(*describe_parts([shape], "heat"), kind="describe")
    parent.progress.begin(parent.claim(job_id), shape)
    parent.progress.enter("reading")
    watcher = parent.with_limit(SOON)
    time.sleep(2 * SOON)
    watcher.look()
    assert (parent.job(job_id).state, parent.sent) == ("failed", [])


def test_a_folder_that_was_tidied_away_is_made_again(parent: Parent, tmp_path: Path) -> None:
    claim = parent.claim(parent.queue(asked(1)))
    parent.progress.begin(claim)
    parent.progress.enter("reading")
    shutil.rmtree(tmp_path / "notes")
    parent.watcher.look()
    parent.progress.enter("spectrum")
    parent.watcher.look()
    assert parent.job(claim.job_id).step == "spectrum"
    parent.progress.end()
    assert parent.notes.read_all() == {}


def test_a_note_that_is_being_written_is_read_later(parent: Parent, tmp_path: Path) -> None:
    claim = parent.claim(parent.queue(asked()))
    parent.progress.begin(claim)
    parent.progress.enter("reading")
    (path,) = (tmp_path / "notes").iterdir()
    whole = path.read_text()
    path.write_text(whole[:100])
    parent.watcher.look()
    assert (parent.job(claim.job_id).step, parent.killed) == (None, [])
    path.write_text(whole)
    parent.watcher.look()
    assert parent.job(claim.job_id).step == "reading"


def test_a_long_name_leaves_nothing_behind_a_short_one(parent: Parent) -> None:
    parent.progress.begin(parent.claim(parent.queue(asked())), "shape" * 20)
    parent.progress.enter("reading")
    parent.progress.begin(parent.claim(parent.queue(asked())))
    parent.progress.enter("reading")
    note = parent.notes.read(HERE)
    assert note is not None
    assert note.shape_id is None


def test_a_disk_that_is_full_stops_no_work(parent: Parent, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_note: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(parent.writer, "write", refuse)
    parent.progress.begin(parent.claim(parent.queue(asked())))
    parent.progress.enter("reading")
    parent.progress.end()
