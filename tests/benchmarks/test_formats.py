"""The comparison of readers: what it says of meshes that differ, and of readers that fail."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.formats.child import count_components, facts, fan
from benchmarks.formats.comparison import differences, is_mesh_file, report, totals
from benchmarks.formats.process import Reader
from tests.formats.gltf_builders import Builder
from tests.meshes import bumpy_sphere
from workers.geometry.formats import write
from workers.geometry.topology import count_components as components_of

BODY = bumpy_sphere(2)


def known(scale: float = 1.0, shift: float = 0.0) -> dict[str, Any]:
    return facts(scale * BODY.vertices + shift, BODY.faces)


def record(ours: dict[str, Any], **peers: dict[str, Any]) -> dict[str, Any]:
    cleaned: dict[str, Any] = {} if "error" in ours else {"cleaned": {}}
    return {"path": "a/b.ply", "answers": {"ours": ours | cleaned, **peers}}


def test_facts_are_those_of_the_mesh() -> None:
    found = known()
    assert found["faces"] == BODY.n_faces
    assert found["area"] == pytest.approx(BODY.area)
    assert found["components"] == components_of(BODY)


def test_components_hang_together_by_coinciding_corners() -> None:
    corners = BODY.vertices[BODY.faces].reshape(-1, 3)
    assert count_components(corners) == 1
    assert count_components(np.concatenate([corners, corners + 9.0, corners - 9.0])) == 3


def test_faces_that_are_not_finite_are_counted_apart() -> None:
    vertices = BODY.vertices.copy()
    vertices[0] = np.nan
    around = int((BODY.faces == 0).any(axis=1).sum())
    assert facts(vertices, BODY.faces)["faces_not_finite"] == around


def test_polygons_are_cut_into_triangles() -> None:
    assert fan(np.array([[0, 1, 2, 3]])).tolist() == [[0, 1, 2], [0, 2, 3]]
    assert fan([[0, 1, 2], [3, 4, 5, 6]]).tolist() == [[0, 1, 2], [3, 4, 5], [3, 5, 6]]


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (known(1 + 1e-7), []),
        (facts(BODY.vertices, BODY.faces[:0]), ["no faces, ours 320"]),
        (known(shift=100.0), ["the same size at another place"]),
        (facts(BODY.vertices[:, [1, 2, 0]], BODY.faces), ["the axes are others"]),
    ],
)
def test_a_difference_is_named(other: dict[str, Any], words: list[str]) -> None:
    assert differences(known(), other) == words


def test_a_difference_of_scale_names_the_factor() -> None:
    area, bounds = differences(known(), known(10.0))
    assert area.startswith("area ")
    assert bounds == "10 times as large"


def test_who_refuses_is_named_with_their_words() -> None:
    refused = {"error": "it is damaged", "type": "InvalidMeshError"}
    (line,) = report(record(refused, trimesh=known()))
    assert (line.kind, line.path) == ("refused", "a/b.ply")
    assert line.text.startswith("refused: it is damaged; trimesh reads 320 faces")
    (line,) = report(record(known(), trimesh={"error": "bad", "type": "ValueError"}))
    assert (line.kind, line.text) == ("fails", "trimesh fails: bad")
    (line,) = report(record(refused, trimesh={"error": "bad 17", "type": "ValueError"}))
    assert (line.kind, line.gist) == ("all", "refused: it is damaged; trimesh: bad …")
    assert not list(report(record(known(), trimesh=known(), meshio=known())))


def test_totals_count_a_format() -> None:
    failed = {"error": "bad", "type": "ValueError"}
    records = [record(known(), trimesh=known()), record(known(), trimesh=failed)]
    (one,) = totals(records).values()
    assert (one.files, one.read["ours"], one.read["trimesh"]) == (2, 2, 1)
    assert (one.asked["trimesh"], one.same["trimesh"], one.alone) == (2, 1, 1)


def test_a_file_that_nobody_takes_for_a_mesh_is_passed_over() -> None:
    unknown = {"error": "of no known format", "type": "UnsupportedFormatError"}
    assert not is_mesh_file(record(unknown))
    assert not is_mesh_file(record(unknown, trimesh={"error": "bad", "type": "ValueError"}))
    assert is_mesh_file(record(unknown, trimesh=known()))


@pytest.mark.parametrize("name", ["ours", "trimesh", "meshio"])
def test_every_reader_gives_back_the_body(name: str, tmp_path: Path) -> None:
    path = tmp_path / "body.ply"
    path.write_bytes(write(BODY, "ply"))
    reader = Reader(name)
    assert reader.start()
    try:
        assert reader.takes(path)
        found = reader.ask(path)
        assert not differences(known(), found), found
        damaged = tmp_path / "damaged.ply"
        damaged.write_bytes(b"ply\nformat ascii 1.0\nelement vertex three\n")
        assert reader.ask(damaged)["error"]
        assert not differences(known(), reader.ask(path))
    finally:
        reader.stop()


def test_brain_surfaces_have_a_peer(tmp_path: Path) -> None:
    path = tmp_path / "lh.pial"
    numbers = BODY.vertices.astype(">f4").tobytes() + BODY.faces.astype(">i4").tobytes()
    counts = struct.pack(">ii", BODY.n_vertices, BODY.n_faces)
    path.write_bytes(b"\xff\xff\xfemade by hand\n\n" + counts + numbers)
    reader = Reader("nibabel")
    assert reader.start()
    try:
        assert reader.takes(path)
        assert not differences(known(), reader.ask(path))
    finally:
        reader.stop()


def test_ours_takes_the_files_beside_a_gltf(tmp_path: Path) -> None:
    builder = Builder().body(BODY)
    path = tmp_path / "scene.gltf"
    path.write_bytes(builder.gltf("scene.bin"))
    (tmp_path / "scene.bin").write_bytes(builder.binary)
    reader = Reader("ours")
    assert reader.start()
    try:
        assert not differences(known(), reader.ask(path))
    finally:
        reader.stop()


def test_a_reader_that_hangs_is_ended_and_starts_again(tmp_path: Path) -> None:
    path = tmp_path / "body.ply"
    path.write_bytes(write(BODY, "ply"))
    reader = Reader("ours", seconds=0.0)
    assert reader.start()
    try:
        assert reader.ask(path)["type"] == "hang"
        reader.seconds = 60.0
        assert not differences(known(), reader.ask(path))
    finally:
        reader.stop()


def test_a_reader_that_is_not_installed_takes_no_part() -> None:
    assert not Reader("no such reader").start()
