"""All kinds of things that are kept for some time only: how much can be freed, and freeing it.

Rows come first: what only an old query or job needed is then free in the same run. Each kind is
freed in small steps, each with its own transaction. Others can write between two steps, and a run
that is interrupted loses nothing.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType

from sqlalchemy.orm import Session

from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.change_feed import count_deletions, prune_deletions
from workers.storage.database import Database
from workers.storage.retention import Amount, old_jobs, old_queries, prune_jobs, prune_queries
from workers.storage.stale_files import StaleFiles, size_of
from workers.storage.unused_blobs import Found, Step, Unused

PRUNED = "pruned"
"""Name of the counter that says when the last run was asked for, in seconds since 1970."""

DAY = 86_400.0
ROWS_A_STEP = 500
JOBS_A_STEP = 20  # each with its parts


@dataclass(frozen=True)
class Store:
    """What is pruned, when, and how long its kinds are kept.

    Attributes
    ----------
    database : Database
    blobs : BlobStore
    settings : Settings
    now : float
        Seconds since 1970.
    """

    database: Database
    blobs: BlobStore
    settings: Settings
    now: float

    def before(self, days: float) -> float:
        """Time so many days ago.

        Parameters
        ----------
        days : float
            How long something is kept.

        Returns
        -------
        Seconds since 1970.
        """
        return self.now - days * DAY


@dataclass(frozen=True)
class Kind:
    """A kind of things that are kept for some time.

    Attributes
    ----------
    what : str
        For people.
    days : callable
        How long they are kept, from the settings.
    measure : callable
        How much can be freed now.
    free : callable
        Frees it, a step at a time, from after a folder on.
    """

    what: str
    days: Callable[[Settings], float]
    measure: Callable[[Store, float], Amount]
    free: Callable[[Store, float, str], Iterator[Step]]


def measure(store: Store, name: str) -> Amount:
    """How much of a kind can be freed.

    Parameters
    ----------
    store : Store
        Where to look; nothing is changed.
    name : str
        One of ``KINDS``.

    Returns
    -------
    What a run would free. It frees more if rows of other kinds go before.
    """
    kind = KINDS[name]
    return kind.measure(store, store.before(kind.days(store.settings)))


def free(store: Store, name: str, *, after: str = "") -> Iterator[Step]:
    """Free what is old of a kind, a step at a time.

    Parameters
    ----------
    store : Store
        Where to look.
    name : str
        One of ``KINDS``.
    after : str
        The last folder that an earlier run has done.

    Yields
    ------
    What each step freed, perhaps nothing; to stop between two of them does no harm.
    """
    kind = KINDS[name]
    return kind.free(store, store.before(kind.days(store.settings)), after)


def _rows(
    what: str,
    days: Callable[[Settings], float],
    count: Callable[[Session, float], Amount],
    prune: Callable[[Session, float], Amount],
) -> Kind:
    """Kind of rows, counted in one transaction and deleted in several."""

    def measure(store: Store, before: float) -> Amount:
        with store.database.read() as session:
            return count(session, before)

    def free(store: Store, before: float, _after: str) -> Iterator[Step]:
        while True:
            with store.database.begin() as session:
                freed = prune(session, before)
            if not freed.count:
                return
            yield Step(freed)

    return Kind(what, days, measure, free)


def _blobs(
    what: str,
    days: Callable[[Settings], float],
    find: Callable[[Unused], Iterator[Found]],
    tidy: Callable[[Unused], None] | None = None,
) -> Kind:
    """Kind of blobs, found by listing; ``tidy`` is called after all were deleted."""

    def measure(store: Store, before: float) -> Amount:
        found = find(Unused(store.database, store.blobs, store.now, before))
        return sum((Amount(1, blob.size) for one in found for blob in one.blobs), Amount())

    def free(store: Store, before: float, after: str) -> Iterator[Step]:
        unused = Unused(store.database, store.blobs, store.now, before, after)
        yield from unused.delete(find(unused))
        if tidy is not None:
            tidy(unused)

    return Kind(what, days, measure, free)


def _files(
    what: str, days: Callable[[Settings], float], find: Callable[[StaleFiles], Iterator[Path]]
) -> Kind:
    """Kind of files in the data directory of this machine."""

    def stale(store: Store, before: float) -> StaleFiles:
        return StaleFiles(store.database, store.settings.data_path, before)

    def measure(store: Store, before: float) -> Amount:
        return sum((size_of(path) for path in find(stale(store, before))), Amount())

    def free(store: Store, before: float, _after: str) -> Iterator[Step]:
        there = stale(store, before)
        return (Step(there.delete(path)) for path in list(find(there)))

    return Kind(what, days, measure, free)


def _count_deletions(session: Session, before: float) -> Amount:
    return Amount(count_deletions(session, before))


def _prune_deletions(session: Session, before: float) -> Amount:
    return Amount(prune_deletions(session, before, limit=ROWS_A_STEP))


def _unused_days(settings: Settings) -> float:
    return settings.keep_unused_days


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "queries": _rows(
            "queries by mesh, and their descriptors",
            lambda settings: settings.keep_queries_days,
            old_queries,
            partial(prune_queries, limit=ROWS_A_STEP),
        ),
        "jobs": _rows(
            "jobs that have ended",
            lambda settings: settings.keep_jobs_days,
            old_jobs,
            partial(prune_jobs, limit=JOBS_A_STEP),
        ),
        "deletions": _rows(
            "deleted shapes in the change feed",
            lambda settings: settings.keep_deletions_days,
            _count_deletions,
            _prune_deletions,
        ),
        "archives": _blobs("zips that were unpacked", _unused_days, Unused.archives),
        "computed": _blobs(
            "spectra, cleaned meshes, thumbnails and correspondences of deleted meshes",
            _unused_days,
            Unused.computed,
        ),
        "meshes": _blobs("files of deleted shapes and old queries", _unused_days, Unused.meshes),
        "training": _blobs(
            "what trainings computed of pairs and copies",
            lambda settings: settings.keep_training_days,
            Unused.training,
        ),
        "evaluations": _blobs(
            "intermediate results of evaluations",
            _unused_days,
            Unused.evaluations,
            Unused.remove_empty_folders,
        ),
        "indexes": _files(
            "cached search indexes of what was deleted", _unused_days, StaleFiles.indexes
        ),
        "uploads": _files("uploads that were broken off", _unused_days, StaleFiles.uploads),
    }
)
"""All kinds in the order in which they are freed."""
