"""From queued parts to shapes that are found, on both databases."""

import io
import zipfile
from collections.abc import Callable, Mapping
from functools import partial
from hashlib import sha256

import pytest
import structlog
from sqlalchemy import select

import workers.geometry.solution
from tests.pipeline.uploads import Upload, potato
from workers.errors import SpectrumError
from workers.geometry.arrays import Float32Array
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import Spectrum, compute_spectrum
from workers.pipeline.activation_plan import plan_activation
from workers.pipeline.outcome import Outcome, Verb
from workers.pipeline.part_kinds import query_part, unpack_part
from workers.pipeline.redescribe import describe_stored, redescribe
from workers.pipeline.unpack import unpack
from workers.pipeline.verbs import VERBS
from workers.pipeline.work import run_part, run_pending
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model
from workers.settings import Settings
from workers.storage.blobs import (
    BlobStore,
    archive_key,
    cleaned_key,
    thumbnail_key,
)
from workers.storage.collections import (
    count_shapes,
    create_collection,
    delete_collection,
    get_collection,
)
from workers.storage.database import Database
from workers.storage.descriptors import get_query_vector, get_vector
from workers.storage.jobs import cancel_job, create_job, get_job, retry_job
from workers.storage.models import Part, Shape
from workers.storage.parts import Claim
from workers.storage.shapes import ShapeView, delete_shape, get_shape, page_of_shapes

Work = Callable[[], int]


def shape(database: Database, shape_id: str) -> ShapeView:
    with database.read() as session:
        return get_shape(session, shape_id)


def vector(database: Database, shape_id: str, model: str = "heat") -> bytes | None:
    with database.read() as session:
        return get_vector(session, shape_id, model)


def job_state(database: Database, job: str) -> tuple[str, int, int]:
    with database.read() as session:
        row = get_job(session, job)
        return row.state, row.done, row.total


def test_an_upload_becomes_a_shape_that_is_described(
    database: Database, blobs: BlobStore, zoo: str, upload: Upload, work: Work
) -> None:
    data = potato(1)
    job, (one,) = upload(zoo, data)
    assert shape(database, one).state == "queued"
    work()
    view = shape(database, one)
    assert (view.state, view.row.format, view.row.n_vertices) == ("ready", "off", 642)
    assert (view.row.n_components, view.row.n_boundary_loops) == (1, 0)
    assert job_state(database, job) == ("succeeded", 1, 1)
    digest = sha256(data).hexdigest()
    assert blobs.get(thumbnail_key(digest)).startswith(b"\x89PNG")
    assert blobs.exists(cleaned_key(digest))


