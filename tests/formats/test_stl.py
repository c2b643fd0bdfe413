"""STL: counts that lie, records of unusual length, numbers as Windows prints them."""

import struct
import time

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.formats.stl_files import BINARY, FACETS, TEXT, N, rows, with_count
from tests.meshes import bumpy_sphere
from workers.errors import InvalidMeshError, ProteusError
from workers.geometry.cleaning import clean
from workers.geometry.formats import detect_format, parse, write
from workers.geometry.formats.text.numerals import respelled, with_decimal_points
from workers.geometry.mesh import TriangleMesh

EXPECTED = parse(BINARY).mesh.vertices


@pytest.mark.parametrize("count", [0, 1, N - 1, N, N + 1, 3 * N, 0x20202020, 0xFFFFFFFF])
@pytest.mark.parametrize("header", [b"", b"solid", b"COLOR="])
@pytest.mark.parametrize("filename", ["", "a.stl", "a.obj"])
def test_whatever_the_header_counts_all_whole_triangles_are_read(
    count: int, header: bytes, filename: str
) -> None:
    data = header.ljust(80, b" ") + with_count(count)[80:]
    parsed = parse(data, filename=filename)
    assert parsed.format == "stl"
    assert_array_equal(parsed.mesh.vertices, EXPECTED)
    assert bool(parsed.repairs) == (count != N)


@pytest.mark.parametrize("count", [0, 1, N - 1, N + 1, 0xFFFFFFFF])
def test_normals_of_length_0_are_read_by_the_ending(count: int) -> None:
    numbers = np.frombuffer(rows(), "<f4").reshape(-1, 12).copy()
    numbers[:, :3] = 0.0
    body = b"".join(row.tobytes() + b"\0\0" for row in numbers)
    mesh = parse(bytes(80) + struct.pack("<I", count) + body, filename="a.stl").mesh
    assert_array_equal(mesh.vertices, EXPECTED)


@pytest.mark.parametrize("tail", [b"x", bytes(50), b"0123456789" * 10, bytes(4096), b"\xff" * 50])
def test_rubbish_behind_the_triangles_is_left_out(tail: bytes) -> None:
    parsed = parse(BINARY + tail, filename="a.stl")
    assert_array_equal(parsed.mesh.vertices, EXPECTED)
    assert parsed.repairs == (f"left out {len(tail):,} bytes behind the last triangle",)


@pytest.mark.parametrize("keep", [0.03, 0.3, 0.6, 0.98])
def test_what_was_cut_within_a_triangle_is_refused(keep: float) -> None:
    length = 84 + 50 * int(keep * N) + 20
    with pytest.raises(InvalidMeshError, match="is truncated"):
        parse(BINARY[:length], filename="a.stl")


