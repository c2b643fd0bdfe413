"""Fixtures for the whole suite: databases of both kinds, blobs, settings."""

import tempfile
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

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
