"""An uploaded zip becomes shapes, each with a part of its own."""

import hashlib
import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import update
from sqlalchemy.orm import Session

from workers.errors import UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats.naming import read_name
from workers.pipeline.archives import Entry, count_entries, read_archive
from workers.pipeline.outcome import GoOn, Outcome
from workers.pipeline.part_kinds import entry_parts, ingest_part
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import archive_key, mesh_key
from workers.storage.models import Collection, Job, Shape
from workers.storage.parts import Claim, Failure
from workers.storage.references import hold_blobs
from workers.storage.shapes import NewShape, create_shape

ENTRIES_A_PART = 200
"""A longer archive is unpacked by several parts, so that its first shapes are computed meanwhile.
Decision 22 has the measurement."""


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
    with tempfile.TemporaryDirectory(prefix="proteus-") as folder:
        path = Path(folder) / "archive.zip"
        bench.blobs.fetch(archive_key(archive["sha256"]), path)
        try:
            if "start" in archive:
                return _unpack_range(bench, claim, path)
            entries = count_entries(path, bench.settings)
            if entries > entries_a_part:
                return Outcome(follow_up=entry_parts(archive, entries, entries_a_part))
            if entries:
                return _unpack_range(bench, claim, path)
        except (UnsupportedFormatError, UploadTooLargeError) as error:
            failure = Failure(archive["filename"], error.kind, str(error))
        else:
            detail = "the archive holds no mesh (off, obj, ply, stl, glb, gltf, 3mf)"
            failure = Failure(archive["filename"], "invalid-mesh", detail)
    return Outcome(store=partial(_count_refused, [failure]))


def _unpack_range(bench: Workbench, claim: Claim, path: Path) -> Outcome:
    """Store the bytes of some entries; their rows are stored with the outcome."""
    archive = claim.payload
    shapes: list[NewShape] = []
    refused: list[Failure] = []
    entries = read_archive(
        path, bench.settings, start=archive.get("start", 0), stop=archive.get("stop")
    )
    for entry in entries:
        if isinstance(entry, Failure):
            refused.append(entry)
        else:
            sha256 = hashlib.sha256(entry.data).hexdigest()
            bench.blobs.put(mesh_key(sha256), entry.data)
            shapes.append(_new_shape(entry, sha256, archive))
    return Outcome(store=partial(_store, bench, claim, shapes, refused))


def _store(
    bench: Workbench,
    claim: Claim,
    shapes: Sequence[NewShape],
    refused: Sequence[Failure],
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
    counted = _count_refused(refused, session, job)
    return Outcome(failures=counted.failures, follow_up=[ingest_part(shape_id) for shape_id in new])


def _count_refused(refused: Sequence[Failure], _session: Session, job: Job) -> Outcome:
    """Count entries that become no shapes: no part of their own does."""
    job.total += len(refused)
    job.done += len(refused)
    return Outcome(failures=refused)


def _new_shape(entry: Entry, sha256: str, archive: Mapping[str, Any]) -> NewShape:
    named = read_name(entry.name)
    label = archive.get("label")
    return NewShape(
        sha256=sha256,
        n_bytes=len(entry.data),
        name=named.name,
        label=named.label if label is None else label,
        transformation=named.transformation,
        strength=named.strength,
        path=named.path,
        attributes=archive.get("attributes") or {},
    )
