"""A worker that dies anywhere leaves nothing behind that another would count twice."""

import io
import shutil
import tarfile
import zipfile
from collections.abc import Callable, Mapping
from functools import partial
from hashlib import sha256
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from tests.meshes import bumpy_sphere
from tests.pipeline.crashes import (
    Countdown,
    CrashError,
    crashing_bench,
    rows_of,
    work_until_nothing_is_left,
)
from tests.pipeline.evaluations import Zoo
from tests.pipeline.trainings import begin_bank, begin_training, small_bench, work
from tests.pipeline.uploads import store_upload
from workers.errors import InvalidMeshError
from workers.geometry.formats import write
from workers.pipeline.activation_plan import plan_activation
from workers.pipeline.outcome import Outcome, Verb
from workers.pipeline.part_kinds import query_part, unpack_part
from workers.pipeline.unpack import unpack as unpack_archive
from workers.pipeline.verbs import VERBS
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import archive_key, mesh_key, thumbnail_key
from workers.storage.collections import create_collection, get_collection
from workers.storage.descriptors import store_descriptors
from workers.storage.jobs import create_job
from workers.storage.migrate import migrate
from workers.storage.models import Job, Shape
from workers.storage.parts import Claim
from workers.training.request import TrainingRequest


def pea(seed: int) -> bytes:
    """A bumpy sphere of 162 vertices as OFF, which is solved quickly."""
    return write(bumpy_sphere(2, seed), "off")


LEARNED = TrainingRequest(transformations=("scale",), strengths=(3,), shapes=2)
COPIES = TrainingRequest(transformations=("scale",), strengths=(2,), creatures=2)


def ingest(bench: Workbench) -> None:
    store_upload(bench.database, bench.blobs, "zoo", pea(1), pea(2)[:500])


def ingest_together(bench: Workbench) -> None:
    """Three shapes in one claim, one of which is refused, and others in claims of their own."""
    store_upload(bench.database, bench.blobs, "zoo", *(bytes([i]) * 9 for i in range(9)))


def unpack(bench: Workbench) -> None:
    """Three meshes, one of them twice, one there already; and an entry that is refused."""
    store_upload(bench.database, bench.blobs, "zoo", pea(1))
    work(bench)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, seed in (("a", 1), ("b", 2), ("c", 3), ("same", 3)):
            archive.writestr(f"cats/{name}.off", pea(seed))
        archive.writestr("../out.off", pea(9))
    digest = sha256(buffer.getvalue()).hexdigest()
    bench.blobs.put(archive_key(digest), buffer.getvalue())
    with bench.database.begin() as session:
        row = get_collection(session, "zoo")
        part = unpack_part(row.id, digest, filename="a.zip", label=None, attributes={})
        create_job(session, kind="ingest", unit="shapes", parts=[part])


def unpack_by_parts(bench: Workbench) -> None:
    """The same by three parts of two entries each, after one that divides the archive."""
    unpack(bench)


def unpack_tar_by_parts(bench: Workbench) -> None:
    """A compressed tar archive with an archive in it, and files that are skipped."""
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as archive:
        archive.writestr("cats/a.off", pea(1))
        archive.writestr("cats/a.png", b"")
    files = {"in.zip": inner.getvalue(), "read.me": b"x", "b.off": pea(2), "../c.off": pea(3)}
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz") as tar:
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    digest = sha256(buffer.getvalue()).hexdigest()
    bench.blobs.put(archive_key(digest), buffer.getvalue())
    with bench.database.begin() as session:
        row = get_collection(session, "zoo")
        part = unpack_part(row.id, digest, filename="a.tgz", label=None, attributes={})
        create_job(session, kind="ingest", unit="shapes", parts=[part])


def query(bench: Workbench) -> None:
    digest = sha256(pea(1)).hexdigest()
    bench.blobs.put(mesh_key(digest), pea(1))
    with bench.database.begin() as session:
        part = query_part(digest, "heat", "q.off")
        create_job(session, kind="query", unit="meshes", parts=[part])


