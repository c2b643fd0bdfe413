"""The verb `prune`: kind after kind, whatever it is interrupted by, and once a day by itself."""

import io
import os
import time
import zipfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest
from sqlalchemy import select

from tests.pipeline.crashes import CrashError
from tests.pipeline.uploads import Upload, potato
from workers.pipeline.outcome import GoOn
from workers.pipeline.part_kinds import unpack_part
from workers.pipeline.prune import plan_pruning, plan_pruning_if_due, prune, prune_part
from workers.pipeline.unpack import unpack
from workers.pipeline.work import run_part, run_pending
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore, archive_key, mesh_key
from workers.storage.collections import get_collection
from workers.storage.database import Database
from workers.storage.jobs import cancel_job, create_job, get_job
from workers.storage.models import Job, Part, Shape
from workers.storage.parts import claim_part
from workers.storage.pruning import KINDS
from workers.storage.shapes import delete_shape

Work = Callable[[], int]


@pytest.fixture
def bench(database: Database, blobs: BlobStore, settings: Settings) -> Workbench:
    return Workbench(database, blobs, settings, lambda _: None)


def plan(database: Database) -> str:
    with database.begin() as session:
        return plan_pruning(session, now=time.time())[0].id


def job_of(database: Database, job_id: str) -> Job:
    with database.read() as session:
        return get_job(session, job_id)


def make_old(folder: Path) -> None:
    """Let all files look as if they were a year old."""
    for path in folder.rglob("*"):
        os.utime(path, (time.time() - 365 * 86_400,) * 2)


def meshes(settings: Settings) -> list[str]:
    return sorted(path.name for path in (settings.data_path / "blobs/meshes").glob("*/*"))


def test_a_run_frees_what_was_deleted_and_says_what_that_was(
    database: Database, settings: Settings, zoo: str, upload: Upload, work: Work
) -> None:
    _, (gone, stays) = upload(zoo, potato(1), potato(2))
    work()
    with database.begin() as session:
        delete_shape(session, gone)
        kept = session.get_one(Shape, stays).sha256
    make_old(settings.data_path / "blobs")
    job_id = plan(database)
    assert work() == len(KINDS)
    job = job_of(database, job_id)
    assert (job.state, job.done, job.total) == ("succeeded", len(KINDS), len(KINDS))
    assert job.result is not None
    counts = {kind["kind"]: kind["count"] for kind in job.result["kinds"]}
    assert list(counts) == list(KINDS)
    assert (counts["meshes"], counts["computed"], counts["jobs"]) == (1, 3, 0)
    assert job.result["count"] == sum(counts.values())
    assert job.result["bytes"] > len(potato(1))
    assert meshes(settings) == [kept]


def test_one_run_at_a_time_and_a_day_between_two(database: Database, settings: Settings) -> None:
    first = plan(database)
    assert plan(database) == first
    now = time.time()
    assert plan_pruning_if_due(database, settings, now=now) == []
    with database.begin() as session:
        cancel_job(session, first)
    assert plan_pruning_if_due(database, settings, now=now) == []
    (part,) = plan_pruning_if_due(database, settings, now=now + 25 * 3600)
    assert part.job_id != first
    assert plan_pruning_if_due(database, settings, now=now + 26 * 3600) == []
    never = settings.model_copy(update={"prune_hours": 0.0})
    assert plan_pruning_if_due(database, never, now=now + 1e9) == []


def test_a_part_whose_time_is_up_leaves_the_rest_to_another(
    database: Database, blobs: BlobStore, settings: Settings, bench: Workbench
) -> None:
    for content in range(6):
        blobs.put(mesh_key(f"{content:02x}".ljust(64, "0")), b"1")
    make_old(settings.data_path / "blobs")
    with database.begin() as session:
        part = prune_part(["meshes", "uploads"], {}, after="")
        job, (row,) = create_job(session, kind="prune", unit="kinds", parts=[part])
        claim = claim_part(session, row.id, message="m", now=time.time(), lease_seconds=60.0)
    assert claim is not None
    outcome = prune(bench, claim, seconds=0.0)
    (rest,) = outcome.follow_up
    assert rest.payload["kinds"] == ["meshes", "uploads"]
    assert rest.payload["after"] == "meshes/00"
    assert rest.payload["freed"] == {"meshes": {"count": 1, "bytes": 1}}
    assert len(meshes(settings)) == 5
    with database.begin() as session:
        cancel_job(session, job.id)
        create_job(session, kind="prune", unit="kinds", parts=[rest])
    run_pending(database, blobs, settings)
    assert meshes(settings) == []


def run_all(bench: Workbench) -> None:
    """Run the parts of a job one after another."""
    for _ in KINDS:
        with bench.database.read() as session:
            queued = session.scalars(select(Part.id).where(Part.state == "queued")).one()
        run_part(bench, queued, message="m")


class Dying(BlobStore):
    """A store whose process is killed at a deletion."""

    def __init__(self, url: str, deletions: int) -> None:
        super().__init__(url)
        self._left = deletions

    def delete(self, key: str) -> None:
        if not self._left:
            raise CrashError
        self._left -= 1
        super().delete(key)


@pytest.mark.parametrize("deletions", [0, 1, 4, 7])
def test_a_worker_that_dies_in_the_middle_loses_nothing_but_time(
    database: Database,
    blobs: BlobStore,
    settings: Settings,
    zoo: str,
    upload: Upload,
    deletions: int,
) -> None:
    _, shapes = upload(zoo, *map(potato, range(10)))
    with database.begin() as session:
        kept = sorted(session.get_one(Shape, shape).sha256 for shape in shapes[8:])
        for shape in shapes[:8]:
            delete_shape(session, shape)
        for job in session.scalars(select(Job.id)).all():
            cancel_job(session, job)
    make_old(settings.data_path / "blobs")
    job_id = plan(database)
    dying = Workbench(
        database, Dying(settings.resolved_blob_url, deletions), settings, lambda _: None
    )
    with pytest.raises(CrashError):
        run_all(dying)
    assert set(kept) <= set(meshes(settings))
    with database.begin() as session:
        session.scalars(select(Part).where(Part.state == "running")).one().state = "queued"
    run_pending(database, blobs, settings)
    assert job_of(database, job_id).state == "succeeded"
    assert meshes(settings) == kept


def test_an_archive_whose_meshes_were_pruned_meanwhile_is_unpacked_again(
    database: Database, blobs: BlobStore, bench: Workbench, zoo: str, work: Work
) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("one.off", potato(1))
    digest = sha256(buffer.getvalue()).hexdigest()
    blobs.put(archive_key(digest), buffer.getvalue())
    with database.begin() as session:
        collection = get_collection(session, zoo)
        part = unpack_part(collection.id, digest, filename="a.zip", label=None, attributes={})
        job, (row,) = create_job(session, kind="ingest", unit="shapes", parts=[part])
        claim = claim_part(session, row.id, message="m", now=time.time(), lease_seconds=60.0)
    assert claim is not None
    outcome = unpack(bench, claim)
    mesh = mesh_key(sha256(potato(1)).hexdigest())
    blobs.delete(mesh)
    assert outcome.store is not None
    with database.begin() as session:
        again = outcome.store(session, get_job(session, job.id, lock=True))
    assert isinstance(again, GoOn)
    assert again.compute().store is not None
    assert blobs.get(mesh) == potato(1)
