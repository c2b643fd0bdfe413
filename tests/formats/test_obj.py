"""OBJ: what ends a line, what is found, and what many people's exporters write."""

import contextlib
import time

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.formats.kinds import BODY
from tests.formats.obj_files import FACES, PLAIN, VERTICES
from workers.errors import ProteusError
from workers.geometry.formats import parse

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    "face",
    [
        *("f 1 2 3 4", "f 1/1 2/1 3/1 4/1", "f 1//1 2//1 3//1 4//1", "f 1/ 2/ 3/ 4/", "fo 1 2 3 4"),
        *("f1 2 3 4", "f -4 -3 -2 -1", "f 1 2 \\\n3 4", "f 1 2 3 4 \\", "f 1 2 3 4\\\ng x"),
        *("f 1, 2, 3, 4", "f\t1\t2\t3\t4", "F 1 2 3 4", "f 1.0 2.0 3.0 4.0", "f 1 2 3 4 # f 1 2"),
        *("f \\\n1 \\\n2 \\\n3 \\\n4", "f 1\\1 2\\1 3\\1 4\\1", "f 1 2 3 4\r", "  f 1 2 3 4"),
    ],
)
@pytest.mark.parametrize("end", ["", "\n", "\nvt 0 0\n", "\n# \\", "\nl 1 2"])
def test_a_face_may_be_written_in_many_ways(face: str, end: str) -> None:
    mesh = parse((SQUARE + face + end).encode()).mesh
    assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize(
    "line",
    [
        *("# C:\\", "#\\", "usemtl a\\", "mtllib C:\\x\\", "o \\", "g \\  ", "s \\", "hello \\"),
        *("vt 0 0 \\", "vn 0 0 1\\", "l 1 2 \\", "# v 1 2 3 \\", "usemtl f \\", "# f 1 2 \\"),
    ],
)
def test_no_backslash_swallows_the_vertex_or_face_behind(line: str) -> None:
    data = f"{line}\n{SQUARE}{line}\nf 1 2 3\n{line}\nf 1 3 4\n{line}".encode()
    assert parse(data).mesh.n_faces == 2
    assert parse(data.replace(b"\n", b"\r\n")).mesh.n_faces == 2
    assert parse(data.replace(b"\n", b"\r"), filename="a.obj").mesh.n_faces == 2


def test_vertex_rows_may_differ_in_length() -> None:
    data = b"v 0 0 0 1\nv 1 0 0\nv 1 1 0 0.1 0.2 0.3\nv 0 1 0 1 1 1 1\nf 1 2 3 4\n"
    assert_array_equal(parse(data).mesh.vertices[:, :2], [[0, 0], [1, 0], [1, 1], [0, 1]])


def test_numbers_from_0_need_a_whole_file_that_says_so() -> None:
    four = "f 0 1 2\nf 0 2 3\nf 1 2 3\nf 0 1 3\n"
    assert parse((SQUARE + four).encode()).mesh.faces.min() == 0
    for face in ("f 1 2 4\n", "f -1 -2 -3\n", "f 0 1 5\n"):
        with pytest.raises(ProteusError, match="refers to vertex"):
            parse((SQUARE + four + face + "f 0 1 4\n").encode())


def test_a_name_in_what_was_found_is_printable_and_short() -> None:
    data = b"mtllib \x01\xff" + b"x" * 500 + b".mtl\nusemtl a\n" + SQUARE.encode() + b"f 1 2 3 4\n"
    (materials,) = parse(data).found
    assert materials.isprintable()
    assert len(materials) < 100


def test_a_face_that_begins_the_file_is_known_as_obj() -> None:
    data = (FACES * 8 + VERTICES).encode()
    assert parse(data).format == "obj"


def test_another_reader_sees_the_same_triangles() -> None:
    trimesh = pytest.importorskip("trimesh")
    file = trimesh.util.wrap_as_stream(PLAIN.encode())
    loaded = trimesh.load(file, file_type="obj", process=False)
    assert_allclose(loaded.triangles, BODY.vertices[BODY.faces], rtol=1e-9)


@pytest.mark.parametrize(
    "line", ["f 1 2 " + "\\\n" * 100_000, "v " * 200_000, "f" + " " * 10**6, "\\" * 10**6]
)
def test_long_lines_take_no_longer_than_others(line: str) -> None:
    start = time.perf_counter()
    with contextlib.suppress(ProteusError):
        parse((SQUARE + line + "\nf 1 2 3\n").encode(), filename="a.obj")
    assert time.perf_counter() - start < 5.0  # linear; a hang would take minutes


@pytest.mark.parametrize("n", [5, 64, 65, 400, 3000])
def test_a_star_of_any_number_of_corners_keeps_its_area(n: int) -> None:
    angles = np.pi * np.arange(2 * n) / n
    radii = np.where(np.arange(2 * n) % 2, 10.0, 4.0)
    points = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    area = n * 40.0 * np.sin(np.pi / n)  # 2n triangles of sides 4 and 10
    rows = "".join(f"v {x!r} {y!r} 0\n" for x, y in points.tolist())
    mesh = parse(f"{rows}f {' '.join(str(i + 1) for i in range(2 * n))}\n".encode()).mesh
    assert_allclose(mesh.area, area, rtol=1e-9)
    assert (mesh.face_normals[:, 2] > 0).all()
