"""An uploaded archive becomes shapes, each with a part of its own."""

import hashlib
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, cast

from sqlalchemy import update
from sqlalchemy.orm import Session

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats.containers import (
    Contents,
    Found,
    Refused,
    archive_kind,
    no_mesh,
    open_archive,
)
from workers.geometry.formats.naming import clean_path, read_name
from workers.pipeline.outcome import GoOn, Outcome
from workers.pipeline.part_kinds import entry_parts, ingest_part
from workers.pipeline.received import archive_limits
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import archive_key, mesh_key
from workers.storage.jobs import Skipped
from workers.storage.models import Collection, Job, Shape
from workers.storage.parts import Claim, Failure
from workers.storage.references import hold_blobs
from workers.storage.shapes import NewShape, create_shape

ENTRIES_A_PART = 200
"""A longer archive is unpacked by several parts, so that its first shapes are computed meanwhile.
Decision 22 has the measurement."""

MOST_PARTS_OF_SPOOLED = 16
"""A compressed tar archive is unpacked as a whole by each of its parts."""

REFUSALS = (InvalidMeshError, UnsupportedFormatError, UploadTooLargeError)


def unpack(bench: Workbench, claim: Claim, *, entries_a_part: int = ENTRIES_A_PART) -> Outcome:
    """Make shapes of an archive's entries.

    An archive that cannot be read, holds no mesh or passes a limit is named as failed; other files
    of the same upload go on.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the archive, its collection, and the range of entries if there is one.
    entries_a_part : int
        An archive with more entries is divided into parts.

    Returns
    -------
    Outcome
        Stores the shapes and counts the entries, or follows up with the parts of a long archive.
    """
    archive = claim.payload
    with _opened_files(bench, archive["sha256"]) as (file, spool):
        limits = archive_limits(bench.settings)
        try:
            kind = archive_kind(file, archive["filename"]) or "zip"
            contents = Contents(open_archive(file, kind, limits, spool=spool), limits, spool=spool)
            if "start" not in archive:
                ranges = _ranges(contents, entries_a_part)
                if len(ranges) > 1:
                    return Outcome(follow_up=entry_parts(archive, ranges))
            return _unpack_range(bench, claim, contents)
        except REFUSALS as error:
            failure = Failure(archive["filename"], error.kind, str(error))
    return Outcome(store=partial(_count_refused, [failure], []))


@contextmanager
def _opened_files(
    bench: Workbench, sha256: str
) -> Iterator[tuple[BinaryIO, Callable[[], BinaryIO]]]:
    """Open an archive, and give what makes files that compressed archives are unpacked to."""
    with tempfile.TemporaryDirectory(prefix="proteus-") as folder, ExitStack() as files:
        path = Path(folder) / "archive"
        bench.blobs.fetch(archive_key(sha256), path)

        def spool() -> BinaryIO:
            return cast(BinaryIO, files.enter_context(tempfile.TemporaryFile(dir=folder)))

        yield files.enter_context(path.open("rb")), spool


def _ranges(contents: Contents, entries_a_part: int) -> list[tuple[int, int]]:
    """Divide an archive by its entries, those of inner archives counted.

    One in which no name promises a mesh is not divided, so that it can be said to hold none.
    """
    weights = contents.weights()
    if not contents.names_a_mesh():
        return [(0, len(weights))]
    if contents.archive.is_spooled:
        entries_a_part = max(entries_a_part, -(-sum(weights) // MOST_PARTS_OF_SPOOLED))
    ranges, start, held = [], 0, 0
    for place, weight in enumerate(weights):
        if held and held + weight > entries_a_part:
            ranges.append((start, place))
            start, held = place, 0
        held += weight
    return [*ranges, (start, len(weights))]


def _unpack_range(bench: Workbench, claim: Claim, contents: Contents) -> Outcome:
    """Store the bytes of some entries; their rows are stored with the outcome."""
    archive = claim.payload
    shapes: list[NewShape] = []
    refused: list[Failure] = []
    skipped: list[Skipped] = []
    for item in contents.items(archive.get("start", 0), archive.get("stop")):
        if isinstance(item, Found):
            sha256 = hashlib.sha256(item.data).hexdigest()
            bench.blobs.put(mesh_key(sha256), item.data)
            shapes.append(_new_shape(item, sha256, archive))
        elif isinstance(item, Refused):
            refused.append(Failure(item.path[-255:], item.error.kind, str(item.error)[:500]))
        else:
            skipped.append(Skipped(clean_path(item.path), item.detail))
    if not shapes and not refused and "start" not in archive:
        error = no_mesh(one.detail for one in skipped)
        refused.append(Failure(archive["filename"], error.kind, str(error)))
    return Outcome(store=partial(_store, bench, claim, shapes, refused, skipped))


def _store(
    bench: Workbench,
    claim: Claim,
    shapes: Sequence[NewShape],
    refused: Sequence[Failure],
    skipped: Sequence[Skipped],
    session: Session,
    job: Job,
) -> Outcome | GoOn | None:
    """Store entries of an archive as shapes; those that are new get parts of their own.

    Bytes that were pruned since they were stored are stored again first.
    """
    hold_blobs(session)
    if not all(bench.blobs.exists(mesh_key(shape.sha256)) for shape in shapes):
        return GoOn(partial(unpack, bench, claim))
    collection_id = claim.payload["collection_id"]
    if session.get(Collection, collection_id) is None:
        return None
    new: list[str] = []
    for shape in sorted(shapes, key=lambda shape: shape.sha256):  # as uploads lock
        shape_id, created = create_shape(session, collection_id, shape)
        if created:
            new.append(shape_id)
    session.execute(update(Shape).where(Shape.id.in_(new)).values(job_id=job.id))
    existing = len(shapes) - len(new)
    job.total += existing
    job.done += existing
    counted = _count_refused(refused, skipped, session, job)
    parts = [ingest_part(shape_id) for shape_id in new]
    return Outcome(failures=counted.failures, skipped=counted.skipped, follow_up=parts)


def _count_refused(
    refused: Sequence[Failure], skipped: Sequence[Skipped], _session: Session, job: Job
) -> Outcome:
    """Count entries that become no shapes: no part of their own does."""
    job.total += len(refused)
    job.done += len(refused)
    return Outcome(failures=refused, skipped=skipped)


def _new_shape(found: Found, sha256: str, archive: Mapping[str, Any]) -> NewShape:
    named = read_name(found.path, folder_is_label=archive.get("folder_is_label", True))
    label = archive.get("label")
    return NewShape(
        sha256=sha256,
        n_bytes=len(found.data),
        name=named.name,
        label=named.label if label is None else label,
        transformation=named.transformation,
        strength=named.strength,
        path=named.path,
        attributes=archive.get("attributes") or {},
    )
