"""All search indexes of this process: the least recently asked go when memory runs out."""

import hashlib
import json
import threading
from collections import OrderedDict
from collections.abc import Collection as Members
from dataclasses import dataclass
from pathlib import Path

import structlog
from sqlalchemy.orm import Session

from service.search.cache_file import Identity
from service.search.index import SearchIndex, Snapshot
from workers.retrieval.model import Model
from workers.storage.database import Database
from workers.storage.models import TrainedModel
from workers.storage.trained_models import get_model_row, load_model

log = structlog.get_logger(__name__)

MAX_BYTES = 4 << 30
Key = tuple[str, str]


@dataclass(frozen=True)
class SearchModel:
    """A model to search under, and what tells it from another that had its name."""

    model: Model
    fingerprint: str


def load_search_model(session: Session, name: str) -> SearchModel:
    """Return a model that is ready to search under.

    Raises
    ------
    ModelNotFoundError, ModelNotReadyError
        There is none of this name, or it is not trained yet.
    """
    return SearchModel(load_model(session, name), _fingerprint(get_model_row(session, name)))


class SearchIndexes:
    """Finds or opens the index of a collection under a model.

    Parameters
    ----------
    database : Database
        Where descriptors are.
    folder : Path
        For cache files.
    max_bytes : int
        Of memory for all of them together; the one that is asked stays in any case.
    """

    def __init__(self, database: Database, folder: Path, *, max_bytes: int = MAX_BYTES) -> None:
        self._database = database
        self._folder = folder
        self._max_bytes = max_bytes
        self._indexes: OrderedDict[Key, SearchIndex] = OrderedDict()
        self._lock = threading.Lock()

    def snapshot(self, collection_id: str, search: SearchModel) -> Snapshot:
        """Return the index of a collection under a model, as up to date as the database."""
        identity = Identity(
            collection_id, search.model.name, search.fingerprint, search.model.dimension
        )
        key = (collection_id, search.model.name)
        with self._lock:
            index = self._indexes.get(key)
            if index is None or index.identity != identity:
                path = self._folder / identity.file_name
                index = self._indexes[key] = SearchIndex(self._database, identity, path)
            self._indexes.move_to_end(key)
        snapshot = index.snapshot()
        self._evict()
        return snapshot

    def forget_collection(self, collection_id: str) -> None:
        """Drop the indexes of a collection that was deleted, and their files."""
        with self._lock:
            for key in [key for key in self._indexes if key[0] == collection_id]:
                del self._indexes[key]
        for path in self._folder.glob(f"{collection_id}.*.index"):
            path.unlink(missing_ok=True)

    def forget_model(self, name: str) -> None:
        """Drop the indexes under a model that was deleted."""
        with self._lock:
            for key in [key for key in self._indexes if key[1] == name]:
                del self._indexes[key]

    def keep_only(self, collection_ids: Members[str]) -> None:
        """Remove cache files of collections that are no more."""
        for path in self._folder.glob("*.index"):
            if path.name.partition(".")[0] not in collection_ids:
                path.unlink(missing_ok=True)

    def sizes(self) -> dict[Key, tuple[int, int]]:
        """Rows and bytes of the open indexes by collection id and model."""
        with self._lock:
            return {key: (index.n_rows, index.n_bytes) for key, index in self._indexes.items()}

    def close(self) -> None:
        """Write what is new to the cache files."""
        with self._lock:
            indexes = list(self._indexes.values())
            self._indexes.clear()
        for index in indexes:
            index.save()

    def _evict(self) -> None:
        """Drop the least recently asked until the rest fits."""
        evicted: list[SearchIndex] = []
        with self._lock:
            total = sum(index.n_bytes for index in self._indexes.values())
            while total > self._max_bytes and len(self._indexes) > 1:
                _, index = self._indexes.popitem(last=False)
                total -= index.n_bytes
                evicted.append(index)
        for index in evicted:
            index.save()


def _fingerprint(row: TrainedModel) -> str:
    definition = json.dumps(row.definition, sort_keys=True)
    return hashlib.sha256(f"{row.created_at!r} {definition}".encode()).hexdigest()
