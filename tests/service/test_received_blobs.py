"""Received files are there when their rows are committed, whatever is pruned meanwhile."""

import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from service.received_blobs import keep_received, store_received
from tests.service.running import Api, zoo_files
from workers.storage.blobs import BlobStore, mesh_key
from workers.storage.database import Database
from workers.storage.pruning import DAY, Store, free
from workers.storage.unused_blobs import Found, Unused, is_partial

KEY = mesh_key("ab" * 32)


def test_a_file_that_was_pruned_since_is_stored_again(
    database: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    file = tmp_path / "received"
    file.write_bytes(b"mesh")
    store_received(blobs, {KEY: file})
    blobs.delete(KEY)
    with database.begin() as session:
        keep_received(session, blobs, {KEY: file})
    assert blobs.get(KEY) == b"mesh"


def whole(found: Iterable[Found]) -> Iterator[Found]:
    """Leave out files that are being written: they are not old enough in truth."""
    for one in found:
        yield Found(one.folder, [blob for blob in one.blobs if not is_partial(blob.key)])


def test_uploads_and_deletions_go_on_while_everything_unused_is_pruned(api: Api) -> None:
    """Pruned without any time to spare, so that each gap between file and row would show."""
    services = api.services
    done = threading.Event()
    freed: list[int] = []

    def prune() -> None:
        while not done.wait(0.002):
            now = time.time()
            unused = Unused(services.database, services.blobs, now, now + DAY)
            for step in unused.delete(whole(unused.meshes())):
                freed.append(step.freed.count)

    api.post("/v1/collections", 201, json={"name": "zoo"})
    name, content = next(iter(zoo_files().items()))
    thread = threading.Thread(target=prune)
    thread.start()
    try:
        for _ in range(40):
            (shape,) = api.upload("zoo", {name: content})["shapes"]
            assert api.get(f"/v1/shapes/{shape['id']}/mesh") == content
            time.sleep(0.01)
            assert api.get(f"/v1/shapes/{shape['id']}/mesh") == content
            api.delete(f"/v1/shapes/{shape['id']}")
            time.sleep(0.01)
    finally:
        done.set()
        thread.join()
    assert sum(freed) > 0


def test_a_mesh_query_stays_readable_while_everything_unused_is_pruned(zoo: Api) -> None:
    content = zoo_files()["crate.stl"]
    zoo.delete(f"/v1/shapes/{zoo.shape_ids['crate.stl']}")
    later = time.time() + 1000 * DAY
    store = Store(zoo.services.database, zoo.services.blobs, zoo.settings, later)
    answer = zoo.post(
        "/v1/collections/zoo/query/mesh?wait=0", 202, files={"mesh": ("crate.stl", content)}
    )
    assert sum(step.freed.count for step in free(store, "meshes")) == 0
    zoo.work()
    assert zoo.get(f"/v1/queries/{answer['query_id']}/mesh") == content
