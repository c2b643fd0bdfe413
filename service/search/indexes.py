"""All search indexes of this process: the least recently used are dropped when memory runs out."""

import contextlib
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from collections.abc import Collection as Members
from dataclasses import dataclass
from pathlib import Path
from weakref import WeakSet

import structlog
from sqlalchemy.orm import Session

from service.search.cache_file import Identity
from service.search.index import SearchIndex, Snapshot
from workers.retrieval.model import Model
from workers.retrieval.windows.rows import ROW_BYTES
from workers.storage.database import Database
from workers.storage.models import Descriptor, Signature
from workers.storage.stale_files import ENDING, PARTIAL, model_tag
from workers.storage.trained_models import get_model_row, load_model, model_fingerprint

log = structlog.get_logger(__name__)

MAX_BYTES = 4 << 30
WINDOWS = "windows"
"""Folder below that of the cache files: for those of signatures."""

PARTIAL_SECONDS = 3600
Key = tuple[str, str]


@dataclass(frozen=True)
class SearchModel:
    """A model to search under; the fingerprint tells it from another that had its name."""

    model: Model
    fingerprint: str


def load_search_model(session: Session, name: str) -> SearchModel:
    """Return a model that is ready to search under.

    Parameters
    ----------
    session : Session
        That reads.
    name : str
        Of the model.

    Returns
    -------
    SearchModel
        The model and its fingerprint.

    Raises
    ------
    ModelNotFoundError, ModelNotReadyError
        There is none of this name, or it is not trained yet.
    """
    return SearchModel(load_model(session, name), model_fingerprint(get_model_row(session, name)))


class SearchIndexes:
    """Finds or opens the index of a collection under a model.

    Parameters
    ----------
    database : Database
        Where descriptors are.
    folder : Path
        For cache files.
    max_bytes : int
        Memory for all of them together; the one that is searched stays in any case.
    feed : type
        The table that they follow; those of descriptors have others of signatures beside them.
    """

    def __init__(
        self,
        database: Database,
        folder: Path,
        *,
        max_bytes: int = MAX_BYTES,
        feed: type[Descriptor | Signature] = Descriptor,
    ) -> None:
        self._database = database
        self._feed = feed
        self._signatures = (
            SearchIndexes(database, folder / WINDOWS, max_bytes=max_bytes, feed=Signature)
            if feed is Descriptor
            else None
        )
        self._folder = folder
        self._max_bytes = max_bytes
        self._indexes: OrderedDict[Key, SearchIndex] = OrderedDict()
        self._in_use: WeakSet[SearchIndex] = WeakSet()  # also those that were evicted meanwhile
        self._lock = threading.Lock()

    def snapshot(self, collection_id: str, search: SearchModel) -> Snapshot:
        """Return the index of a collection under a model, as up to date as the database.

        Parameters
        ----------
        collection_id : str
            Of the collection.
        search : SearchModel
            The model. An index of another model that had its name is dropped.

        Returns
        -------
        Snapshot
            The index; it stays as it is while others update it.
        """
        dimension = search.model.dimension if self._feed is Descriptor else ROW_BYTES // 4
        identity = Identity(collection_id, search.model.name, search.fingerprint, dimension)
        key = (collection_id, search.model.name)
        outdated: SearchIndex | None = None
        with self._lock:
            index = self._indexes.get(key)
            if index is None or index.identity != identity:
                outdated, path = index, self._folder / identity.file_name
                index = self._indexes[key] = SearchIndex(
                    self._database, identity, path, feed=self._feed
                )
                self._in_use.add(index)
                self._remove_files(*key, but=path)
            self._indexes.move_to_end(key)
        if outdated is not None:
            outdated.discard()
        snapshot = index.snapshot()
        self._evict()
        return snapshot

    def signatures(self, collection_id: str, search: SearchModel) -> Snapshot:
        """Return the signatures of a collection under a model that compares windows.

        Parameters
        ----------
        collection_id : str
            Of the collection.
        search : SearchModel
            The model.

        Returns
        -------
        Snapshot
            Its rows are bytes, as `workers.retrieval.windows.rows` has them.
        """
        return (self._signatures or self).snapshot(collection_id, search)

    def forget_collection(self, collection_id: str) -> None:
        """Drop the indexes of a collection that was deleted, and their files.

        Parameters
        ----------
        collection_id : str
            Of the collection; call it after the deletion was committed.
        """
        self._forget(lambda key: key[0] == collection_id)
        self._remove_files(collection_id, None)
        if self._signatures is not None:
            self._signatures.forget_collection(collection_id)

    def forget_model(self, name: str) -> None:
        """Drop the indexes under a model that was deleted, and their files.

        Parameters
        ----------
        name : str
            Of the model; call it after the deletion was committed.
        """
        self._forget(lambda key: key[1] == name)
        self._remove_files(None, name)
        if self._signatures is not None:
            self._signatures.forget_model(name)

    def keep_only(self, collection_ids: Members[str], models: Members[str]) -> None:
        """Remove cache files of collections or models that are no more.

        What a crash left of a file is removed too, once it is older than an hour.

        Parameters
        ----------
        collection_ids : collection of str
            Those that there are.
        models : collection of str
            Names of those that there are.
        """
        if self._signatures is not None:
            self._signatures.keep_only(collection_ids, models)
        tags = {model_tag(name) for name in models}
        for path in self._folder.glob(f"*{ENDING}"):
            collection_id, tag, *_ = [*path.name.split("."), ""]
            if collection_id not in collection_ids or tag not in tags:
                _remove(path)
        for path in self._folder.glob(f".*{PARTIAL}"):
            with contextlib.suppress(FileNotFoundError):
                if time.time() - path.stat().st_mtime > PARTIAL_SECONDS:
                    _remove(path)

    def sizes(self) -> dict[Key, tuple[int, int]]:
        """Measure the open indexes.

        Returns
        -------
        dict
            Rows and bytes by collection id and model's name.
        """
        with self._lock:
            return {key: (index.n_rows, index.n_bytes) for key, index in self._indexes.items()}

    def close(self) -> None:
        """Write what is new to the cache files."""
        with self._lock:
            indexes = list(self._indexes.values())
            self._indexes.clear()
        for index in indexes:
            index.save()
        if self._signatures is not None:
            self._signatures.close()

    def _evict(self) -> None:
        """Drop the least recently used until the rest fits."""
        evicted: list[SearchIndex] = []
        with self._lock:
            total = sum(index.n_bytes for index in self._indexes.values())
            while total > self._max_bytes and len(self._indexes) > 1:
                _, index = self._indexes.popitem(last=False)
                total -= index.n_bytes
                evicted.append(index)
        for index in evicted:
            index.save()

    def _forget(self, concerns: Callable[[Key], bool]) -> None:
        """Drop indexes, and discard those that any thread still reads or saves."""
        with self._lock:
            for key in [key for key in self._indexes if concerns(key)]:
                del self._indexes[key]
            in_use = list(self._in_use)
        for index in in_use:
            if concerns((index.identity.collection_id, index.identity.model)):
                index.discard()

    def _remove_files(
        self, collection_id: str | None, model: str | None, *, but: Path | None = None
    ) -> None:
        """Remove cache files of a collection, under a model, or both."""
        tag = "*" if model is None else model_tag(model)
        for path in self._folder.glob(f"{collection_id or '*'}.{tag}.*{ENDING}"):
            if path != but:
                _remove(path)


def _remove(path: Path) -> None:
    """Remove a cache file; one that stays only takes room."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        log.warning("a search index's cache cannot be removed", path=str(path), error=str(error))