@pytest.mark.parametrize("attribute", [b"", b"\x05\0abcde", b"\x02\0xy", b"\0\0"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_records_may_be_longer_or_shorter(attribute: bytes, order: str) -> None:
    if order == ">" and len(attribute) > 4:
        return
    data = bytes(80) + struct.pack(order + "I", N) + rows(order, attribute)
    assert_array_equal(parse(data, filename="a.stl").mesh.vertices, EXPECTED)


def test_a_triangle_of_nan_is_passed_on() -> None:
    data = with_count(N + 1) + struct.pack("<12fH", 0, 0, 0, *[np.nan] * 9, 0)
    parsed = parse(data)
    assert parsed.repairs == ()
    assert np.isnan(parsed.mesh.vertices[-3:]).all()


def test_bytes_that_are_no_triangles_are_refused() -> None:
    rng = np.random.default_rng(0)
    for length in (84, 100, 134, 500, 5000, 84 + 50 * 100):
        for count in (0, 1, 7, 0xFFFFFFFF):
            data = rng.bytes(80) + struct.pack("<I", count) + rng.bytes(length - 84)
            if len(data) != 84 + 50 * count:
                with pytest.raises(ProteusError):
                    parse(data, filename="a.stl")
                assert detect_format(data, "a.stl") == "stl"


def test_the_walk_over_attributes_ends_soon() -> None:
    count = 200_000
    data = bytes(80) + struct.pack("<I", count) + bytes(50 * count + 1)
    start = time.perf_counter()
    with pytest.raises(ProteusError):
        parse(data, filename="a.stl")
    assert time.perf_counter() - start < 5.0  # linear; a hang would take minutes


@pytest.mark.parametrize("name", ["ends.off", "vertex", "outer loop", "facet", "solid solid", "é"])
def test_the_name_of_a_solid_may_be_anything(name: str) -> None:
    data = f"solid {name}\n{FACETS}endsolid {name}\n".encode("latin-1")
    assert_allclose(parse(data).mesh.vertices, EXPECTED, rtol=1e-7)


def test_the_text_may_hold_more_numbers_in_a_row() -> None:
    lines = [line + " 255 0 0" if "vertex" in line else line for line in TEXT.split("\n")]
    assert_allclose(parse("\n".join(lines).encode()).mesh.vertices, EXPECTED, rtol=1e-7)


def test_vertices_without_facets_are_triangles() -> None:
    lines = "\n".join(line for line in TEXT.split("\n") if "vertex" in line)
    data = f"solid\n{lines}\n".encode()
    assert_allclose(parse(data, filename="a.stl").mesh.vertices, EXPECTED, rtol=1e-7)


def test_a_facet_of_four_corners_is_two_triangles() -> None:
    data = b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n"
    parsed = parse(data + b"vertex 0 1 0\nendloop\nendfacet\nendsolid\n")
    assert parsed.mesh.n_faces == 2
    assert_allclose(parsed.mesh.area, 1.0)


@pytest.mark.parametrize("row", ["1 2", "1", "", "1 2 x", "1 2 1.2.3"])
def test_a_vertex_without_three_numbers_is_named(row: str) -> None:
    data = f"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex {row}\nvertex 1 1 0\n"
    with pytest.raises(InvalidMeshError, match=r"coordinates; expected 3|expected a number"):
        parse((data + "endloop\nendfacet\nendsolid\n").encode())


def test_every_end_of_a_text_is_read_whole_or_refused() -> None:
    text = write_text(bumpy_sphere(0))
    for length in range(len(text)):
        try:
            mesh = parse(text[:length], filename="a.stl").mesh
        except ProteusError:
            continue
        n_ended = text[:length].count(b"endl") or text[:length].count(b"\n    end")
        assert n_ended <= mesh.n_faces <= n_ended + 1


def write_text(mesh: TriangleMesh) -> bytes:
    trimesh = pytest.importorskip("trimesh")
    return str(trimesh.Trimesh(mesh.vertices, mesh.faces).export(file_type="stl_ascii")).encode()


def test_another_reader_sees_the_same_triangles() -> None:
    trimesh = pytest.importorskip("trimesh")
    for data, format in ((BINARY, "stl"), (TEXT.encode(), "stl_ascii")):
        file = trimesh.util.wrap_as_stream(data)
        loaded = trimesh.load(file, file_type=format, process=False)
        ours = parse(data).mesh
        assert_allclose(loaded.triangles, ours.vertices[ours.faces], rtol=1e-6)


@pytest.mark.parametrize(
    ("token", "value"),
    [
        *[(token, "nan") for token in ("nan", "-nan", "NaN", "-nan(ind)", "nan(snan)", "NANQ")],
        *[(token, "nan") for token in ("1.#QNAN", "-1.#IND", "1.#SNAN00", "-1.#IND00", "1.#J")],
        *[("1,#QNAN", "nan"), ("1.#QNANe+000", "nan"), ("nan(0x8000000000000)", "nan")],
        *[("inf", "inf"), ("-1.#INF", "-inf"), ("1.#INF00", "inf"), ("-Infinity", "-inf")],
        *[("1.5d+03", "1500"), ("-2D-1", "-0.2"), ("1.d0", "1"), ("1e+0003", "1000")],
    ],
)
def test_numbers_are_read_as_programs_print_them(token: str, value: str) -> None:
    assert_array_equal(float(respelled(token.encode())), float(value))


@pytest.mark.parametrize("token", ["", "x", "1.2.3", "d5", "1d", "--1", "#QNAN", "1#", "nano"])
def test_what_is_no_number_stays_as_it_is(token: str) -> None:
    assert respelled(token.encode()) == token.encode()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1,5 2 3,25\n4 5 6", "1.5 2 3.25\n4 5 6"),
        ("1.5,2.5,3.5\n4,5,6", "1.5 2.5 3.5\n4 5 6"),
        ("1.5, 2.5, 3.5\n4, 5, 6", "1.5 2.5 3.5\n4 5 6"),
        ("1,5, 2,5, 3,5\n4, 5, 6", "1.5 2.5 3.5\n4 5 6"),
        ("1,5;2,5;3,5\n4;5;6", "1.5 2.5 3.5\n4 5 6"),
        ("1,234.5 2 3", "1234.5 2 3"),
        ("1.234,5 2 3", "1234.5 2 3"),
        ("1,5e-3 2 3", "1.5e-3 2 3"),
    ],
)
def test_commas_are_what_they_can_be(text: str, expected: str) -> None:
    found, repairs = with_decimal_points(text.encode())
    assert found.split() == expected.encode().split()
    assert repairs


def test_nan_in_a_text_reaches_cleaning() -> None:
    data = TEXT.replace("endsolid body", "", 1) + (
        "facet normal 0 0 0\nouter loop\nvertex 0 0 -1.#IND\nvertex -nan(ind) 0 0\n"
        "vertex 1.#INF 1 0\nendloop\nendfacet\nendsolid\n"
    )
    assert not np.isfinite(parse(data.encode()).mesh.vertices[-3:]).all(axis=1).any()


def test_cleaning_makes_the_text_and_the_binary_file_one_shape() -> None:
    assert clean(parse(TEXT.encode()).mesh).mesh.n_vertices == 642
    assert clean(parse(write(bumpy_sphere(3), "stl")).mesh).mesh.n_vertices == 642
