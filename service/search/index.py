"""The matrix of one (collection, model), kept up to date with the change feed.

Rows are only ever added. A row whose shape was deleted or replaced is dead: it is marked in a new
copy of the mask ``alive``. So a query reads its snapshot without a lock while others update the
index. Dead rows are removed, in a new matrix, once they are a quarter of all rows.

What a snapshot shares with the index never changes below the snapshot's n rows:

- the matrix and the list of ids are only appended to, and replaced when rows are removed;
- the mask is replaced at every change;
- ``ShapeRows`` is only added to, and a snapshot looks only at rows below n.
"""

import contextlib
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
from service.search.shape_rows import ShapeRows
from workers.geometry.arrays import BoolArray, Float32Array, IntArray
from workers.storage.change_feed import CHANGE, Change, changes_after, pruned_up_to
from workers.storage.database import Database
from workers.storage.models import Counter, Descriptor, Signature

log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class IndexSizes:
    """How many rows an index handles at a time.

    Attributes
    ----------
    first : int
        Rows that an empty matrix has room for. So many dead rows are always kept.
    batch : int
        About how many changes are applied at a time.
    saved : int
        So many changes, and a quarter of the rows, must be new before the cache file is written.
    """

    first: int = 256
    batch: int = 5000
    saved: int = 5000


DEFAULT_SIZES = IndexSizes()


