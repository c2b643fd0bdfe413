"""Pruning: what is old and unused goes, what anything refers to stays, whoever writes meanwhile."""

import os
import threading
import time
import uuid
from pathlib import Path

import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from tests.storage.rows import make_collection, make_model, make_shape
from workers.settings import INGEST, LIGHT, Settings
from workers.storage.blobs import (
    BlobStore,
    archive_key,
    cleaned_key,
    correspondence_key,
    failure_key,
    frame_key,
    mesh_key,
    spectrum_key,
    thumbnail_key,
    training_key,
)
from workers.storage.collections import delete_collection
from workers.storage.database import Database
from workers.storage.descriptors import get_query_vector, store_descriptors, store_query_vectors
from workers.storage.evaluations import create_evaluation, finish_evaluation
from workers.storage.jobs import NewPart, cancel_job, create_job
from workers.storage.models import Collection, Job, Part, Query, TrainedModel
from workers.storage.pruning import DAY, KINDS, Store, free, measure
from workers.storage.queries import create_query, get_query
from workers.storage.references import hold_blobs
from workers.storage.retention import Amount
from workers.storage.shapes import delete_shape
from workers.storage.stale_files import index_file_name
from workers.storage.trained_models import model_fingerprint
from workers.storage.unused_blobs import Unused, contents_of, is_partial

LATER = 1000 * DAY
"""By so much a run is later than what the tests store: all of that is old."""


@pytest.fixture(params=["file", "memory"])
def store(request: pytest.FixtureRequest, database: Database, settings: Settings) -> Store:
    """An empty store, whose blobs are on disk or elsewhere, long after all was stored."""
    url = settings.resolved_blob_url if request.param == "file" else f"memory://{uuid.uuid4().hex}"
    return Store(database, BlobStore(url), settings, time.time() + LATER)


def digest(number: int) -> str:
    return f"{number:064x}"


def keys_of(content: int) -> list[str]:
    """Keys of all that is stored of a mesh."""
    sha256 = digest(content)
    spectrum = spectrum_key(sha256, "view")
    return sorted([mesh_key(sha256), cleaned_key(sha256), thumbnail_key(sha256), spectrum])


def put_mesh(blobs: BlobStore, content: int) -> None:
    for key in keys_of(content):
        blobs.put(key, b"12345")


def stored(blobs: BlobStore, *prefixes: str) -> list[str]:
    """Keys of all blobs below some prefixes, or of all meshes and what was computed of them."""
    chosen = prefixes or ("cleaned", "meshes", "spectra", "thumbnails")
    folders = [folder for prefix in chosen for folder in blobs.folders(prefix)]
    return sorted(blob.key for folder in folders for blob in blobs.blobs(folder))


def free_all(store: Store, *names: str) -> Amount:
    steps = [step for name in names or KINDS for step in free(store, name)]
    return sum((step.freed for step in steps), Amount())


def ask(session: Session, collection: Collection, content: int, job: str | None = None) -> Query:
    return create_query(
        session,
        collection_id=collection.id,
        job_id=job,
        sha256=digest(content),
        model="heat",
        parameters={},
    )


def open_part(store: Store, kind: str, payload: dict[str, object]) -> str:
    """Id of a job with one part that waits."""
    with store.database.begin() as session:
        part = NewPart("any", LIGHT, payload)
        return create_job(session, kind=kind, unit="shapes", parts=[part])[0].id


def test_all_that_is_stored_of_a_deleted_shape_goes(store: Store) -> None:
    for content in (1, 2):
        put_mesh(store.blobs, content)
    with store.database.begin() as session:
        zoo = make_collection(session)
        gone, _stays = (make_shape(session, zoo, content) for content in (1, 2))
    assert free_all(store) == Amount()
    with store.database.begin() as session:
        delete_shape(session, gone)
    assert measure(store, "computed") == Amount(3, 15)
    assert measure(store, "meshes") == Amount(1, 5)
    assert len(stored(store.blobs)) == 8, "measuring changes nothing"
    assert free_all(store) == Amount(4, 20)
    assert stored(store.blobs) == keys_of(2)


