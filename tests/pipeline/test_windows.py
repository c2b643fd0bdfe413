"""Signatures of uploads, of shapes that are described again, and of queries; on both databases."""

from collections.abc import Callable, Mapping
from hashlib import sha256

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from sqlalchemy import select

import workers.pipeline.windows
from tests.pipeline.uploads import Upload, potato
from tests.pipeline.windowed import store_windowed, windowed_model
from workers.errors import InvalidMeshError
from workers.geometry import preparation
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solver
from workers.geometry.views import LONGEST_HOLE
from workers.pipeline.activation_plan import plan_activation
from workers.pipeline.part_kinds import query_part
from workers.pipeline.solve import describe_mesh, describe_under_each
from workers.pipeline.windows import signature_of_query, take_signature
from workers.retrieval.model import Model
from workers.retrieval.windows.rows import ROW_BYTES, read_row, write_row
from workers.retrieval.windows.signature import (
    QUERY_POINTS,
    Signature,
    query_signature,
    stored_signature,
    window_surface,
)
from workers.settings import Settings
from workers.storage import models
from workers.storage.blobs import BlobStore, cleaned_key
from workers.storage.collections import create_collection, delete_collection
from workers.storage.database import Database
from workers.storage.descriptors import get_query_vector, get_vector
from workers.storage.jobs import create_job, get_job
from workers.storage.shapes import delete_shape, get_shape
from workers.storage.solutions import load_cleaned
from workers.storage.trained_models import load_model

Work = Callable[[], int]
SMALL = 500


@pytest.fixture
def settings(tmp_path: object, database_url: str) -> Settings:
    """Working meshes are small."""
    return Settings(
        data_dir=tmp_path,
        database_url=database_url,
        worker_processes=1,
        working_vertices=SMALL,
    )


@pytest.fixture
def park(database: Database) -> str:
    """Name of an empty collection under a model that compares windows."""
    with database.begin() as session:
        store_windowed(session, ["windowed", "other"], working_vertices=SMALL)
        create_collection(session, name="park", description="", model="windowed")
    return "park"


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Of each surface that windows are taken of: whether it is for a query."""
    seen: list[bool] = []
    original = window_surface

    def counted(mesh: TriangleMesh, *, n_vertices: int, for_query: bool) -> object:
        seen.append(for_query)
        return original(mesh, n_vertices=n_vertices, for_query=for_query)

    monkeypatch.setattr(workers.pipeline.windows, "window_surface", counted)
    return seen


def signatures(database: Database) -> dict[tuple[str, str], bytes | None]:
    """All rows of signatures by shape and model."""
    with database.read() as session:
        rows = session.scalars(select(models.Signature))
        return {(row.shape_id, row.model): row.vector for row in rows}


def loaded(database: Database, name: str) -> Model:
    with database.read() as session:
        return load_model(session, name)


def leave_nothing(patch: pytest.MonkeyPatch) -> None:
    """Let the view of windows, and no other, have no faces left."""
    original = preparation._STEPS["cap-holes"]

    def fails(mesh: TriangleMesh, parameters: Mapping[str, float]) -> object:
        if parameters["longest"] == LONGEST_HOLE:
            raise InvalidMeshError("the shape is too thin")
        return original(mesh, parameters)

    patch.setattr(preparation, "_STEPS", {**preparation._STEPS, "cap-holes": fails})


def expected_row(blobs: BlobStore, data: bytes, model: Model) -> bytes:
    """The signature of an uploaded shape, computed without the pipeline."""
    mesh = load_cleaned(blobs, sha256(data).hexdigest())
    assert model.windows is not None
    working = Solver(mesh).prepared(model.windows.view)
    surface = window_surface(working, n_vertices=mesh.n_vertices, for_query=False)
    return write_row(stored_signature(surface))


def test_an_upload_has_a_signature_under_a_model_that_compares_windows(
    database: Database, blobs: BlobStore, park: str, upload: Upload, work: Work
) -> None:
    data = potato(1)
    _, (one, twin) = upload(park, data, data)
    work()
    rows = signatures(database)
    assert rows.keys() == {(one, "windowed"), (twin, "windowed")}
    row = rows[one, "windowed"]
    assert row is not None
    assert len(row) == ROW_BYTES
    assert row == rows[twin, "windowed"] == expected_row(blobs, data, loaded(database, "windowed"))
    assert read_row(np.frombuffer(row, dtype=np.uint8)).n_vertices == 642
    with database.read() as session:
        assert get_vector(session, one, "windowed") is not None


def test_a_model_without_windows_has_no_signatures(
    database: Database, zoo: str, upload: Upload, work: Work, taken: list[bool]
) -> None:
    upload(zoo, potato(1))
    work()
    assert signatures(database) == {}
    assert taken == []


def test_signatures_go_with_their_shape_and_their_collection(
    database: Database, park: str, upload: Upload, work: Work
) -> None:
    _, (gone, stays) = upload(park, potato(1), potato(2))
    work()
    with database.begin() as session:
        delete_shape(session, gone)
    rows = signatures(database)
    assert rows[gone, "windowed"] is None
    assert rows[stays, "windowed"] is not None
    with database.begin() as session:
        delete_collection(session, park)
    assert signatures(database) == {}


def test_shapes_that_are_described_again_have_the_same_signatures(
    database: Database, zoo: str, park: str, upload: Upload, work: Work
) -> None:
    """Described under heat alone, then under the model; and uploaded under the model."""
    _, (later,) = upload(zoo, potato(1))
    work()
    assert signatures(database) == {}
    with database.begin() as session:
        plan_activation(session, zoo, "windowed")
    work()
    _, (at_once,) = upload(park, potato(1))
    work()
    rows = signatures(database)
    assert rows[later, "windowed"] == rows[at_once, "windowed"] is not None


def test_models_of_one_view_of_windows_share_the_signature(
    database: Database,
    blobs: BlobStore,
    park: str,
    upload: Upload,
    work: Work,
    taken: list[bool],
) -> None:
    with database.begin() as session:
        plan_activation(session, park, "other")
    work()
    _, (one,) = upload(park, potato(1))
    work()
    rows = signatures(database)
    assert rows.keys() == {(one, "other"), (one, "windowed")}
    assert rows[one, "other"] == rows[one, "windowed"] is not None
    assert taken == [False]
    with database.begin() as session:
        described = [load_model(session, name) for name in ("other", "windowed")]
        digest = get_shape(session, one).row.sha256
    mesh = load_cleaned(blobs, digest)
    found = describe_under_each(blobs, digest, mesh, described)
    assert found.signatures["other"] == found.signatures["windowed"] == rows[one, "other"]
    assert taken == [False, False]
    assert describe_mesh(blobs, digest, mesh, described).signatures == {}  # nobody asked for them
    assert taken == [False, False]


def test_a_shape_that_the_view_leaves_nothing_of_is_found_by_its_descriptor(
    database: Database,
    zoo: str,
    park: str,
    upload: Upload,
    work: Work,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By an upload, and described again: it has not failed."""
    _, (again,) = upload(zoo, potato(2))
    work()
    leave_nothing(monkeypatch)
    job, (one,) = upload(park, potato(1))
    work()
    with database.begin() as session:
        described, _ = plan_activation(session, zoo, "windowed")
    work()
    assert signatures(database) == {}
    with database.read() as session:
        for shape_id in (one, again):
            view = get_shape(session, shape_id)
            assert (view.state, view.row.error) == ("ready", None)
            assert get_vector(session, shape_id, "windowed") is not None
        assert [get_job(session, of).errors for of in (job, described.id)] == [[], []]


