"""PLY in depth: strips, rows of unequal lengths, hostile headers, and other readers."""

import io
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from tests.formats.kinds import BODY
from tests.formats.ply_files import STRIPS, header, points, polygons, text, triangles
from workers.errors import InvalidMeshError, ProteusError
from workers.geometry.formats import parse, write
from workers.geometry.formats.ply.strips import cut_strips
from workers.geometry.formats.text.tokens import Polygons

SQUARE = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "2 0 0"]


def small(face_rows: list[str], face: str = "list uchar int vertex_indices") -> bytes:
    """Five points and faces, as text."""
    head = header("ascii", face=(face,), vertices="vertex 5", faces=f"face {len(face_rows)}")
    return text(head, SQUARE, face_rows)


def test_strips_alternate_and_begin_anew_after_minus_one() -> None:
    rows = Polygons(np.array([7, 3]), np.array([0, 1, 2, 3, -1, 4, 5, 6, 7, 8]))
    found = cut_strips(rows, 9).corners.reshape(-1, 3)
    assert_array_equal(found, [[0, 1, 2], [2, 1, 3], [6, 7, 8]])


def test_a_repeated_vertex_turns_a_strip_without_a_triangle() -> None:
    rows = Polygons(np.array([6]), np.array([0, 1, 2, 2, 1, 3]))
    found = cut_strips(rows, 4).corners.reshape(-1, 3)
    assert_array_equal(found, [[0, 1, 2], [1, 2, 3]])  # the last begins at place 3


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_strip_of_less_than_three_vertices_is_no_triangle(count: int) -> None:
    assert len(cut_strips(Polygons(np.array([count]), np.arange(count)), 9).counts) == 0


def test_all_ones_is_a_vertex_where_there_is_such_a_vertex() -> None:
    rows = Polygons(np.array([3]), np.array([253, 254, 255]))
    assert len(cut_strips(rows, 256).counts) == 1
    assert len(cut_strips(rows, 255).counts) == 0


def test_strips_give_the_triangles_that_they_were_made_of() -> None:
    found = cut_strips(Polygons(np.array([len(STRIPS)]), np.array(STRIPS)), BODY.n_vertices)
    assert_array_equal(found.corners.reshape(-1, 3), BODY.faces)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("length", ["char", "short", "ushort", "int", "uint", "int64", "double"])
def test_lists_of_unequal_lengths_may_have_lengths_of_any_type(order: str, length: str) -> None:
    codes = {"char": "b", "short": "h", "ushort": "H", "int": "i", "uint": "I", "int64": "q"}
    rows = [[0, 1, 2], [0, 2, 3, 4], [1, 2, 3]]
    body = b"".join(
        struct.pack(f"{order}{codes.get(length, 'd')}{len(row)}i", len(row), *row) for row in rows
    )
    encoding = "binary_little_endian" if order == "<" else "binary_big_endian"
    face = (f"list {length} int vertex_indices",)
    head = header(encoding, face=face, vertices="vertex 5", faces="face 3")
    square = np.array([row.split() for row in SQUARE], dtype=float)
    mesh = parse(head + square.astype(order + "f8").tobytes() + body).mesh
    assert_array_equal(mesh.faces, parse(small(["3 0 1 2", "4 0 2 3 4", "3 1 2 3"])).mesh.faces)