def test_a_shape_says_what_was_out_of_the_ordinary_in_solving_it(
    database: Database, zoo: str, upload: Upload, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    def of_coarse_meshes_alone(mesh: TriangleMesh, *, n_eigenpairs: int) -> Spectrum:
        if mesh.n_vertices > 2000:
            raise SpectrumError("not certified")
        return compute_spectrum(mesh, n_eigenpairs=n_eigenpairs)

    monkeypatch.setattr(workers.geometry.solution, "compute_spectrum", of_coarse_meshes_alone)
    expected = "closed view: solved with 1,"
    for _ in range(2):  # the second one finds what the first one stored
        _, (one,) = upload(zoo, potato(9))
        work()
        (found,) = shape(database, one).row.repairs
        assert found.startswith(expected)


def test_a_bad_file_fails_with_its_reason_and_the_rest_goes_on(
    database: Database, zoo: str, upload: Upload, work: Work
) -> None:
    truncated = potato(2)[:2000]
    job, (bad, good) = upload(zoo, truncated, potato(3))
    work()
    error = shape(database, bad).row.error
    assert shape(database, bad).state == "failed"
    assert error is not None
    assert error["type"] == "invalid-mesh"
    assert shape(database, good).state == "ready"
    assert job_state(database, job) == ("succeeded", 2, 2)
    with database.read() as session:
        (named,) = get_job(session, job).errors
    assert named == {"item": "0.off", **error}


def test_the_same_bytes_have_the_same_descriptor_by_every_way(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str, upload: Upload, work: Work
) -> None:
    """Uploaded twice, as a query, and described again later from what is stored."""
    data = potato(4)
    with database.begin() as session:
        create_collection(session, name="other", description="", model="commute-time")
    _, (first,) = upload(zoo, data)
    work()
    _, (second,) = upload("other", data)
    work()
    digest = sha256(data).hexdigest()
    with database.begin() as session:
        part = query_part(digest, "heat", "q.off")
        create_job(session, kind="query", unit="meshes", parts=[part])
        plan_activation(session, "other", "heat")
        plan_activation(session, zoo, "commute-time")
    work()
    with database.read() as session:
        asked = get_query_vector(session, digest, "heat")
    assert vector(database, first) is not None
    assert vector(database, first) == vector(database, second) == asked
    assert vector(database, first, "commute-time") == vector(database, second, "commute-time")


def test_a_collection_moves_when_all_is_described_and_uploads_meanwhile_are_under_both(
    database: Database, zoo: str, upload: Upload, work: Work
) -> None:
    _, (early,) = upload(zoo, potato(5))
    work()
    with database.begin() as session:
        job, _ = plan_activation(session, zoo, "biharmonic")
    _, (late,) = upload(zoo, potato(6))
    with database.read() as session:
        assert get_collection(session, zoo).model == "heat"
    work()
    with database.read() as session:
        assert get_collection(session, zoo).model == "biharmonic"
    assert job_state(database, job.id)[0] == "succeeded"
    for one in (early, late):
        assert shape(database, one).state == "ready"
        assert vector(database, one, "heat") is not None
        assert vector(database, one, "biharmonic") is not None


def test_a_shape_that_cannot_be_described_anew_is_found_as_long_as_it_has_a_descriptor(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str, upload: Upload, work: Work
) -> None:
    """State and search never disagree: before the move, after it, back again, and retried."""
    _, (bad, good) = upload(zoo, potato(5), potato(6))
    work()

    def move(model: str, verbs: Mapping[str, Verb] = VERBS) -> None:
        with database.begin() as session:
            plan_activation(session, zoo, model)
        assert shape(database, bad).state == before
        run_pending(database, blobs, settings, verbs=verbs)

    def fail_for_bad(bench: Workbench, row: Shape, model: Model) -> Float32Array:
        if row.id == bad:
            raise SpectrumError("made to fail")
        return describe_stored(bench, row, model)

    before = "ready"
    move("biharmonic", {**VERBS, "describe": partial(redescribe, describe_shape=fail_for_bad)})
    with database.read() as session:
        zoo_row = get_collection(session, zoo)
        assert zoo_row.model == "biharmonic"
        counts = count_shapes(session, [zoo_row])[zoo_row.id]
    assert (counts.ready, counts.failed) == (1, 1)
    assert (shape(database, bad).state, shape(database, good).state) == ("failed", "ready")
    before = "failed"
    move("heat")
    with database.read() as session:
        counts = count_shapes(session, [get_collection(session, zoo)])[zoo_row.id]
    assert (counts.ready, counts.failed) == (2, 0)
    before = "ready"
    move("biharmonic")  # nothing fails this time
    assert shape(database, bad).state == "ready"
    assert shape(database, bad).row.error is None


def test_going_back_computes_nothing(
    database: Database, zoo: str, upload: Upload, work: Work
) -> None:
    upload(zoo, potato(5))
    work()
    for model in ("biharmonic", "heat"):
        with database.begin() as session:
            job, _ = plan_activation(session, zoo, model)
        work()
    assert job_state(database, job.id) == ("succeeded", 0, 0)
    with database.read() as session:
        assert get_collection(session, zoo).model == "heat"


def test_an_archive_becomes_shapes_and_its_bad_entries_are_named(
    database: Database, blobs: BlobStore, zoo: str, work: Work
) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("cats/a.off", potato(7))
        archive.writestr("cat.holes.3.off", potato(8))
        archive.writestr("cats/same.off", potato(7))
        archive.writestr("../b.off", potato(9))
        archive.writestr("no.off", b"no mesh at all")
    data = buffer.getvalue()
    digest = sha256(data).hexdigest()
    blobs.put(archive_key(digest), data)
    with database.begin() as session:
        row = get_collection(session, zoo)
        part = unpack_part(row.id, digest, filename="a.zip", label=None, attributes={"from": "zip"})
        job, _ = create_job(session, kind="ingest", unit="shapes", parts=[part])
    work()
    with database.read() as session:
        views = page_of_shapes(session, row.id, limit=9, cursor=None).items
        errors = get_job(session, job.id).errors
    found = {
        v.row.name: (v.state, v.row.label, v.row.transformation, v.row.strength) for v in views
    }
    assert found == {
        "a.off": ("ready", "cats", None, None),
        "cat.holes.3.off": ("ready", "cat", "holes", 3),
        "no.off": ("failed", None, None, None),
    }
    assert [view.row.attributes for view in views] == [{"from": "zip"}] * 3
    assert sorted(error["item"] for error in errors) == ["../b.off", "no.off"]
    assert job_state(database, job.id) == ("succeeded", 5, 5)


def test_a_long_archive_is_unpacked_by_several_parts(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str
) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("readme.txt", "passed over")
        for number in range(7):
            archive.writestr(f"{number}.off", f"no mesh, number {number}")
        archive.writestr("again.off", "no mesh, number 0")
        archive.writestr("../b.off", "refused")
    data = buffer.getvalue()
    digest = sha256(data).hexdigest()
    blobs.put(archive_key(digest), data)
    with database.begin() as session:
        row = get_collection(session, zoo)
        part = unpack_part(row.id, digest, filename="a.zip", label="thing", attributes={})
        job, _ = create_job(session, kind="ingest", unit="shapes", parts=[part])
    verbs: dict[str, Verb] = {**VERBS, "unpack": partial(unpack, entries_a_part=4)}
    assert run_pending(database, blobs, settings, verbs=verbs) == 1 + 3 + 7
    with database.read() as session:
        views = page_of_shapes(session, row.id, limit=20, cursor=None).items
        kinds = session.scalars(select(Part.kind).where(Part.job_id == job.id)).all()
        found = get_job(session, job.id)
    assert sorted(view.row.name for view in views) == [f"{number}.off" for number in range(7)]
    assert {(view.row.label, view.row.job_id) for view in views} == {("thing", job.id)}
    assert kinds.count("unpack") == 4
    assert (found.total, found.done, found.failed) == (9, 9, 8)  # one is there twice
    assert len([error for error in found.errors if error["item"] == "../b.off"]) == 1


def test_an_archive_whose_job_was_cancelled_halfway_is_counted_once_after_a_retry(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str
) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for number in range(4):
            archive.writestr(f"{number}.off", f"no mesh, number {number}")
        archive.writestr("../b.off", "refused")
    data = buffer.getvalue()
    digest = sha256(data).hexdigest()
    blobs.put(archive_key(digest), data)
    with database.begin() as session:
        row = get_collection(session, zoo)
        part = unpack_part(row.id, digest, filename="a.zip", label=None, attributes={})
        job, _ = create_job(session, kind="ingest", unit="shapes", parts=[part])
    verbs: dict[str, Verb] = {**VERBS, "unpack": partial(unpack, entries_a_part=2)}
    bench = Workbench(database, blobs, settings, lambda _parts: None)
    for _ in range(2):  # the archive is divided, and its first two entries are unpacked
        with database.read() as session:
            unpacking = select(Part.id).where(Part.kind == "unpack", Part.state == "queued")
            first = session.scalars(unpacking.order_by(Part.id)).all()[0]
        run_part(bench, first, message="m", verbs=verbs)
    with database.begin() as session:
        cancel_job(session, job.id)
    with database.begin() as session:
        retry_job(session, job.id)
    run_pending(database, blobs, settings, verbs=verbs)
    with database.read() as session:
        found = get_job(session, job.id)
    assert (found.total, found.done, found.failed) == (5, 5, 5)
    assert sorted(error["item"] for error in found.errors) == [
        "../b.off", *(f"{number}.off" for number in range(4)),
    ]  # fmt: skip


def test_a_blob_that_cannot_be_deleted_fails_no_part(
    database: Database, settings: Settings, zoo: str, blobs: BlobStore, upload: Upload
) -> None:
    class AwayStore(BlobStore):
        def delete(self, key: str) -> None:
            raise OSError(key)

    def end(_bench: Workbench, _claim: Claim) -> Outcome:
        return Outcome(obsolete=["one", "two"])

    job, _ = upload(zoo, b"a")
    away = AwayStore(settings.resolved_blob_url)
    with structlog.testing.capture_logs() as logs:
        run_pending(database, away, settings, verbs={"ingest": end})
    assert job_state(database, job) == ("succeeded", 1, 1)
    assert [(line["event"], line["key"]) for line in logs[:2]] == [
        ("blob not deleted", "one"),
        ("blob not deleted", "two"),
    ]


def test_an_archive_without_a_mesh_fails_its_job(
    database: Database, blobs: BlobStore, zoo: str, work: Work
) -> None:
    blobs.put(archive_key("0" * 64), b"PK\x03\x04 and nothing more")
    with database.begin() as session:
        row = get_collection(session, zoo)
        part = unpack_part(row.id, "0" * 64, filename="a.zip", label=None, attributes={})
        job, _ = create_job(session, kind="ingest", unit="shapes", parts=[part])
    work()
    assert job_state(database, job.id) == ("failed", 1, 1)
    with database.read() as session:
        assert [error["item"] for error in get_job(session, job.id).errors] == ["a.zip"]


def test_what_was_deleted_while_it_waited_does_no_harm(
    database: Database, zoo: str, upload: Upload, work: Work
) -> None:
    job, (gone, stays) = upload(zoo, potato(10), potato(11))
    with database.begin() as session:
        delete_shape(session, gone)
    work()
    assert shape(database, stays).state == "ready"
    assert job_state(database, job) == ("succeeded", 2, 2)
    other, _ = upload(zoo, potato(12))
    with database.begin() as session:
        delete_collection(session, zoo)
    work()
    assert job_state(database, other) == ("succeeded", 1, 1)


def test_an_unexpected_error_is_tried_three_times_and_then_named(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str, upload: Upload
) -> None:
    calls = []

    def broken(_bench: Workbench, claim: Claim) -> Outcome:
        calls.append(claim)
        raise ZeroDivisionError

    job, (one,) = upload(zoo, potato(13))
    run_pending(database, blobs, settings, verbs={"ingest": broken})
    assert len(calls) == 3
    error = shape(database, one).row.error
    assert error is not None
    assert error["type"] == "internal-error"
    assert job_state(database, job)[0] == "failed"


def test_a_doubled_message_finds_nothing_to_do(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str, upload: Upload
) -> None:
    upload(zoo, potato(14))
    with database.read() as session:
        part = session.scalars(select(Part.id)).one()
    bench = Workbench(database, blobs, settings, lambda _parts: None)
    run_part(bench, part, message="first")
    with database.read() as session:
        before = session.get_one(Part, part)
    run_part(bench, part, message="second")
    with database.read() as session:
        after = session.get_one(Part, part)
    assert (before.attempts, after.attempts, after.message) == (1, 1, "first")


def test_an_unknown_mesh_key_never_hangs_a_query(database: Database, zoo: str, work: Work) -> None:
    with database.begin() as session:
        part = query_part("f" * 64, "heat", "gone.off")
        job, _ = create_job(session, kind="query", unit="meshes", parts=[part])
    work()
    with database.read() as session:
        (error,) = get_job(session, job.id).errors
    assert error["item"] == "gone.off"
    assert job_state(database, job.id)[0] == "failed"
