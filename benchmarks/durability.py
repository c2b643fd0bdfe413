"""What it costs that an acknowledgement survives a power cut: uploads a second, with and without.

``python -m benchmarks.durability --shapes 500`` stores blobs and commits rows as an upload does,
with every synchronisation and with some of them left out, in one run on one disk. SQLite commits
under ``synchronous`` FULL and NORMAL; blobs are synchronised with their folder, without it, and
not at all.
"""

import argparse
import hashlib
import json
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from sqlalchemy import event

from workers.logs import configure_logs
from workers.pipeline.part_kinds import ingest_part
from workers.settings import Settings
from workers.storage.blobs import BlobStore, mesh_key
from workers.storage.collections import create_collection, get_collection
from workers.storage.database import Database
from workers.storage.durable_folder import sync_path
from workers.storage.jobs import create_job
from workers.storage.migrate import migrate
from workers.storage.shapes import NewShape, create_shape

REPEATS = 5
MESH_BYTES = 200_000  # a creature of 5,000 vertices as binary PLY has about as many


def blobs_a_second(folder: Path, count: int, sync: Callable[[Path], None]) -> float:
    """Store so many meshes one after another."""
    store = BlobStore(f"file://{folder}/{os.urandom(4).hex()}", sync=sync)
    contents = [os.urandom(MESH_BYTES) for _ in range(count)]
    keys = [mesh_key(hashlib.sha256(data).hexdigest()) for data in contents]
    started = time.perf_counter()
    for key, data in zip(keys, contents, strict=True):
        store.put(key, data)
    return count / (time.perf_counter() - started)


def files_only(path: Path) -> None:
    """Synchronise bytes, but no names."""
    if not path.is_dir():
        sync_path(path)


def not_at_all(_: Path) -> None:
    """Leave all to the system."""


def commits_a_second(folder: Path, count: int, synchronous: str) -> float:
    """Commit so many uploads of one shape, each with its job, one after another."""
    settings = Settings(data_dir=folder / os.urandom(4).hex(), worker_processes=1)
    migrate(settings)
    database = Database(settings.resolved_database_url)

    def prepare(connection: object, _: object) -> None:
        connection.execute(f"PRAGMA synchronous = {synchronous}")  # type: ignore[attr-defined]

    event.listen(database.engine, "connect", prepare)
    with database.begin() as session:
        create_collection(session, name="zoo", description="", model="heat")
    started = time.perf_counter()
    for number in range(count):
        with database.begin() as session:
            row = get_collection(session, "zoo")
            shape = NewShape(sha256=f"{number:064x}", n_bytes=1, name=f"{number}.off")
            part = ingest_part(create_shape(session, row.id, shape)[0])
            create_job(session, kind="ingest", unit="shapes", parts=[part])
    seconds = time.perf_counter() - started
    database.dispose()
    return count / seconds


def main() -> None:
    """Measure by turns, print medians, and save all rounds where ``--out`` says."""
    parser = argparse.ArgumentParser(description="what durability costs an upload")
    parser.add_argument("--shapes", type=int, default=500)
    parser.add_argument("--folder", type=Path, help="on the disk to measure; else the system's")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    configure_logs(level="WARNING", form="console")
    ways: dict[str, Callable[[Path], float]] = {
        "blobs, file and folder": lambda at: blobs_a_second(at, options.shapes, sync_path),
        "blobs, file": lambda at: blobs_a_second(at, options.shapes, files_only),
        "blobs, nothing": lambda at: blobs_a_second(at, options.shapes, not_at_all),
        "SQLite, FULL": lambda at: commits_a_second(at, options.shapes, "FULL"),
        "SQLite, NORMAL": lambda at: commits_a_second(at, options.shapes, "NORMAL"),
    }
    rates: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(REPEATS):
        for name, measure in ways.items():
            with tempfile.TemporaryDirectory(dir=options.folder) as folder:
                rates[name].append(measure(Path(folder)))
    console = Console()
    for name, found in rates.items():
        console.print(
            f"{name}: {statistics.median(found):.0f} a second "
            f"({min(found):.0f} to {max(found):.0f})"
        )
    if options.out is not None:
        options.out.write_text(json.dumps(rates, indent=1) + "\n")


if __name__ == "__main__":
    main()