def activate(bench: Workbench) -> None:
    store_upload(bench.database, bench.blobs, "zoo", pea(1), pea(2))
    work(bench)
    with bench.database.begin() as session:
        plan_activation(session, "zoo", "commute-time")


def evaluate(bench: Workbench) -> None:
    park = Zoo(bench.database, bench.blobs, bench.settings)
    park.add("cat.null.0.off", "dog.null.0.off", "cat.holes.1.off", "dog.holes.1.off")
    park.ask("heat")


def train(bench: Workbench) -> None:
    """Moments are stored already, by another training."""
    begin_training(bench, "earlier", LEARNED)
    work(bench)
    begin_training(bench, "mine", LEARNED)


def train_bank(bench: Workbench) -> None:
    """Descriptors are stored already, by another training."""
    begin_bank(bench, "earlier", COPIES)
    work(bench)
    begin_bank(bench, "mine", COPIES)


def end_at_once(_bench: Workbench, _claim: Claim) -> Outcome:
    return Outcome()


def describe_plainly(bench: Workbench, claim: Claim) -> Outcome:
    """Store a descriptor and a blob; the second shape is refused."""
    with bench.database.read() as session:
        shape = session.get_one(Shape, claim.shape_id)
    if shape.name == "1.off":
        raise InvalidMeshError("it has no faces")
    bench.blobs.put(thumbnail_key(shape.sha256), b"")

    def store(session: Session, _job: Job) -> None:
        store_descriptors(session, shape.collection_id, [(shape.id, "heat", b"\0\0\0\0")])

    return Outcome(store=store)


UNSOLVED: Mapping[str, Verb] = {**VERBS, "ingest": end_at_once}
PREPARATIONS: Mapping[Callable[[Workbench], None], Mapping[str, Verb]] = {
    ingest: VERBS,
    ingest_together: {**VERBS, "ingest": describe_plainly},
    unpack: UNSOLVED,
    unpack_by_parts: {**UNSOLVED, "unpack": partial(unpack_archive, entries_a_part=2)},
    unpack_tar_by_parts: {**UNSOLVED, "unpack": partial(unpack_archive, entries_a_part=2)},
    query: VERBS,
    activate: VERBS,
    evaluate: VERBS,
    train: VERBS,
    train_bank: VERBS,
}


@pytest.fixture(scope="module", params=PREPARATIONS, ids=lambda prepare: prepare.__name__)
def prepared(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Mapping[str, Verb]]:
    """A data directory in which a job is queued, and the verbs that do it."""
    prepare: Callable[[Workbench], None] = request.param
    folder = tmp_path_factory.mktemp("prepared") / "data"
    bench = small_bench(folder)
    migrate(bench.settings)
    with bench.database.begin() as session:
        create_collection(session, name="zoo", description="", model="heat")
    prepare(bench)
    bench.database.dispose()
    return folder, PREPARATIONS[prepare]


def test_a_crash_after_any_step_changes_nothing_that_is_stored(
    prepared: tuple[Path, Mapping[str, Verb]], tmp_path: Path
) -> None:
    folder, verbs = prepared
    countdown = Countdown()
    undisturbed = crashing_bench(shutil.copytree(folder, tmp_path / "undisturbed"), countdown)
    work_until_nothing_is_left(undisturbed, verbs)
    expected = rows_of(undisturbed)
    undisturbed.database.dispose()
    assert countdown.taken >= 2
    for steps in range(1, countdown.taken + 1):
        bench = crashing_bench(
            shutil.copytree(folder, tmp_path / str(steps)), Countdown(steps=steps)
        )
        with pytest.raises(CrashError):
            work_until_nothing_is_left(bench, verbs)
        work_until_nothing_is_left(bench, verbs)
        assert rows_of(bench) == expected, f"after a crash at step {steps}"
        bench.database.dispose()
        shutil.rmtree(tmp_path / str(steps))
