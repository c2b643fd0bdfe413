"""OFF in depth: counts, wrapped rows, binary layouts, hostile files, and other readers."""

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from tests.formats.kinds import BODY
from tests.formats.off_files import FACE_ROWS, binary_off, off, wrapped_colours
from workers.errors import InvalidMeshError, ProteusError
from workers.geometry.formats import parse, write
from workers.geometry.formats.off import begins_with_counts, is_off

SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


@pytest.mark.parametrize(
    "counts",
    [
        *("4 2 0\n", "4 2\n", "4\n2\n0\n", "4\n2\n", "4 2\n0\n", "4\n2 0\n", "4 2 0 17\n"),
        *("\n\n  4 2 0\n\n", "4\t2\t0\r\n", "4 2 0 # counts\n"),
    ],
)
@pytest.mark.parametrize("keyword", ["OFF\n", "OFF ", "OFF", "off\n", "Off ", "OFF # body\n"])
def test_counts_may_stand_anywhere(keyword: str, counts: str) -> None:
    data = f"{keyword}{counts}{SQUARE}3 0 1 2\n3 0 2 3\n".encode()
    assert_array_equal(parse(data).mesh.faces, [[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("faces", ["4 0 1 2 3\n3 0 1 2\n", "3 0 1 2\n4 0 1 2 3\n"])
@pytest.mark.parametrize("colours", ["", " 7", " 255 0 0", " 0.1 0.2 0.3 1"])
def test_polygons_wrap_with_any_colours(faces: str, colours: str) -> None:
    rows = faces.replace("\n", f"{colours}\n")
    as_lines = parse(f"OFF 4 2 0\n{SQUARE}{rows}".encode()).mesh
    wrapped = parse(f"OFF 4 2 0\n{SQUARE}{rows}".replace(" ", "\n").encode()).mesh
    assert_array_equal(wrapped.faces, as_lines.faces)
    assert_array_equal(wrapped.vertices, as_lines.vertices)


def test_wrapped_faces_with_colours_are_the_same_faces() -> None:
    assert_array_equal(parse(wrapped_colours()).mesh.faces, BODY.faces)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("real", ["f4", "f8"])
@pytest.mark.parametrize("colours", [None, 0, 3, 4])
def test_binary_layouts_are_told_apart(order: str, real: str, colours: int | None) -> None:
    mesh = parse(binary_off(order, real, colours=colours)).mesh
    assert_array_equal(mesh.faces, BODY.faces)
    assert_array_equal(mesh.vertices, BODY.vertices.astype(real))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"OFF\n4 1 0\n" + SQUARE.encode() + b"3 0 1\n", "face 0 declares 3 corners, but 2"),
        (b"OFF\n4 1 0\n" + SQUARE.encode() + b"3 0 1 inf\n", "found inf"),
        (b"OFF\n4 1 0\n" + SQUARE.encode() + b"-1 0 1 2\n", "face 0 declares -1 corners"),
        (b"OFF\n4 1 0\n" + SQUARE.encode() + b"3 0 x 2\n", "expected a number, found 'x'"),
        (b"OFF\n4 1 0\n0 0 0\n1 0 0\n1 1\n0 1 0\n3 0 1 2\n", "vertex 2 has 2 coordinates"),
        (b"nOFF\n2\n4 1 0\n" + SQUARE.encode(), "nOFF has 2 coordinates a vertex; expected 3"),
        (b"OFF\n1.5 1 0\n0 0 0\n", "numbers of vertices, faces and edges, found '1.5 1 0'"),
        (b"OFF BINARY\n" + bytes(11), "ends before its counts"),
        (b"OFF BINARY\n" + b"\x7f" * 12 + bytes(40), "truncated or damaged"),
    ],
)
def test_what_is_wrong_is_named(data: bytes, message: str) -> None:
    with pytest.raises(InvalidMeshError, match=message):
        parse(data)


def test_signalling_nan_and_corners_far_away_pass_through() -> None:
    counts = np.array([4, 1, 0], ">i4").tobytes()
    points = bytes.fromhex("7f800001") + bytes(40) + bytes.fromhex("7f7fffff")
    data = b"OFF BINARY\n" + counts + points + np.array([4, 0, 1, 2, 3, 0], ">i4").tobytes()
    mesh = parse(data).mesh
    assert np.isnan(mesh.vertices[0, 0])
    assert mesh.n_faces == 2
    comb = "OFF 6 1 0\n0 0 0\n1e300 0 0\n1 1 0\n1e308 nan 0\n2 0 0\n1 -9e307 0\n6 0 1 2 3 4 5\n"
    assert parse(comb.encode()).mesh.n_faces == 4


@pytest.mark.parametrize("text", [b"offset 3", b"office 4", b"coffee\n1 2 3", b"turn OFF 3 lamps"])
def test_words_that_begin_like_the_keyword_are_none(text: bytes) -> None:
    assert not is_off(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [(b"8 6 12\n0 0 0", True), (b"# a\n8\n6\n", True), (b"8.5 6 12\n", False), (b"v 1 2\n", False)],
)
def test_a_file_without_keyword_begins_with_counts(text: bytes, expected: bool) -> None:
    assert begins_with_counts(text) is expected


def test_windows_spellings_are_no_comments() -> None:
    data = b"OFF\n4 1 0\n0 0 0\n1.#QNAN 0 0\n1 1 0 # -1.#IND\n-nan(ind) 1.#INF 0\n3 0 2 2\n"
    vertices = parse(data).mesh.vertices
    assert_array_equal(vertices[1:], [[np.nan, 0, 0], [1, 1, 0], [np.nan, np.inf, 0]])


@pytest.mark.parametrize("data", [off(), off(end="\r\n"), off("COFF", more=" 255 0 0 255")])
def test_trimesh_reads_the_same(data: bytes) -> None:
    trimesh = pytest.importorskip("trimesh")
    theirs = trimesh.load(io.BytesIO(data), file_type="off", process=False)
    ours = parse(data).mesh
    assert_array_equal(theirs.faces, ours.faces)
    assert_array_equal(theirs.vertices, ours.vertices)


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(data: st.DataObject) -> None:
    """Bytes are changed, taken out or put in."""
    rows = f"OFF 4 2 0\n{SQUARE}4 0 1 2 3\n3 0 1 2\n".encode()
    binary = binary_off(">", "f4", colours=0)
    whole = data.draw(
        st.sampled_from([rows, rows.replace(b"\n", b" "), rows.replace(b" ", b"\n"), binary])
    )
    start = data.draw(st.integers(0, len(whole)))
    put = data.draw(st.one_of(st.binary(max_size=8), st.sampled_from([b"1e99", b"nan", b"-1"])))
    damaged = whole[:start] + put + whole[start + data.draw(st.integers(0, 8)) :]
    try:
        mesh = parse(damaged, filename="x.off").mesh
    except ProteusError:
        return
    assert mesh.faces.max() < mesh.n_vertices


def test_a_row_a_line_is_never_read_as_a_stream() -> None:
    """A face that lacks a corner must not take it from the next line."""
    rows = [*FACE_ROWS[:5], FACE_ROWS[5].rpartition(" ")[0], *FACE_ROWS[6:]]
    with pytest.raises(InvalidMeshError, match="face 5 declares 3 corners, but 2 numbers follow"):
        parse(off(face_rows=rows))
    assert parse(write(BODY, "off")).repairs == ()
