"""Fixtures for the whole suite: databases of both kinds, blobs, settings."""

import tempfile
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings as laws

from tests.servers import postgres_database, postgres_server
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.migrate import migrate
from workers.training.sources import load_creature

# a busy machine fails no law, and a law that holds today holds tomorrow
laws.register_profile("proteus", deadline=None, derandomize=True)
laws.load_profile("proteus")


ONE_SERVICE = "tests/page/"
"""All files of this folder share a service that takes a minute to fill: one process runs them."""
LONGEST_FIRST = (
    ONE_SERVICE,
    "tests/tasks/test_delivery.py",
    "tests/proteus/reproduction/test_reproduce.py",
    "tests/creatures/test_creatures.py",
    "tests/transformations/test_transform.py",
    "tests/pipeline/",
    "tests/service/test_schemathesis.py",
    "tests/proteus/",
    "tests/geometry/test_hostile_shapes.py",
    "tests/test_survival.py",
    "tests/service/test_training.py",
)
"""Files and folders that take half a minute or more; begun last, one would run on alone."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the files by how long they take, roughly; tests of one file stay as they are."""

    def place(item: pytest.Item) -> int:
        found = (i for i, path in enumerate(LONGEST_FIRST) if item.nodeid.startswith(path))
        return next(found, len(LONGEST_FIRST))

    items.sort(key=place)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """With ``--dist loadfile``: by file, in the order of `pytest_collection_modifyitems`."""
    if config.option.dist != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling  # type: ignore[import-untyped]

    class ByService(LoadFileScheduling):  # type: ignore[misc]
        """Those that share a service count as one file."""

        def _split_scope(self, nodeid: str) -> str:
            return ONE_SERVICE if nodeid.startswith(ONE_SERVICE) else super()._split_scope(nodeid)

    config.option.loadscopereorder = False  # files with many tests are not those that take long
    return ByService(config, log)


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    """URL of a PostgreSQL server."""
    with postgres_server() as url:
        yield url


@pytest.fixture(scope="session", autouse=True)
def _creatures_of_trainings_are_kept() -> Iterator[None]:
    """Small trainings have the same few creatures, in any order: each is made once."""
    keep = lru_cache(maxsize=32)(load_creature.__wrapped__)
    with pytest.MonkeyPatch.context() as patch:
        for module in ("pair", "variant"):
            patch.setattr(f"workers.pipeline.training.{module}.load_creature", keep)
        yield


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.server)])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """URL of an empty database, once a kind."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'rows.sqlite3'}"
    else:
        with postgres_database(request.getfixturevalue("postgres")) as url:
            yield url


@pytest.fixture
def short_folder() -> Iterator[Path]:
    """A folder for sockets, whose paths may have 107 bytes: that of a test is too long."""
    with tempfile.TemporaryDirectory(prefix="proteus-", ignore_cleanup_errors=True) as folder:
        yield Path(folder)


@pytest.fixture
def settings(tmp_path: Path, database_url: str) -> Settings:
    """Settings of a service in an empty directory, with a database of each kind."""
    return Settings(data_dir=tmp_path, database_url=database_url, worker_processes=1)


@pytest.fixture
def database(settings: Settings) -> Iterator[Database]:
    """A migrated database."""
    migrate(settings)
    database = Database(settings.resolved_database_url)
    yield database
    database.dispose()


@pytest.fixture
def blobs(settings: Settings) -> BlobStore:
    """An empty blob store."""
    return BlobStore(settings.resolved_blob_url)
