"""Shapes: one a content, a state that is derived, pages that skip nothing."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.storage.rows import make_collection, make_model, make_shape
from workers.errors import (
    CollectionNotFoundError,
    ConflictError,
    InvalidRequestError,
    ModelNotReadyError,
    NameTakenError,
    ShapeNotFoundError,
)
from workers.settings import INGEST
from workers.storage.collections import (
    count_shapes,
    create_collection,
    delete_collection,
    get_collection,
    models_of,
    page_of_collections,
)
from workers.storage.database import Database
from workers.storage.descriptors import store_descriptors, store_query_vectors
from workers.storage.jobs import NewPart, create_job
from workers.storage.models import Shape
from workers.storage.parts import claim_part
from workers.storage.shapes import delete_shape, get_shape, page_of_shapes
from workers.storage.trained_models import delete_model


def test_the_same_content_is_one_shape_however_many_upload_it(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        other = make_collection(session, "other")

    def upload(_: int) -> str:
        with database.begin() as session:
            return make_shape(session, zoo, 7)

    with ThreadPoolExecutor(6) as pool:
        ids = set(pool.map(upload, range(12)))
    assert len(ids) == 1
    with database.begin() as session:
        assert make_shape(session, other, 7) not in ids


def test_state_follows_from_descriptor_error_and_running_part(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
        part = NewPart("ingest", INGEST, {}, shape_id=shape)
        _, (row,) = create_job(session, kind="ingest", unit="shapes", parts=[part])
        assert get_shape(session, shape).state == "queued"
        claim_part(session, row.id, message="m", now=0.0, lease_seconds=1.0)
        assert get_shape(session, shape).state == "processing"
        store_descriptors(session, zoo.id, [(shape, "commute-time", b"1234")])
        assert get_shape(session, shape).state == "processing"
        session.get_one(Shape, shape).error = {"type": "invalid-mesh", "detail": "no faces"}
        session.flush()
        assert get_shape(session, shape).state == "failed"
        counts = count_shapes(session, [zoo])[zoo.id]
        assert (counts.ready, counts.failed) == (0, 1)
        store_descriptors(session, zoo.id, [(shape, "heat", b"1234")])
        assert get_shape(session, shape).state == "ready"  # it is found, whatever failed
        counts = count_shapes(session, [zoo])[zoo.id]
        assert (counts.ready, counts.failed) == (1, 0)


def test_pages_neither_skip_nor_double_while_shapes_arrive(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        expected = [make_shape(session, zoo, n) for n in range(7)]
    seen: list[str] = []
    cursor: str | None = None
    while True:
        with database.begin() as session:
            page = page_of_shapes(session, zoo.id, limit=3, cursor=cursor)
            seen += [view.row.id for view in page.items]
            if len(seen) == 3:
                expected.append(make_shape(session, zoo, 100))
        cursor = page.next_cursor
        if cursor is None:
            break
    assert seen == expected


def test_shapes_are_filtered_by_label_and_state(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        cat = make_shape(session, zoo, 1, label="cat")
        make_shape(session, zoo, 2, label="dog")
        store_descriptors(session, zoo.id, [(cat, "heat", b"1234")])

        def ids(**filters: str) -> list[str]:
            page = page_of_shapes(session, zoo.id, limit=9, cursor=None, **filters)
            return [view.row.id for view in page.items]

        assert ids(label="cat") == [cat]
        assert ids(state="ready") == [cat]
        assert ids(label="dog", state="ready") == []


def test_a_cursor_that_nobody_gave_is_refused(database: Database) -> None:
    with database.read() as session:
        for cursor in ("%%%", "AA==AA", "\x00"):
            with pytest.raises(InvalidRequestError, match="cursor"):
                page_of_collections(session, limit=3, cursor=cursor)


def test_deleting_a_collection_takes_its_shapes_and_frees_its_name(database: Database) -> None:
    with database.begin() as session:
        zoo = make_collection(session)
        shape = make_shape(session, zoo, 1)
    with database.begin() as session:
        delete_collection(session, "zoo")
    with database.begin() as session:
        with pytest.raises(ShapeNotFoundError):
            get_shape(session, shape)
        with pytest.raises(CollectionNotFoundError):
            get_collection(session, "zoo")
        make_collection(session)
        with pytest.raises(NameTakenError):
            make_collection(session)


def test_deleting_a_shape_twice_says_that_it_is_gone(database: Database) -> None:
    with database.begin() as session:
        shape = make_shape(session, make_collection(session), 1)
        delete_shape(session, shape)
    with database.begin() as session, pytest.raises(ShapeNotFoundError):
        delete_shape(session, shape)


def test_models_in_use_or_built_in_stay(database: Database) -> None:
    with database.begin() as session:
        make_model(session, "mine")
        make_model(session, "young", state="training")
        zoo = create_collection(session, name="zoo", description="", model="mine")
        assert models_of(session, zoo.id) == {"mine"}
        with pytest.raises(ModelNotReadyError):
            create_collection(session, name="no", description="", model="young")
        for name in ("mine", "heat"):
            with pytest.raises(ConflictError):
                delete_model(session, name)
        delete_collection(session, "zoo")
        store_query_vectors(session, "0" * 64, [("mine", b"1234")])
        session.flush()
        delete_model(session, "mine")
