"""A small zoo whose work is done in this process."""

from collections.abc import Callable
from functools import partial

import pytest

from tests.pipeline.evaluations import BENCHMARK, Zoo
from tests.pipeline.uploads import Upload, store_upload
from workers.pipeline.work import run_pending
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.collections import create_collection
from workers.storage.database import Database


@pytest.fixture
def zoo(database: Database) -> str:
    """Name of an empty collection under the model heat."""
    with database.begin() as session:
        create_collection(session, name="zoo", description="", model="heat")
    return "zoo"


@pytest.fixture
def upload(database: Database, blobs: BlobStore) -> Upload:
    """Store files as the API does, and return the job and the shapes; nothing is computed yet."""

    return partial(store_upload, database, blobs)


@pytest.fixture
def work(database: Database, blobs: BlobStore, settings: Settings) -> Callable[[], int]:
    """Do all that is queued."""
    return lambda: run_pending(database, blobs, settings)


@pytest.fixture
def park(database: Database, blobs: BlobStore, settings: Settings, zoo: str) -> Zoo:
    """The small benchmark, described under heat; other descriptors are made up when needed."""
    park = Zoo(database, blobs, settings)
    park.add(*BENCHMARK)
    return park
