"""An uploaded zip becomes shapes, each with a part of its own."""

import hashlib
import tempfile
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TypeVar

from workers.errors import UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats.naming import read_name
from workers.pipeline.archives import Entry, read_archive
from workers.pipeline.plans import ingest_part
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import archive_key, mesh_key
from workers.storage.jobs import add_parts
from workers.storage.models import Collection, Part, Shape
from workers.storage.parts import Claim, Failure, finish_part, hold_lease, report_failures
from workers.storage.shapes import NewShape, create_shape

BATCH = 20
Item = TypeVar("Item")


def unpack(bench: Workbench, claim: Claim) -> None:
    """Make shapes of an archive's entries, some at a time; to run it again does no harm.

    An archive that cannot be read, holds no mesh or passes a limit is named as failed; other files
    of the same upload go on.
    """
    failure = None
    found = False
    with tempfile.TemporaryDirectory(prefix="proteus-") as folder:
        path = Path(folder) / "archive.zip"
        bench.blobs.fetch(archive_key(claim.payload["sha256"]), path)
        try:
            for batch in _batches(read_archive(path, bench.settings), BATCH):
                found = True
                bench.send(_store(bench, claim, batch))
        except (UnsupportedFormatError, UploadTooLargeError) as error:
            failure = Failure(claim.payload["filename"], error.kind, str(error))
    if not found and failure is None:
        detail = "the archive holds no mesh (off, obj, ply, stl, glb, gltf, 3mf)"
        failure = Failure(claim.payload["filename"], "invalid-mesh", detail)
    with bench.database.begin() as session:
        failures = [] if failure is None else [failure]
        report_failures(session, claim, failures, are_counted=False)
        parts = finish_part(session, claim)
    bench.send(parts)


def _store(bench: Workbench, claim: Claim, batch: list[Entry | Failure]) -> list[Part]:
    """Store entries of an archive as shapes; returns their parts."""
    shapes = []
    for entry in batch:
        if isinstance(entry, Entry):
            sha256 = hashlib.sha256(entry.data).hexdigest()
            bench.blobs.put(mesh_key(sha256), entry.data)
            shapes.append(_new_shape(entry, sha256, claim))
    with bench.database.begin() as session:
        job = hold_lease(session, claim)
        collection = session.get(Collection, claim.payload["collection_id"])
        if collection is None:
            return []
        new: list[str] = []
        for shape in sorted(shapes, key=lambda shape: shape.sha256):  # as uploads lock
            shape_id, created = create_shape(session, collection.id, shape)
            if created:
                new.append(shape_id)
        for shape_id in new:
            row = session.get(Shape, shape_id)
            if row is not None:
                row.job_id = job.id
        existing = len(shapes) - len(new)
        job.total += existing
        job.done += existing
        job.revision += 1
        refused = [entry for entry in batch if isinstance(entry, Failure)]
        report_failures(session, claim, refused, are_counted=False)
        return add_parts(session, job, [ingest_part(shape_id) for shape_id in new])


def _new_shape(entry: Entry, sha256: str, claim: Claim) -> NewShape:
    named = read_name(entry.name)
    label = claim.payload.get("label")
    return NewShape(
        sha256=sha256,
        n_bytes=len(entry.data),
        name=named.name,
        label=named.label if label is None else label,
        transformation=named.transformation,
        strength=named.strength,
        attributes=claim.payload.get("attributes") or {},
    )


def _batches(items: Iterator[Item], size: int) -> Iterator[list[Item]]:
    while batch := list(islice(items, size)):
        yield batch
