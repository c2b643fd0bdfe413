"""Blobs that nothing needs any more: found by their age and by what rows refer to.

A blob is unused if no row refers to its content and it is older than a time; storing a blob again
makes it young. Nothing is deleted on the word of a listing: right before it goes, under the lock of
``references``, its rows and its age are looked at again.
"""

import uuid
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.storage.blobs import (
    ARCHIVES,
    CLEANED,
    CORRESPONDENCES,
    EVALUATIONS,
    MESHES,
    SPECTRA,
    THUMBNAILS,
    BlobStore,
    StoredBlob,
)
from workers.storage.database import Database
from workers.storage.jobs import OPEN
from workers.storage.models import Evaluation, Job
from workers.storage.references import SHA256, contents_of_parts, lock_blobs, referred
from workers.storage.retention import Amount

BATCH = 50
"""Blobs that are deleted under one lock: few, since uploads wait for it."""

OVERLAP_SECONDS = 600.0
"""By how much the clocks of two machines may differ: parts so much older are looked at again."""


@dataclass(frozen=True)
class Found:
    """Unused blobs of one folder, or none: a search that is broken off goes on after it.

    Attributes
    ----------
    folder : str
        Prefix of their keys; later folders sort after it.
    blobs : sequence of StoredBlob
    """

    folder: str
    blobs: Sequence[StoredBlob]


@dataclass(frozen=True)
class Step:
    """What a step of a run freed, and where an interrupted run goes on.

    Attributes
    ----------
    freed : Amount
    folder : str
        The last folder that is done; empty where a run begins from the start.
    """

    freed: Amount
    folder: str = ""


