"""How long pruning takes, and for how long it keeps uploads waiting.

``python -m benchmarks.pruning --meshes 20000`` makes that many meshes with what is computed of
them, a tenth of which nothing refers to, then lists and frees those. An upload waits at its commit
for as long as the lock is held under which up to fifty files are deleted: what deleting a file
takes is the time by which freeing takes longer than listing, divided by the files.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path

from rich.console import Console

from workers.logs import configure_logs
from workers.settings import Settings
from workers.storage.blobs import BlobStore, cleaned_key, mesh_key, spectrum_key, thumbnail_key
from workers.storage.collections import create_collection
from workers.storage.database import Database
from workers.storage.migrate import migrate
from workers.storage.pruning import DAY, KINDS, Store, free, measure
from workers.storage.shapes import NewShape, create_shape

UNUSED_OF = 10
FILE_BYTES = 1000


def fill(store: Store, meshes: int) -> None:
    """Store files without waiting for the disk, and shapes for nine tenths of them."""
    blobs = BlobStore(store.settings.resolved_blob_url, sync=lambda _: None)
    hashes = [os.urandom(32).hex() for _ in range(meshes)]
    for sha256 in hashes:
        keys = (mesh_key(sha256), cleaned_key(sha256), thumbnail_key(sha256))
        for key in (*keys, spectrum_key(sha256, "view")):
            blobs.put(key, bytes(FILE_BYTES))
    with store.database.begin() as session:
        zoo = create_collection(session, name="zoo", description="", model="heat").id
        for number, sha256 in enumerate(hashes):
            if number % UNUSED_OF:
                shape = NewShape(sha256=sha256, n_bytes=FILE_BYTES, name="x.off")
                create_shape(session, zoo, shape)


def main() -> None:
    """Measure, print, and save what was measured where ``--out`` says."""
    parser = argparse.ArgumentParser(description="how long pruning takes")
    parser.add_argument("--meshes", type=int, default=20_000)
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    configure_logs(level="WARNING", form="console")
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(data_dir=Path(folder), worker_processes=1)
        migrate(settings)
        database = Database(settings.resolved_database_url)
        try:
            blobs = BlobStore(settings.resolved_blob_url)
            store = Store(database, blobs, settings, time.time() + 365 * DAY)
            fill(store, options.meshes)
            started = time.perf_counter()
            found = {name: measure(store, name).count for name in KINDS}
            listed = time.perf_counter()
            freed = sum(step.freed.count for name in KINDS for step in free(store, name))
            ended = time.perf_counter()
        finally:
            database.dispose()
    figures = {
        "files": 4 * options.meshes,
        "found": sum(found.values()),
        "freed": freed,
        "listing_seconds": listed - started,
        "freeing_seconds": ended - listed,
        "deletion_milliseconds_a_file": 1000 * (ended - 2 * listed + started) / max(1, freed),
    }
    Console().print_json(json.dumps(figures))
    if options.out is not None:
        options.out.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
