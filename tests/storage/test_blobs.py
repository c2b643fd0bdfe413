"""Blobs: whole or not at all, there after a power cut, in a folder and in any other store."""

import os
import time
import uuid
from collections.abc import Callable
from pathlib import Path

import pytest

from workers.errors import BlobNotFoundError
from workers.storage.blobs import BlobStore, StoredBlob
from workers.storage.durable_folder import sync_path


@pytest.fixture(params=["file", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> BlobStore:
    """An empty store, once in a folder and once elsewhere."""
    return BlobStore(
        f"file://{tmp_path}/blobs" if request.param == "file" else f"memory://{uuid.uuid4().hex}"
    )


class PowerCut:
    """A disk that keeps what was synchronised, and forgets all else when the power is cut.

    A name survives if the folder that holds it was synchronised after it was written, and so on
    up to the first folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: set[Path] = {folder}
        self._whole: set[tuple[int, int]] = set()

    def sync(self, path: Path) -> None:
        sync_path(path)
        if path.is_dir():
            self._names |= set(path.iterdir())
        else:
            self._whole.add((path.stat().st_ino, path.stat().st_size))

    def survivors(self) -> list[str]:
        """Files that are there with all their bytes after a power cut now."""
        files = (path for path in self._folder.rglob("*") if path.is_file())
        return sorted(
            str(path.relative_to(self._folder))
            for path in files
            if (path.stat().st_ino, path.stat().st_size) in self._whole
            and all(
                part in self._names
                for part in (path, *path.parents)
                if part.is_relative_to(self._folder)
            )
        )


@pytest.mark.parametrize("way", ["put", "put_file"])
def test_what_was_stored_is_there_after_a_power_cut(tmp_path: Path, way: str) -> None:
    disk = PowerCut(tmp_path)
    store = BlobStore(f"file://{tmp_path}/data/blobs", sync=disk.sync)

    def write(key: str, data: bytes) -> None:
        if way == "put":
            store.put(key, data)
        else:
            source = tmp_path / uuid.uuid4().hex
            source.write_bytes(data)
            store.put_file(key, source)
            source.unlink()

    for key, data in {"meshes/ab/x": b"1", "meshes/ab/y": b"22", "meshes/cd/z": b"333"}.items():
        write(key, data)
        assert f"data/blobs/{key}" in disk.survivors()
    write("meshes/ab/x", b"another")
    assert len(disk.survivors()) == 3


def test_a_folder_that_another_process_has_just_made_is_not_taken_for_safe(tmp_path: Path) -> None:
    disk = PowerCut(tmp_path)
    BlobStore(f"file://{tmp_path}/blobs", sync=lambda _: None).put("meshes/ab/x", b"1")
    assert disk.survivors() == []
    BlobStore(f"file://{tmp_path}/blobs", sync=disk.sync).put("meshes/ab/y", b"2")
    assert "blobs/meshes/ab/y" in disk.survivors()


def test_a_folder_whose_own_folder_cannot_be_read_holds_blobs_all_the_same(tmp_path: Path) -> None:
    outer = tmp_path / "outer"
    (outer / "blobs").mkdir(parents=True)
    outer.chmod(0o300)
    try:
        store = BlobStore(f"file://{outer}/blobs")
        store.put("a/b", b"one")
        assert store.get("a/b") == b"one"
    finally:
        outer.chmod(0o700)


def test_a_write_that_fails_leaves_what_was_there(tmp_path: Path) -> None:
    def fail(_: Path) -> None:
        raise OSError("no space left")

    url = f"file://{tmp_path}"
    BlobStore(url).put("a/b", b"one")
    with pytest.raises(OSError, match="no space"):
        BlobStore(url, sync=fail).put("a/b", b"two")
    assert BlobStore(url).get("a/b") == b"one"


def test_blobs_replace_vanish_and_are_missed(store: BlobStore, tmp_path: Path) -> None:
    store.put("a/b", b"one")
    store.put("a/b", b"two")
    source = tmp_path / "source"
    source.write_bytes(b"three")
    store.put_file("a/c", source)
    assert (store.get("a/b"), store.get("a/c"), store.exists("a/c")) == (b"two", b"three", True)
    store.delete("a/b")
    store.delete("a/b")
    with pytest.raises(BlobNotFoundError, match="a/b"):
        store.get("a/b")
    with pytest.raises(BlobNotFoundError):
        store.fetch("a/b", tmp_path / "target")
    assert not store.exists("a/b")
    assert [blob.key for blob in store.blobs("a")] == ["a/c"]


def test_a_listing_names_folders_and_blobs_with_their_sizes(store: BlobStore) -> None:
    for key in ("m/ab/x", "m/ab/y", "m/cd/z", "n/ab/w"):
        store.put(key, key.encode())
    assert store.folders("m") == ["m/ab", "m/cd"]
    assert [(blob.key, blob.size) for blob in store.blobs("m/ab")] == [("m/ab/x", 6), ("m/ab/y", 6)]
    assert list(store.blobs("m")) == []
    assert (store.folders("none"), list(store.blobs("none"))) == ([], [])


@pytest.mark.parametrize("way", ["put", "put_file"])
def test_a_blob_that_is_stored_again_is_as_young_as_a_new_one(
    store: BlobStore, tmp_path: Path, way: str
) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"one")
    os.utime(source, (0, 0))
    writes: dict[str, Callable[[], None]] = {
        "put": lambda: store.put("a/b", b"one"),
        "put_file": lambda: store.put_file("a/b", source),
    }
    writes["put"]()
    first = store.info("a/b")
    assert first is not None
    time.sleep(0.02)
    writes[way]()
    second = store.info("a/b")
    assert second == StoredBlob("a/b", 3, second.modified if second else 0)
    assert time.time() - 5 < first.modified < second.modified <= time.time() + 1
    assert list(store.blobs("a")) == [second]
    assert store.info("a/c") is None
