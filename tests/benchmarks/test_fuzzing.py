"""Fuzzing: changes within compressed files still open, and an account is kept."""

import bz2
import gzip
import io
import json
import lzma
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.fuzzing.__main__ import added, fuzz
from benchmarks.fuzzing.mutation import mutated
from benchmarks.fuzzing.seeds import dictionary
from tests.meshes import icosphere
from workers.geometry.formats import write

CONTENT = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def doubled(data: bytes, longest: int) -> bytes:
    return (data + data)[:longest]


def zipped(content: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a.obj", content)
    return file.getvalue()


def unzipped(data: bytes) -> bytes:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return archive.read(archive.namelist()[0])


@pytest.mark.parametrize(
    ("pack", "unpack"),
    [
        (gzip.compress, gzip.decompress),
        (bz2.compress, bz2.decompress),
        (lzma.compress, lzma.decompress),
        (zipped, unzipped),
    ],
)
def test_most_changes_go_to_what_a_compressed_file_holds(
    pack: Callable[[bytes], bytes], unpack: Callable[[bytes], bytes]
) -> None:
    packed = pack(CONTENT)
    within = 0
    for seed in range(50):
        found = mutated(packed, 1 << 16, seed, doubled)
        within += found != packed + packed and unpack(found) != CONTENT
    assert within > 20


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"BZh9", b"\x1f\x8b", b"solid"])
def test_what_does_not_open_is_changed_as_it_is(data: bytes) -> None:
    assert mutated(data, 1 << 16, 1, doubled) == data + data


def test_a_dictionary_has_the_words_of_files_and_of_what_archives_hold() -> None:
    words = dictionary([b"element vertex 3", zipped(b"<model>")]).splitlines()
    assert words == ['"element"', '"vertex"', '"<model>"']


def test_totals_of_runs_are_added_up() -> None:
    run = {"counts": {"inputs": 5, "crash": 1}, "unnamed": {"a": 1}, "seconds": 2}
    twice = added(added({}, "off", run), "off", run)["off"]
    assert twice["counts"] == {"inputs": 10, "crash": 1, "timeout": 0, "oom": 0}
    assert (twice["unnamed"], twice["seconds"]) == ({"a": 2}, 4)


@pytest.mark.slow
def test_a_short_run_keeps_an_account(tmp_path: Path) -> None:
    pytest.importorskip("atheris")
    files = [write(icosphere(0), "off")]
    found = fuzz("off", tmp_path, files=files, inputs=1000, seconds=120)
    assert found["counts"]["inputs"] >= 500
    assert not found["findings"]
    assert json.loads((tmp_path / "findings" / "account.json").read_text())["counts"]