def test_a_mesh_stays_while_another_collection_a_query_or_work_has_it(store: Store) -> None:
    for content in (1, 2, 3, 4):
        put_mesh(store.blobs, content)
    with store.database.begin() as session:
        zoo, park = make_collection(session), make_collection(session, "park")
        make_shape(session, zoo, 1)
        make_shape(session, park, 1)
        asked = ask(session, park, 2)
        asked.created_at += LATER
        delete_collection(session, "zoo")
    pair = {"source": {"sha256": digest(3)}, "change": {"seed": 1}, "list": [{"sha256": "x"}]}
    job = open_part(store, "train", pair)
    assert free_all(store) == Amount(4, 20)
    assert stored(store.blobs) == sorted(keys_of(1) + keys_of(2) + keys_of(3))
    with store.database.begin() as session:
        cancel_job(session, job)
        session.get_one(Job, job).finished_at = store.now
    assert free_all(store, "meshes") == Amount(), "the job can be retried"
    with store.database.begin() as session:
        session.get_one(Job, job).finished_at = 0.0
    assert free_all(store) == Amount(1 + 4, 20), "its meshes go with it"
    assert stored(store.blobs) == sorted(keys_of(1) + keys_of(2))


def test_what_is_young_stays_and_storing_it_again_makes_it_young(store: Store) -> None:
    put_mesh(store.blobs, 1)
    put_mesh(store.blobs, 2)
    time.sleep(0.02)
    now = time.time()
    time.sleep(0.02)
    put_mesh(store.blobs, 2)
    then = now + store.settings.keep_unused_days * DAY
    earlier = Store(store.database, store.blobs, store.settings, then)
    free_all(earlier, "computed", "meshes")
    assert stored(store.blobs) == keys_of(2)


def test_an_upload_of_the_same_bytes_saves_what_was_found_unused(store: Store) -> None:
    """Between the listing and the deletion: its row was committed, or its blob stored again."""
    before = time.time() + 0.02
    put_mesh(store.blobs, 1)
    put_mesh(store.blobs, 2)
    time.sleep(0.05)
    unused = Unused(store.database, store.blobs, before, before)
    found = list(unused.meshes())
    assert len(found) in {1, 2}
    with store.database.begin() as session:
        make_shape(session, make_collection(session), 1)
    store.blobs.put(mesh_key(digest(2)), b"12345")
    assert sum((step.freed for step in unused.delete(found)), Amount()) == Amount()
    assert store.blobs.exists(mesh_key(digest(1)))
    assert store.blobs.exists(mesh_key(digest(2)))


def test_a_deletion_waits_for_the_upload_that_is_about_to_commit(store: Store) -> None:
    """The upload has seen the blob, and nobody else sees its row yet."""
    put_mesh(store.blobs, 1)
    with store.database.begin() as session:
        zoo = make_collection(session).id
    unused = Unused(store.database, store.blobs, time.time(), store.now)
    found = list(unused.meshes())
    assert sum(len(one.blobs) for one in found) == 1
    seen = threading.Event()

    def upload() -> None:
        with store.database.begin() as session:
            make_shape(session, session.get_one(Collection, zoo), 1)
            hold_blobs(session)
            assert store.blobs.exists(mesh_key(digest(1)))
            seen.set()
            time.sleep(0.3)

    thread = threading.Thread(target=upload)
    thread.start()
    seen.wait()
    freed = sum((step.freed for step in unused.delete(found)), Amount())
    thread.join()
    assert freed == Amount()
    assert store.blobs.exists(mesh_key(digest(1)))


def test_work_that_was_planned_since_the_listing_saves_its_contents(store: Store) -> None:
    put_mesh(store.blobs, 1)
    unused = Unused(store.database, store.blobs, time.time(), store.now)
    found = list(unused.meshes())
    open_part(store, "train", {"source": {"sha256": digest(1)}})
    assert sum((step.freed for step in unused.delete(found)), Amount()) == Amount()


class BreaksDown(BlobStore):
    """A store that fails after some deletions, as a killed process does."""

    def __init__(self, url: str, deletions: int) -> None:
        super().__init__(url)
        self._left = deletions

    def delete(self, key: str) -> None:
        if not self._left:
            raise KeyboardInterrupt
        self._left -= 1
        super().delete(key)