def test_binary_and_text_give_the_same_mesh() -> None:
    rows = [[0, 1, 2, 3], [1, 4, 2]]
    head = header("binary_big_endian", vertices="vertex 5", faces="face 2")
    square = np.array([row.split() for row in SQUARE], dtype=">f8").tobytes()
    binary = parse(head + square + polygons(">", rows)).mesh
    as_text = parse(small(["4 0 1 2 3", "3 1 4 2"])).mesh
    assert_array_equal(binary.faces, as_text.faces)
    assert_array_equal(binary.vertices, as_text.vertices)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (small(["3 0 1"]), "face 0 of 1 has fewer numbers"),
        (small(["3 0 1 9"]), "face 0 refers to vertex 9"),
        (small(["3 0 1 -1"]), "refers to vertex -1"),
        (small(["3 0 1 1.5"]), "found 1.5"),
        (small(["-3 0 1 2"]), "has the length -3"),
        (small(["nan 0 1 2"]), "found nan"),
        (small(["3 0 1 two"]), "expected a number, found 'two'"),
        (small(["3 0 1 2"]).replace(b"vertex 5", b"vertex -5"), "means nothing"),
        (small(["3 0 1 2"]).replace(b"vertex 5", b"vertex"), "means nothing"),
        (small(["3 0 1 2"]).replace(b"vertex 5", b"vertex 9999999999999999"), "senseless count"),
        (small(["3 0 1 2"]).replace(b"format ascii 1.0\n", b""), "no format line"),
        (small(["3 0 1 2"]).replace(b"double x", b"double w"), "expected x, y and z"),
        (small(["3 0 1 2"]).replace(b"property double x\n", b"property\n"), "means nothing"),
        (small(["2 0 1"]), "points but no faces"),
    ],
)
def test_what_is_wrong_is_named(data: bytes, message: str) -> None:
    with pytest.raises(InvalidMeshError, match=message):
        parse(data)


def test_a_list_with_a_negative_length_is_refused_in_binary() -> None:
    head = header("binary_little_endian", face=("list int int vertex_indices",), faces="face 2")
    body = struct.pack("<4i", 3, 0, 1, 2) + struct.pack("<4i", -3, 0, 1, 2)
    with pytest.raises(InvalidMeshError, match="face 1 has the length -3"):
        parse(head + points("<") + body)


def test_an_element_without_properties_takes_no_bytes() -> None:
    head = header("binary_little_endian", more=["element nothing 999999999999999"])
    assert parse(head + points("<") + triangles("<")).mesh.n_faces == BODY.n_faces


def test_a_type_that_is_not_known_is_read_in_text_only() -> None:
    head = header("ascii", ("quaternion x", "double y", "double z"))
    assert parse(text(head)).mesh.n_faces == BODY.n_faces
    with pytest.raises(InvalidMeshError, match="no known type: 'property quaternion x'"):
        parse(head.replace(b"ascii", b"binary_little_endian") + points("<") + triangles("<"))


@pytest.mark.parametrize("format", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_trimesh_and_meshio_read_the_same(format: str) -> None:
    trimesh, meshio = pytest.importorskip("trimesh"), pytest.importorskip("meshio")
    order = ">" if "big" in format else "<"
    data = text() if format == "ascii" else header(format) + points(order) + triangles(order)
    ours = parse(data).mesh
    theirs = trimesh.load(io.BytesIO(data), file_type="ply", process=False)
    assert_array_equal(theirs.faces, ours.faces)
    assert_array_equal(theirs.vertices, ours.vertices)
    others = meshio.ply._ply.read_buffer(io.BytesIO(data))
    assert_array_equal(others.cells_dict["triangle"], ours.faces)


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(data: st.DataObject) -> None:
    """Bytes are changed, taken out or put in, in header and body alike."""
    whole = data.draw(
        st.sampled_from(
            [
                small(["4 0 1 2 3", "3 1 4 2"]),
                write(parse(small(["4 0 1 2 3", "3 1 4 2"])).mesh, "ply"),
                header("binary_big_endian", vertices="vertex 1", faces="tristrips 1")
                + bytes(24)
                + polygons(">", [[0, 0, 0, -1]]),
            ]
        )
    )
    start = data.draw(st.integers(0, len(whole)))
    length = data.draw(st.integers(0, 8))
    put = data.draw(st.binary(max_size=8))
    damaged = b"ply\n" + (whole[:start] + put + whole[start + length :])[4:]
    try:
        mesh = parse(damaged, filename="x.ply").mesh
    except ProteusError:
        return
    assert mesh.faces.max() < mesh.n_vertices