@dataclass(frozen=True, eq=False)
class Snapshot:
    """An index as it was when a query came; updates of the index do not change it.

    Attributes
    ----------
    matrix : (n, d) float32
        One descriptor a row, dead rows among them.
    ids : sequence of at least n str
        Shapes of the rows.
    alive : (n,) bool or None
        Which rows count; None for all n.
    shape_rows : ShapeRows
        Rows of the shapes; those from n on belong to later snapshots.
    """

    matrix: Float32Array
    ids: Sequence[str]
    alive: BoolArray | None
    shape_rows: ShapeRows

    @property
    def rows(self) -> IntArray:
        """Rows that count, ascending."""
        return np.arange(len(self.matrix)) if self.alive is None else np.flatnonzero(self.alive)

    def rows_of(self, shape_ids: Iterable[str]) -> IntArray:
        """Return the rows of some shapes.

        Parameters
        ----------
        shape_ids : iterable of str
            The shapes; those that are not in the snapshot are left out.

        Returns
        -------
        (m,) int64
            Rows that count, ascending.
        """
        below = len(self.matrix)
        found = (self.shape_rows.newest(shape_id, below=below) for shape_id in shape_ids)
        rows = np.array(sorted(row for row in found if row is not None), dtype=np.int64)
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
    feed : type
        The table whose rows it keeps; those of signatures are bytes, four to a number.
    sizes : IndexSizes
        When it grows, is saved and drops dead rows.
    """

    def __init__(
        self,
        database: Database,
        identity: Identity,
        path: Path,
        *,
        feed: type[Descriptor | Signature] = Descriptor,
        sizes: IndexSizes = DEFAULT_SIZES,
    ) -> None:
        self.identity = identity
        self._database = database
        self._path = path
        self._feed = feed
        self._sizes = sizes
        self._lock = threading.Lock()
        self._loaded = False
        self._discarded = False
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
        """Bring the index up to date.

        Returns
        -------
        Snapshot
            The index as it is then.
        """
        with self._lock:
            with self._database.read() as session:
                if not self._loaded:
                    self._load()
                self._follow(session)
            if self._unsaved >= max(self._sizes.saved, self._n // 4):
                self._save()
            alive = self._alive[: self._n] if self._n_dead else None
            return Snapshot(self._matrix[: self._n], self._ids, alive, self._shape_rows)

    def save(self) -> None:
        """Write the cache file, if there is anything new in it."""
        with self._lock:
            if self._unsaved:
                self._save()

    def discard(self) -> None:
        """Remove the cache file and write none again; searches that use the index go on."""
        with self._lock:
            self._discarded = True
            with contextlib.suppress(OSError):
                self._path.unlink(missing_ok=True)

    def _clear(self) -> None:
        self._number = 0
        self._unsaved = 0
        empty = np.empty((self._sizes.first, self.identity.dimension), dtype=np.float32)
        self._set_rows([], empty)

    def _set_rows(self, ids: list[str], matrix: Float32Array) -> None:
        self._ids = ids
        self._matrix = matrix  # (capacity, d)
        self._n = len(ids)
        self._shape_rows = ShapeRows(ids)
        self._alive: BoolArray = np.ones(len(matrix), dtype=np.bool_)
        self._n_dead = 0

    def _load(self) -> None:
        cached = read_cache(self._path, self.identity)
        if cached is not None:
            self._set_rows(cached.ids, cached.matrix)
            self._number = cached.number
        self._loaded = True

    def _follow(self, session: Session) -> None:
        """Apply the changes since the last one that was seen.

        Deletions are pruned after some days. An index that has not seen one of those reads all
        anew; that is asked after the changes, and the number is raised after that.
        """
        latest = latest_change(session)
        if latest < self._number:
            log.warning("the database is older than the index, which is read anew")
            self._clear()
        if latest == self._number:
            return
        may_lack_deletions = self._n > 0
        changes = changes_after(
            session,
            collection_id=self.identity.collection_id,
            model=self.identity.model,
            number=self._number,
            feed=self._feed,
        )
        for batch in _batches(changes, self._sizes.batch):
            self._apply(batch)
            latest = max(latest, batch[-1].number)
        if may_lack_deletions and self._number < self._pruned_up_to(session):
            log.info("deletions were pruned that the index has not seen, so it is read anew")
            self._clear()
            self._follow(session)
            return
        self._number = latest

    def _pruned_up_to(self, session: Session) -> int:
        identity = self.identity
        return pruned_up_to(session, collection_id=identity.collection_id, model=identity.model)

    def _apply(self, changes: Sequence[Change]) -> None:
        newest = {change.shape_id: change.vector for change in changes}
        fresh: list[tuple[str, bytes]] = []
        dead: list[int] = []
        for shape_id, vector in newest.items():
            if vector is not None and len(vector) != 4 * self.identity.dimension:
                log.error("descriptor of a wrong size", shape_id=shape_id, size=len(vector))
                vector = None
            row = self._row_of(shape_id)
            if row is not None and vector is not None and self._matrix[row].tobytes() == vector:
                continue
            if row is not None:
                dead.append(row)
            if vector is not None:
                fresh.append((shape_id, vector))
        self._change(fresh, dead)

    def _row_of(self, shape_id: str) -> int | None:
        """Row of a shape that is in the index now."""
        row = self._shape_rows.newest(shape_id, below=self._n)
        return row if row is not None and self._alive[row] else None

    def _change(self, fresh: Sequence[tuple[str, bytes]], dead: Sequence[int]) -> None:
        """Append rows and mark others dead.

        Whatever may run out of memory comes first, so that a change is made whole or not at all.
        """
        start, end = self._n, self._n + len(fresh)
        self._reserve(end)
        alive = self._alive.copy() if dead else self._alive  # snapshots keep the old one
        alive[list(dead)] = False
        block: NDArray[Any] = np.frombuffer(b"".join(v for _, v in fresh), dtype="<f4")
        self._matrix[start:end] = block.reshape(-1, self.identity.dimension)
        self._ids.extend(shape_id for shape_id, _ in fresh)
        for row, (shape_id, _) in enumerate(fresh, start):
            self._shape_rows.add(shape_id, row)
        self._n, self._alive = end, alive
        self._n_dead += len(dead)
        self._unsaved += len(fresh) + len(dead)
        if self._n_dead > max(self._sizes.first, self._n // 4):
            self._set_rows(*self._living())

    def _reserve(self, rows: int) -> None:
        """Make room, doubling it, so that growing costs a constant a row."""
        if rows > len(self._matrix):
            capacity = max(2 * len(self._matrix), rows)
            matrix = np.empty((capacity, self.identity.dimension), dtype=np.float32)
            matrix[: self._n] = self._matrix[: self._n]
            alive = np.ones(capacity, dtype=np.bool_)
            alive[: self._n] = self._alive[: self._n]
            self._matrix, self._alive = matrix, alive

    def _living(self) -> tuple[list[str], Float32Array]:
        rows = np.flatnonzero(self._alive[: self._n])
        return [self._ids[row] for row in rows.tolist()], self._matrix[rows]

    def _save(self) -> None:
        """Write the cache file and go on with its mapping, which the system may page out."""
        if self._discarded:
            return
        ids, matrix = self._living() if self._n_dead else (self._ids, self._matrix[: self._n])
        try:
            write_cache(
                self._path,
                self.identity,
                ids=ids,
                matrix=matrix,
                number=self._number,
                capacity=len(ids) + max(self._sizes.first, len(ids) // 2),
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
    """Return the number of the newest change of any index.

    Parameters
    ----------
    session : Session
        That reads.

    Returns
    -------
    int
        The number; 0 before the first change.
    """
    return session.scalar(select(Counter.value).where(Counter.name == CHANGE)) or 0


def _batches(changes: Iterator[Change], size: int) -> Iterator[list[Change]]:
    """Cut where the number changes, so that what one transaction did stays together."""
    batch: list[Change] = []
    for change in changes:
        if len(batch) >= size and change.number != batch[-1].number:
            yield batch
            batch = []
        batch.append(change)
    if batch:
        yield batch
