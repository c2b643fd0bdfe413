"""Services over SQLite in directories of their own."""

import hashlib
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from tests.service.running import (
    DIE,
    EGG,
    GEM,
    SOLVED,
    Api,
    Messages,
    make_settings,
    running,
    zoo_files,
)
from workers.pipeline.solve import describe_mesh, read_mesh
from workers.retrieval.builtin import built_in_models
from workers.settings import Settings
from workers.storage.blobs import BlobStore, mesh_key
from workers.storage.migrate import migrate

Start = Callable[..., Api]
Stock = tuple[Path, dict[str, str]]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20260301)


@pytest.fixture(scope="session", autouse=True)
def messages() -> Iterator[None]:
    """No broker: what is sent is noted."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("service.app.Dispatcher", Messages)
        yield


@pytest.fixture(scope="session", autouse=True)
def no_page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The page is as if it was not built, whether it was or not."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("service.page.FOLDER", tmp_path_factory.mktemp("page") / "dist")
        yield


@pytest.fixture
def start(tmp_path: Path, stock: Stock) -> Iterator[Start]:
    """Start an empty service, with other settings if need be.

    Spectra of the suite's meshes are there already, so that computing them again is quick.
    """
    with ExitStack() as stack:

        def begin(folder: str = "data", **options: object) -> Api:
            settings = make_settings(tmp_path / folder, **options)
            shutil.copytree(stock[0] / SOLVED, settings.data_path / SOLVED)
            migrate(settings)
            return stack.enter_context(running(settings))

        yield begin


@pytest.fixture
def api(start: Start) -> Api:
    """An empty service."""
    return start()


@pytest.fixture(scope="session")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Stock:
    """A data directory with the collection "zoo" computed, and ids by name."""
    folder = tmp_path_factory.mktemp("stock") / "data"
    settings = make_settings(folder)
    migrate(settings)
    with running(settings) as api:
        api.post("/v1/collections", 201, json={"name": "zoo"})
        shapes = api.upload("zoo", zoo_files())["shapes"]
        api.work()
    _solve(settings, EGG, GEM, DIE)
    return folder, {shape["name"]: shape["id"] for shape in shapes}


@pytest.fixture
def zoo(stock: Stock, tmp_path: Path) -> Iterator[Api]:
    """A service of its own with the collection "zoo" in it."""
    folder, ids = stock
    shutil.copytree(folder, tmp_path / "zoo")
    with running(make_settings(tmp_path / "zoo")) as api:
        api.shape_ids = dict(ids)
        yield api


def _solve(settings: Settings, *contents: bytes) -> None:
    """Store the spectra of some files under the built-in models."""
    blobs = BlobStore(settings.resolved_blob_url)
    models = built_in_models(working_vertices=settings.working_vertices)
    for content in contents:
        sha256 = hashlib.sha256(content).hexdigest()
        blobs.put(mesh_key(sha256), content)
        read = read_mesh(blobs, sha256, filename="", settings=settings)
        describe_mesh(blobs, sha256, read.mesh, models)
        blobs.delete(mesh_key(sha256))
