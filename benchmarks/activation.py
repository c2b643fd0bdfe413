"""The cost of moving a collection to another model, against computing it from its files.

``python -m benchmarks.activation --shapes 1000`` makes creatures and ingests them under one model.
Then it moves their collection to another model, in one process with the code that workers run. It
prints the ratio of the two times.
"""

import argparse
import hashlib
import json
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.progress import track

from workers.creatures import SPECIES, make_creature
from workers.geometry.formats import write
from workers.logs import configure_logs
from workers.pipeline.activation_plan import plan_activation
from workers.pipeline.part_kinds import ingest_part
from workers.pipeline.work import run_pending
from workers.settings import Settings
from workers.storage.blobs import BlobStore, mesh_key
from workers.storage.collections import create_collection, get_collection
from workers.storage.database import Database
from workers.storage.jobs import create_job
from workers.storage.migrate import migrate
from workers.storage.shapes import NewShape, create_shape

COLLECTION = "creatures"
POSES = 8  # of an individual, before another one is made: making it costs more than posing it


def creature_files(count: int) -> Iterator[tuple[str, bytes]]:
    """Names and bytes of that many creatures, no two alike."""
    for i in range(count):
        if i % POSES == 0:
            individual = i // POSES
            species, seed = SPECIES[individual % len(SPECIES)], individual // len(SPECIES)
            creature = make_creature(species, seed=seed)
        yield f"{species}-{seed}-{i % POSES}.ply", write(creature.posed(i % POSES), "ply")


def store(database: Database, blobs: BlobStore, files: Iterator[tuple[str, bytes]]) -> None:
    """Store files as an upload does, with the job that will compute them."""
    with database.begin() as session:
        row = get_collection(session, COLLECTION)
        parts = []
        for name, data in files:
            digest = hashlib.sha256(data).hexdigest()
            blobs.put(mesh_key(digest), data)
            shape = NewShape(sha256=digest, n_bytes=len(data), name=name)
            parts.append(ingest_part(create_shape(session, row.id, shape)[0]))
        create_job(session, kind="ingest", unit="shapes", parts=parts)


def timed(database: Database, blobs: BlobStore, settings: Settings) -> dict[str, float]:
    """Run what is queued; seconds of the clock and of the processor."""
    wall, cpu = time.perf_counter(), time.process_time()
    run_pending(database, blobs, settings)
    return {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}


def main() -> None:
    """Measure, print, and save what was measured where ``--out`` says."""
    parser = argparse.ArgumentParser(description="describing stored shapes against ingesting them")
    parser.add_argument("--shapes", type=int, default=1000)
    parser.add_argument("--first", default="heat", help="model under which shapes are ingested")
    parser.add_argument("--second", default="commute-time", help="model they are described under")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    console = Console()
    configure_logs(level="WARNING", form="console")
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(data_dir=Path(folder), worker_processes=1)
        migrate(settings)
        database = Database(settings.resolved_database_url)
        blobs = BlobStore(settings.resolved_blob_url)
        with database.begin() as session:
            create_collection(session, name=COLLECTION, description="", model=options.first)
        making = track(
            creature_files(options.shapes), "making", options.shapes, console=Console(stderr=True)
        )
        store(database, blobs, iter(list(making)))
        console.print("ingesting …")
        ingest = timed(database, blobs, settings)
        with database.begin() as session:
            plan_activation(session, COLLECTION, options.second)
        describe = timed(database, blobs, settings)
        with database.read() as session:
            arrived = get_collection(session, COLLECTION).model
        database.dispose()
    if arrived != options.second:
        raise SystemExit(f"the collection is under {arrived}, expected {options.second}")
    ratios = {clock: ingest[clock] / describe[clock] for clock in ingest}
    for clock, ratio in ratios.items():
        before, after = (1000.0 * one[clock] / options.shapes for one in (ingest, describe))
        console.print(
            f"{clock}: ingesting {before:.1f} ms a shape, describing {after:.1f} ms, "
            f"ratio {ratio:.1f}"
        )
    if options.out is not None:
        figures = {"shapes": options.shapes, "ingest": ingest, "describe": describe}
        options.out.write_text(json.dumps({**figures, "ratio": ratios}, indent=2) + "\n")


if __name__ == "__main__":
    main()
