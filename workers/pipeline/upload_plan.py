"""What is stored of an upload: shapes, and one job over what is to be computed of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from workers.pipeline.part_kinds import ingest_part, unpack_part
from workers.storage.jobs import MAX_ERRORS, OPEN, Skipped, create_job, note_skipped
from workers.storage.models import Collection, Job, Part, Shape
from workers.storage.shapes import NewShape, create_shape

MOST_SHAPES = 1000
"""So many shapes of a job are named in an answer."""

PASSING_ERRORS = frozenset({"cancelled", "computation-lost", "internal-error"})
"""Failures that say nothing of the mesh: uploaded again, it is tried again."""


@dataclass(frozen=True)
class Upload:
    """What was received.

    Attributes
    ----------
    shapes : tuple of NewShape
        One a mesh, in the order of the files.
    archives : Mapping
        Names of archives by the sha256 of their content.
    label : str or None
        Of all shapes that come out of archives.
    attributes : Mapping
        Metadata of all shapes that come out of archives.
    folder_is_label : bool
        Whether folders within archives are labels.
    skipped : sequence of Skipped
        Files beside the meshes that are left alone.
    """

    shapes: tuple[NewShape, ...]
    archives: Mapping[str, str]
    label: str | None
    attributes: Mapping[str, Any]
    folder_is_label: bool = True
    skipped: Sequence[Skipped] = ()


@dataclass(frozen=True)
class StoredUpload:
    """What was stored.

    Attributes
    ----------
    job : Job
        Over the upload.
    parts : sequence of Part
        To dispatch after the commit; none where nothing is to be computed.
    shape_ids : list of str
        Shapes of the meshes in the order of their files, each once.
    """

    job: Job
    parts: Sequence[Part]
    shape_ids: list[str]


def store_upload(session: Session, collection: Collection, upload: Upload) -> StoredUpload:
    """Make shapes of what is new, and a job over it.

    Where nothing is to be computed, the job is the one that computes these shapes already, or a
    new one that has ended.

    Parameters
    ----------
    session : Session
        That writes.
    collection : Collection
        That the shapes belong to.
    upload : Upload
        What was received; its files are stored already.

    Returns
    -------
    StoredUpload
        The job, its parts and the shapes.
    """
    ids, new = _create_shapes(session, collection.id, upload.shapes)
    again = _queue_again(session, ids.keys() - new)
    known = [shape_id for shape_id in ids if shape_id not in new and shape_id not in again]
    parts = [ingest_part(shape_id) for shape_id in ids if shape_id in new or shape_id in again]
    for sha256, filename in upload.archives.items():
        parts.append(
            unpack_part(
                collection.id,
                sha256,
                filename=filename,
                label=upload.label,
                attributes=dict(upload.attributes),
                folder_is_label=upload.folder_is_label,
            )
        )
    at_work = None if parts else _job_at_work(session, known)
    if at_work is not None:
        return StoredUpload(at_work, [], list(ids))
    job, rows = create_job(
        session,
        kind="ingest",
        unit="shapes",
        parts=parts,
        done=len(known),
        collection=collection.name,
    )
    note_skipped(job, upload.skipped)
    _name_failed(session, job, known, only=not parts)
    session.execute(update(Shape).where(Shape.id.in_([*new, *again])).values(job_id=job.id))
    return StoredUpload(job, rows, list(ids))


def shapes_of_job(session: Session, collection_id: str, job_id: str) -> Sequence[str]:
    """Find the first thousand shapes that a job computes.

    Parameters
    ----------
    session : Session
        That reads.
    collection_id : str
        Of the collection that the job uploads to.
    job_id : str
        Of the job.

    Returns
    -------
    sequence of str
        Ids of the shapes, the oldest first.
    """
    statement = select(Shape.id).where(Shape.collection_id == collection_id, Shape.job_id == job_id)
    return session.scalars(statement.order_by(Shape.id).limit(MOST_SHAPES)).all()


def _create_shapes(
    session: Session, collection_id: str, shapes: Sequence[NewShape]
) -> tuple[dict[str, None], set[str]]:
    """Create what is new; in the order of hashes, so that two uploads cannot lock each other out.

    Returns
    -------
    Ids of all in the order of their files, each once, and those that are new.
    """
    by_hash: dict[str, NewShape] = {}
    for shape in shapes:
        by_hash.setdefault(shape.sha256, shape)
    created = {
        sha256: create_shape(session, collection_id, by_hash[sha256]) for sha256 in sorted(by_hash)
    }
    ids = dict.fromkeys(created[sha256][0] for sha256 in by_hash)
    return ids, {shape_id for shape_id, is_new in created.values() if is_new}


def _queue_again(session: Session, shape_ids: Sequence[str] | set[str]) -> set[str]:
    """Take back failures that say nothing of the mesh."""
    failed = select(Shape).where(Shape.id.in_(sorted(shape_ids)), Shape.error.is_not(None))
    again = set()
    for shape in session.scalars(failed.order_by(Shape.id).with_for_update()):
        if shape.error is not None and shape.error["type"] in PASSING_ERRORS:
            shape.error = None
            again.add(shape.id)
    return again


def _job_at_work(session: Session, shape_ids: Sequence[str]) -> Job | None:
    """Newest job that still computes one of these shapes."""
    of_shapes = select(Shape.job_id).where(Shape.id.in_(shape_ids))
    at_work = select(Job).where(Job.id.in_(of_shapes), Job.state.in_(OPEN))
    return session.scalar(at_work.order_by(Job.id.desc()).limit(1))


def _name_failed(session: Session, job: Job, shape_ids: Sequence[str], *, only: bool) -> None:
    """Name in the job those shapes that failed earlier, with the same reason."""
    failed = select(Shape).where(Shape.id.in_(shape_ids), Shape.error.is_not(None))
    errors = [
        {"item": shape.path, **shape.error}
        for shape in session.scalars(failed.order_by(Shape.id))
        if shape.error is not None
    ]
    job.errors, job.failed = errors[:MAX_ERRORS], len(errors)
    if only and errors and len(errors) == len(shape_ids):
        job.state = "failed"