@dataclass(frozen=True)
class Unused:
    """Where unused blobs are looked for.

    Attributes
    ----------
    database : Database
    blobs : BlobStore
    now : float
        When the search begins, in seconds since 1970.
    before : float
        Younger blobs are left alone, in seconds since 1970.
    after : str
        Folders up to this one are done.
    """

    database: Database
    blobs: BlobStore
    now: float
    before: float
    after: str = ""

    def archives(self) -> Iterator[Found]:
        """Zips of which no part will be unpacked any more.

        Yields
        ------
        Folder after folder.
        """
        return self._unreferred(ARCHIVES)

    def meshes(self) -> Iterator[Found]:
        """Uploaded meshes without shape, query or work.

        Yields
        ------
        Folder after folder.
        """
        return self._unreferred(MESHES)

    def computed(self) -> Iterator[Found]:
        """What was computed of uploads without shape, query or work.

        Those are cleaned meshes, spectra, thumbnails, and correspondences with any other mesh.

        Yields
        ------
        Folder after folder.
        """
        yield from self._unreferred(CLEANED)
        yield from self._unreferred(CORRESPONDENCES)
        yield from self._unreferred(SPECTRA, uploaded=True)
        yield from self._unreferred(THUMBNAILS)

    def training(self) -> Iterator[Found]:
        """What trainings computed of pairs and copies; nothing while a training is at work.

        What is missing later is computed again, so its rows are not looked at.

        Yields
        ------
        Folder after folder.
        """
        with self.database.read() as session:
            at_work = select(Job.id).where(Job.kind == "train", Job.state.in_(OPEN))
            if session.scalar(at_work.limit(1)) is not None:
                return
        yield from (Found(folder, self._old(folder)) for folder in self._folders("pairs"))
        yield from self._unreferred(SPECTRA, uploaded=False)
        yield from (Found(folder, self._old(folder)) for folder in self._folders("variants"))

    def evaluations(self) -> Iterator[Found]:
        """What an evaluation kept for itself and that no retry of it will read.

        Yields
        ------
        Folder after folder.
        """
        for folder in self._folders(EVALUATIONS):
            with self.database.read() as session:
                needed = _is_unfinished(session, folder.rpartition("/")[2])
            yield Found(folder, [] if needed else self._old(folder))

    def remove_empty_folders(self) -> None:
        """Remove the folders of evaluations that have a result and keep no blobs any more."""
        for folder in self.blobs.folders(EVALUATIONS):
            with self.database.read() as session:
                row = session.get(Evaluation, folder.rpartition("/")[2])
            if row is not None and row.result is not None:
                self.blobs.remove_folder(folder)

    def delete(self, found: Iterable[Found]) -> Iterator[Step]:
        """Delete blobs that are still unused when it comes to it, a folder at a time.

        Parameters
        ----------
        found : iterable of Found
            What one of the methods above lists.

        Yields
        ------
        What was freed in each folder.
        """
        for one in found:
            freed = Amount()
            for start in range(0, len(one.blobs), BATCH):
                freed += self._delete(one.blobs[start : start + BATCH])
            yield Step(freed, one.folder)

    def _delete(self, batch: Sequence[StoredBlob]) -> Amount:
        freed = Amount()
        contents = {content for blob in batch for content in contents_of(blob.key)}
        with self.database.begin() as session:
            lock_blobs(session)
            used = referred(session, contents) | self._read_since(session)
            for blob in batch:
                present = self.blobs.info(blob.key)
                still_old = present is not None and present.modified < self.before
                own = contents_of(blob.key)
                if still_old and not (own and used.issuperset(own)):
                    self.blobs.delete(blob.key)
                    freed += Amount(1, blob.size)
        return freed

    def _read_since(self, session: Session) -> set[str]:
        """Contents of parts that were made since the search began."""
        milliseconds = int(1000 * (self.now - OVERLAP_SECONDS))
        return contents_of_parts(session, after=str(uuid.UUID(int=milliseconds << 80)))

    def _folders(self, prefix: str) -> Iterator[str]:
        return (folder for folder in self.blobs.folders(prefix) if folder > self.after)

    def _old(self, folder: str) -> list[StoredBlob]:
        return [blob for blob in self.blobs.blobs(folder) if blob.modified < self.before]

    def _unreferred(self, prefix: str, *, uploaded: bool | None = None) -> Iterator[Found]:
        """Old blobs below a prefix whose contents nothing refers to, and what broken writes left.

        ``uploaded`` says whether only those count of which the mesh is there, or only others.
        """
        with self.database.read() as session:
            at_work = contents_of_parts(session)
        for folder in self._folders(prefix):
            old = self._old(folder)
            contents = {content for blob in old for content in contents_of(blob.key)} - at_work
            with self.database.read() as session:
                contents -= referred(session, contents)
            if uploaded is not None:
                beside = self._meshes_beside(folder)
                contents = contents & beside if uploaded else contents - beside
            broken = uploaded is not False
            unused = [
                blob
                for blob in old
                if contents.intersection(contents_of(blob.key)) or (broken and is_partial(blob.key))
            ]
            yield Found(folder, unused)

    def _meshes_beside(self, folder: str) -> set[str]:
        """Contents of the uploaded meshes whose hashes begin alike."""
        beside = self.blobs.blobs(f"{MESHES}/{folder.rpartition('/')[2]}")
        return {content for blob in beside for content in contents_of(blob.key)}


def contents_of(key: str) -> tuple[str, ...]:
    """Hashes of the uploads that a blob is, or was computed of.

    Parameters
    ----------
    key : str
        Of the blob.

    Returns
    -------
    Each 64 hexadecimal digits; none if the name does not begin with them.
    """
    pieces = key.rpartition("/")[2].split(".")
    return tuple(takewhile(SHA256.fullmatch, pieces))


def is_partial(key: str) -> bool:
    """Whether a file is what an interrupted write left.

    Parameters
    ----------
    key : str
        Of the file, in a listing.

    Returns
    -------
    True for names such as ``.abcd.0123…``, with 32 hexadecimal digits at the end.
    """
    name = key.rpartition("/")[2]
    last = name.rpartition(".")[2]
    return name.startswith(".") and len(last) == 32 and not last.strip("0123456789abcdef")


def _is_unfinished(session: Session, evaluation_id: str) -> bool:
    """Whether an evaluation has no result yet, and its job can still bring one."""
    waiting = (
        select(Evaluation.id)
        .join(Job, Job.id == Evaluation.job_id)
        .where(Evaluation.id == evaluation_id, Evaluation.result.is_(None))
    )
    return session.scalar(waiting) is not None
