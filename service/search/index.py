"""The matrix of one (collection, model), kept in step with the change feed.

Rows are only ever added; one that was deleted or replaced is marked in a mask that is copied,
never changed. So a query reads a consistent snapshot without any lock while others update, and
what is dead is dropped once it is a quarter of all.
"""

import threading
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import structlog
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from service.search.cache_file import Identity, read_cache, write_cache
from workers.geometry.arrays import BoolArray, Float32Array, IntArray
from workers.storage.change_feed import CHANGE, Change, changes_after
from workers.storage.database import Database
from workers.storage.models import Counter

log = structlog.get_logger(__name__)

FIRST_ROWS = 256
BATCH_ROWS = 5000
SAVED_ROWS = 5000
"""An index is written to its cache file when so many changes, and a quarter, are new."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """An index as it was when a query came.

    Attributes
    ----------
    matrix : (n, d) float32
    ids : sequence of at least n str
    alive : (n,) bool or None
        Which rows count; None for all n.
    """

    matrix: Float32Array
    ids: Sequence[str]
    alive: BoolArray | None
    _row_of: dict[str, int]

    @property
    def rows(self) -> IntArray:
        """Rows that count, ascending."""
        return np.arange(len(self.matrix)) if self.alive is None else np.flatnonzero(self.alive)

    def rows_of(self, shape_ids: Iterable[str]) -> IntArray:
        """Rows of those of these shapes that are in it, ascending."""
        found = (self._row_of.get(shape_id, -1) for shape_id in shape_ids)
        rows = np.array(sorted(r for r in found if 0 <= r < len(self.matrix)), dtype=np.int64)
        return rows if self.alive is None else rows[self.alive[rows]]


class SearchIndex:
    """Keeps one matrix; `snapshot` brings it up to date.

    Parameters
    ----------
    database : Database
        Where the change feed is.
    identity : Identity
        What it is of.
    path : Path
        Its cache file.
    """

    def __init__(self, database: Database, identity: Identity, path: Path) -> None:
        self.identity = identity
        self._database = database
        self._path = path
        self._lock = threading.Lock()
        self._loaded = False
        self._clear()

    @property
    def n_bytes(self) -> int:
        """About how much memory it takes."""
        return self._n * (4 * self.identity.dimension + 250)

    @property
    def n_rows(self) -> int:
        """Shapes in it, as far as it was brought up to date."""
        return self._n - self._n_dead

    def snapshot(self) -> Snapshot:
        """Bring the index up to date and return it as it is then."""
        with self._lock:
            with self._database.read() as session:
                if not self._loaded:
                    self._load()
                self._follow(session)
            if self._unsaved >= max(SAVED_ROWS, self._n // 4):
                self._save()
            alive = self._alive[: self._n] if self._n_dead else None
            return Snapshot(self._matrix[: self._n], self._ids, alive, self._row_of)

    def save(self) -> None:
        """Write the cache file, if there is anything new in it."""
        with self._lock:
            if self._unsaved:
                self._save()

    def _clear(self) -> None:
        self._number = 0
        self._unsaved = 0
        self._set_rows([], np.empty((FIRST_ROWS, self.identity.dimension), dtype=np.float32))

    def _set_rows(self, ids: list[str], matrix: Float32Array) -> None:
        self._ids = ids
        self._matrix = matrix  # (capacity, d)
        self._n = len(ids)
        self._row_of = {shape_id: row for row, shape_id in enumerate(ids)}
        self._alive: BoolArray = np.ones(len(matrix), dtype=np.bool_)
        self._n_dead = 0

    def _load(self) -> None:
        cached = read_cache(self._path, self.identity)
        if cached is not None:
            self._set_rows(cached.ids, cached.matrix)
            self._number = cached.number
        self._loaded = True

    def _follow(self, session: Session) -> None:
        """Apply the changes since the last one that was seen."""
        latest = latest_change(session)
        if latest < self._number:
            log.warning("the database is older than the index, which is read anew")
            self._clear()
        if latest == self._number:
            return
        changes = changes_after(
            session,
            collection_id=self.identity.collection_id,
            model=self.identity.model,
            number=self._number,
        )
        for batch in _batches(changes):
            self._apply(batch)
            self._number = batch[-1].number
        self._number = max(self._number, latest)

    def _apply(self, changes: Sequence[Change]) -> None:
        newest = {change.shape_id: change.vector for change in changes}
        width = 4 * self.identity.dimension
        fresh: list[tuple[str, bytes]] = []
        dead: list[int] = []
        for shape_id, vector in newest.items():
            row = self._row_of.get(shape_id)
            if vector is not None and len(vector) != width:
                log.error("descriptor of a wrong size", shape_id=shape_id, size=len(vector))
                vector = None
            if row is not None and vector is not None and self._matrix[row].tobytes() == vector:
                continue
            if row is not None:
                dead.append(row)
                del self._row_of[shape_id]
            if vector is not None:
                fresh.append((shape_id, vector))
        self._unsaved += len(fresh) + len(dead)
        self._append(fresh)
        self._bury(dead)

    def _append(self, fresh: Sequence[tuple[str, bytes]]) -> None:
        if not fresh:
            return
        start, end = self._n, self._n + len(fresh)
        self._reserve(end)
        block: NDArray[Any] = np.frombuffer(b"".join(v for _, v in fresh), dtype="<f4")
        self._matrix[start:end] = block.reshape(len(fresh), -1)
        self._ids.extend(shape_id for shape_id, _ in fresh)
        self._row_of.update((shape_id, start + i) for i, (shape_id, _) in enumerate(fresh))
        self._n = end

    def _reserve(self, rows: int) -> None:
        """Make room, doubling it, so that growing costs a constant a row."""
        if rows > len(self._matrix):
            capacity = max(2 * len(self._matrix), rows)
            matrix = np.empty((capacity, self.identity.dimension), dtype=np.float32)
            matrix[: self._n] = self._matrix[: self._n]
            alive = np.ones(capacity, dtype=np.bool_)
            alive[: self._n] = self._alive[: self._n]
            self._matrix, self._alive = matrix, alive

    def _bury(self, dead: Sequence[int]) -> None:
        if not dead:
            return
        self._alive = self._alive.copy()  # snapshots keep theirs
        self._alive[dead] = False
        self._n_dead += len(dead)
        if self._n_dead > max(FIRST_ROWS, self._n // 4):
            self._set_rows(*self._living())

    def _living(self) -> tuple[list[str], Float32Array]:
        rows = np.flatnonzero(self._alive[: self._n])
        return [self._ids[row] for row in rows.tolist()], self._matrix[rows]

    def _save(self) -> None:
        """Write the cache file and go on with its mapping, which the system may page out."""
        ids, matrix = self._living() if self._n_dead else (self._ids, self._matrix[: self._n])
        try:
            write_cache(
                self._path,
                self.identity,
                ids=ids,
                matrix=matrix,
                number=self._number,
                capacity=len(ids) + max(FIRST_ROWS, len(ids) // 2),
            )
        except OSError as error:
            log.warning("the search index's cache cannot be written", error=str(error))
            self._unsaved = 0
            return
        cached = read_cache(self._path, self.identity)
        if cached is not None and cached.number == self._number:
            self._set_rows(cached.ids, cached.matrix)
        self._unsaved = 0


def latest_change(session: Session) -> int:
    """Return the number of the newest change of any index."""
    return session.scalar(select(Counter.value).where(Counter.name == CHANGE)) or 0


def _batches(changes: Iterator[Change]) -> Iterator[list[Change]]:
    """Cut where the number changes, so that what one transaction did stays together."""
    batch: list[Change] = []
    for change in changes:
        if len(batch) >= BATCH_ROWS and change.number != batch[-1].number:
            yield batch
            batch = []
        batch.append(change)
    if batch:
        yield batch