def test_a_run_that_broke_down_is_finished_by_the_next(
    database: Database, settings: Settings
) -> None:
    url = settings.resolved_blob_url
    for content in range(6):
        put_mesh(BlobStore(url), content)
    with database.begin() as session:
        zoo = make_collection(session)
        shapes = [make_shape(session, zoo, content) for content in range(6)]
        for shape in shapes[2:]:
            delete_shape(session, shape)
    for deletions in (0, 3, 7):
        breaking = Store(database, BreaksDown(url, deletions), settings, time.time() + LATER)
        with pytest.raises(KeyboardInterrupt):
            free_all(breaking)
    whole = Store(database, BlobStore(url), settings, time.time() + LATER)
    free_all(whole)
    assert stored(whole.blobs) == sorted(keys_of(0) + keys_of(1))
    assert free_all(whole) == Amount()


def test_a_run_goes_on_after_the_folder_that_it_has_done(store: Store) -> None:
    hashes = [f"{number:02x}".ljust(64, "0") for number in range(5)]
    for sha256 in hashes:
        store.blobs.put(mesh_key(sha256), b"1")
    steps = free(store, "meshes")
    done = [next(steps) for _ in range(2)]
    assert [step.folder for step in done] == ["meshes/00", "meshes/01"]
    store.blobs.put(mesh_key(hashes[0]), b"1")
    rest = list(free(store, "meshes", after=done[-1].folder))
    assert [step.folder for step in rest] == ["meshes/02", "meshes/03", "meshes/04"]
    assert stored(store.blobs) == [mesh_key(hashes[0])]


def test_an_archive_stays_until_it_is_unpacked(store: Store) -> None:
    for content in (1, 2):
        store.blobs.put(archive_key(digest(content)), b"12345")
    job = open_part(store, "ingest", {"sha256": digest(1)})
    assert free_all(store, "archives") == Amount(1, 5)
    with store.database.begin() as session:
        part = session.scalars(select(Part)).one()
        part.state, session.get_one(Job, job).state = "succeeded", "succeeded"
    assert free_all(store, "archives") == Amount(1, 5)


def test_what_trainings_computed_goes_after_them(store: Store) -> None:
    sha256 = digest(9)
    keys = [
        training_key("pair", sha256),
        failure_key("variant", sha256),
        spectrum_key(sha256, "view"),
    ]
    for key in keys:
        store.blobs.put(key, b"1")
    job = open_part(store, "train", {})
    assert measure(store, "training") == Amount()
    with store.database.begin() as session:
        cancel_job(session, job)
    assert free_all(store, "computed", "meshes") == Amount(), "the mesh of a copy is not stored"
    assert free_all(store, "training") == Amount(3, 3)


def test_what_an_evaluation_keeps_for_itself_goes_with_its_result(
    store: Store, tmp_path: Path
) -> None:
    with store.database.begin() as session:
        part = NewPart("evaluate", LIGHT, {}, weight=0)
        job, _ = create_job(session, kind="evaluate", unit="shapes", parts=[part])
        create_evaluation(
            session,
            evaluation_id="one",
            job_id=job.id,
            collection="zoo",
            models=["heat"],
            dissimilarity=None,
        )
        cancel_job(session, job.id)
    for name in ("one", "none"):
        store.blobs.put(frame_key(name, "frame"), b"123")
    assert free_all(store, "evaluations") == Amount(1, 3), "a cancelled one can be retried"
    with store.database.begin() as session:
        finish_evaluation(session, "one", result={"n_queries": 1}, ranks=[])
    assert free_all(store, "evaluations") == Amount(1, 3)
    assert stored(store.blobs, "evaluations") == []
    assert not (tmp_path / "blobs" / "evaluations" / "one").exists()


def test_files_that_are_none_of_ours_stay(store: Store) -> None:
    ours = f"meshes/ab/.{'ab' * 32}.{'0' * 32}"
    foreign = ["meshes/ab/readme.txt", "meshes/ab/.hidden", "other/ab/x"]
    for key in (ours, *foreign):
        store.blobs.put(key, b"1")
    assert free_all(store) == Amount(1, 1)
    assert stored(store.blobs, "meshes", "other") == sorted(foreign)
    assert contents_of("spectra/ab/x.npz") == ()
    assert not is_partial(f"meshes/ab/{'0' * 32}")