def test_a_shape_whose_cleaned_mesh_is_gone_is_described_all_the_same(
    database: Database, blobs: BlobStore, zoo: str, park: str, upload: Upload, work: Work
) -> None:
    _, (one,) = upload(zoo, potato(1))
    work()
    blobs.delete(cleaned_key(sha256(potato(1)).hexdigest()))
    with database.begin() as session:
        plan_activation(session, zoo, "windowed")
    work()
    with database.read() as session:
        assert get_vector(session, one, "windowed") is not None
        assert get_shape(session, one).state == "ready"


def ask(database: Database, blobs: BlobStore, data: bytes, model: str, work: Work) -> str:
    """Describe a query's mesh as the API asks for it."""
    digest = sha256(data).hexdigest()
    blobs.put(f"meshes/{digest[:2]}/{digest}", data)
    with database.begin() as session:
        part = query_part(digest, model, "q.off")
        job, _ = create_job(session, kind="query", unit="meshes", parts=[part])
    work()
    with database.read() as session:
        assert get_job(session, job.id).state == "succeeded"
        assert get_query_vector(session, digest, model) is not None
    return digest


def assert_same(found: Signature, expected: Signature) -> None:
    for name, value in vars(expected).items():
        assert_array_equal(getattr(found, name), value, err_msg=name)


def test_a_query_has_its_signature_taken_once(
    database: Database, blobs: BlobStore, park: str, work: Work, taken: list[bool]
) -> None:
    """By the worker; whoever asks later reads what is stored, and it is what was computed."""
    digest = ask(database, blobs, potato(3), "windowed", work)
    assert taken == [True]
    matching = loaded(database, "windowed").windows
    assert matching is not None
    found = [signature_of_query(blobs, digest, matching) for _ in range(2)]
    assert taken == [True]
    mesh = load_cleaned(blobs, digest)
    surface = window_surface(
        Solver(mesh).prepared(matching.view), n_vertices=mesh.n_vertices, for_query=True
    )
    expected = Signature.from_arrays(query_signature(surface).to_arrays())
    for one in found:
        assert one is not None
        assert_same(one, expected)
    assert expected.n_points == QUERY_POINTS


def test_a_query_of_a_mesh_that_is_gone_or_too_thin_has_none(
    database: Database,
    blobs: BlobStore,
    park: str,
    work: Work,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    matching = loaded(database, "windowed").windows
    assert matching is not None
    assert signature_of_query(blobs, "0" * 64, matching) is None
    leave_nothing(monkeypatch)
    digest = ask(database, blobs, potato(4), "windowed", work)
    assert signature_of_query(blobs, digest, matching) is None
    mesh = load_cleaned(blobs, digest)
    assert take_signature(Solver(mesh), mesh, matching) is None


def test_the_model_is_read_as_it_was_stored(database: Database, park: str) -> None:
    with database.read() as session:
        expected = windowed_model(session, "windowed", working_vertices=SMALL)
        found = load_model(session, "windowed")
        without = load_model(session, "heat")
    assert found.to_json() == expected.to_json()
    assert "windows" not in without.to_json()
    assert without.windows is None
