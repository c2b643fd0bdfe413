"""Uploads as the API makes them, without the API."""

from collections.abc import Callable
from hashlib import sha256

from tests.meshes import bumpy_sphere
from workers.geometry.formats import write
from workers.pipeline.part_kinds import ingest_part
from workers.storage.blobs import BlobStore, mesh_key
from workers.storage.collections import get_collection
from workers.storage.database import Database
from workers.storage.jobs import create_job
from workers.storage.shapes import NewShape, create_shape

Upload = Callable[..., tuple[str, list[str]]]


def potato(seed: int) -> bytes:
    """A bumpy sphere of 642 vertices as OFF, another one a seed."""
    return write(bumpy_sphere(3, seed), "off")


def store_upload(
    database: Database, blobs: BlobStore, collection: str, *files: bytes
) -> tuple[str, list[str]]:
    """Store files and commit their job; returns it and the shapes, nothing is computed yet."""
    with database.begin() as session:
        row = get_collection(session, collection)
        ids = []
        for number, data in enumerate(files):
            digest = sha256(data).hexdigest()
            blobs.put(mesh_key(digest), data)
            shape = NewShape(sha256=digest, n_bytes=len(data), name=f"{number}.off")
            ids.append(create_shape(session, row.id, shape)[0])
        parts = [ingest_part(shape_id) for shape_id in ids]
        job, _ = create_job(session, kind="ingest", unit="shapes", parts=parts)
    return job.id, ids