def test_jobs_go_some_time_after_their_end(store: Store) -> None:
    with store.database.begin() as session:
        zoo = make_collection(session)
        done, _ = create_job(session, kind="ingest", unit="shapes", collection="zoo")
        failed, _ = create_job(session, kind="train", unit="pairs", model="mine")
        of_query, _ = create_job(session, kind="query", unit="meshes")
        make_model(session, "mine", state="training")
        session.get_one(TrainedModel, "mine").job_id = failed.id
        asked = ask(session, zoo, 1, job=of_query.id)
    at_work = open_part(store, "ingest", {})
    settings = store.settings
    young = Store(store.database, store.blobs, settings, time.time() + DAY)
    assert free_all(young, "jobs") == Amount()
    assert measure(store, "jobs") == Amount(2)
    assert free_all(store, "jobs") == Amount(2)
    with store.database.read() as session:
        left = set(session.scalars(select(Job.id)))
        assert left == {failed.id, at_work}, "one says why its model failed, one is at work"
        assert get_query(session, asked.id).job_id is None
        assert done.id not in left


def test_a_job_goes_with_its_parts(store: Store) -> None:
    with store.database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
        part = NewPart("ingest", INGEST, {}, shape_id=shape)
        job, _ = create_job(session, kind="ingest", unit="shapes", parts=[part] * 3)
        cancel_job(session, job.id)
    assert free_all(store, "jobs") == Amount(1)
    with store.database.read() as session:
        assert session.scalars(select(Part.id)).all() == []


def test_queries_go_and_then_the_descriptors_that_none_needs(store: Store) -> None:
    with store.database.begin() as session:
        zoo = make_collection(session)
        for content in (1, 1, 2):
            ask(session, zoo, content)
            store_query_vectors(session, digest(content), [("heat", b"12345678")])
        again = ask(session, zoo, 2)
        again.created_at += LATER
    assert free_all(store, "queries") == Amount(3 + 1, 8)
    with store.database.read() as session:
        assert get_query(session, again.id).sha256 == digest(2)
        assert get_query_vector(session, digest(1), "heat") is None
        assert get_query_vector(session, digest(2), "heat") == b"12345678"


def test_deletions_leave_the_change_feed(store: Store) -> None:
    with store.database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
        store_descriptors(session, zoo.id, [(shape, "heat", b"1234")])
        delete_shape(session, shape)
    assert measure(store, "deletions") == Amount(1)
    assert free_all(store, "deletions") == Amount(1)
    assert measure(store, "deletions") == Amount()


def test_files_of_the_data_directory_go_if_nothing_has_them(
    store: Store, settings: Settings
) -> None:
    with store.database.begin() as session:
        zoo = make_collection(session)
        heat = session.get_one(TrainedModel, "heat")
        current = index_file_name(zoo.id, "heat", model_fingerprint(heat))
    cache, uploads = settings.data_path / "cache", settings.data_path / "uploads"
    (cache / "windows").mkdir(parents=True)
    (uploads / "broken").mkdir(parents=True)
    (uploads / "broken" / "mesh").write_bytes(b"12345")
    names = [
        current,
        index_file_name(zoo.id, "heat", "f" * 64),
        f".{current}.0.partial",
        "readme.txt",
    ]
    for name in names:
        (cache / name).write_bytes(b"123")
        (cache / "windows" / name).write_bytes(b"1234")  # of signatures
    young = Store(store.database, store.blobs, settings, time.time() + DAY)
    assert free_all(young, "indexes", "uploads") == Amount()
    assert measure(store, "indexes") == Amount(4, 14)
    assert free_all(store, "indexes") == Amount(4, 14)
    assert sorted(os.listdir(cache / "windows")) == sorted([current, "readme.txt"])
    assert sorted(os.listdir(cache)) == sorted([current, "readme.txt", "windows"])
    assert measure(store, "uploads").count == 1
    assert free_all(store, "uploads").bytes >= 5
    assert os.listdir(uploads) == []


def test_a_correspondence_goes_with_either_of_its_meshes(store: Store) -> None:
    with store.database.begin() as session:
        zoo = make_collection(session)
        for content in (1, 2):
            make_shape(session, zoo, content)
    both, one, none = (
        correspondence_key(digest(first), digest(second), "0" * 16)
        for first, second in ((1, 2), (1, 3), (4, 3))
    )
    same = correspondence_key(digest(2), digest(2), "0" * 16)
    for key in (both, one, none, same):
        store.blobs.put(key, b"123")
    assert contents_of(both) == (digest(1), digest(2))
    assert free_all(store) == Amount(2, 6)
    assert stored(store.blobs, "correspondences") == sorted([both, same])
