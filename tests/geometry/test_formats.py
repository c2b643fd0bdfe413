"""OFF, OBJ, PLY and STL: what is written reads back, and every promised variant is read."""

import struct
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import box, bumpy_sphere, icosphere, octahedron, renumbered, scaled
from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats import WRITTEN_FORMATS, detect_format, parse, write
from workers.geometry.mesh import TriangleMesh

CUBE_OFF = b"""OFF
# a cube of quads
8 6 12
0 0 0
1 0 0   # trailing comment
1 1 0
0 1 0

0 0 1
1 0 1
1 1 1
0 1 1
4 3 2 1 0
4 4 5 6 7
4 0 1 5 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
"""


@pytest.mark.parametrize("format", WRITTEN_FORMATS)
def test_what_is_written_is_detected_and_reads_back(format: str) -> None:
    mesh = bumpy_sphere(2)
    parsed = parse(write(mesh, format))
    assert parsed.format == format
    corners, expected = parsed.mesh.vertices[parsed.mesh.faces], mesh.vertices[mesh.faces]
    single = format in ("stl", "glb")
    assert_allclose(corners, expected, rtol=2e-7 if single else 0, atol=1e-7 if single else 0)
    if format != "stl":
        assert_array_equal(parsed.mesh.faces, mesh.faces)
        assert parsed.mesh.n_vertices == mesh.n_vertices


@pytest.mark.parametrize("format", WRITTEN_FORMATS)
def test_another_reader_reads_what_is_written(format: str) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = bumpy_sphere(1)
    file = trimesh.util.wrap_as_stream(write(mesh, format))
    loaded = trimesh.load(file, file_type=format, process=False, force="mesh")
    assert_allclose(loaded.triangles, mesh.vertices[mesh.faces], atol=1e-6)


def test_writing_an_unknown_format_names_the_known_ones() -> None:
    with pytest.raises(UnsupportedFormatError, match="off, obj, ply, stl, glb, not as 'dae'"):
        write(octahedron(), "dae")


def test_stl_and_3mf_point_up_along_z_the_others_along_y() -> None:
    assert parse(write(octahedron(), "stl")).up == "z"
    assert parse(write(octahedron(), "obj")).up == "y"


@pytest.mark.parametrize(
    "data",
    [
        CUBE_OFF,
        CUBE_OFF.replace(b"\n", b"\r\n"),
        CUBE_OFF.replace(b"\n", b"\r"),
        CUBE_OFF.replace(b"OFF\n# a cube of quads\n", b"OFF "),
        CUBE_OFF.replace(b"OFF\n# a cube of quads\n", b"OFF"),
        CUBE_OFF.replace(b"8 6 12", b"8 6"),
        CUBE_OFF.replace(b"OFF", b"\xef\xbb\xbfOFF"),
        CUBE_OFF.replace(b"4 3 2 1 0", b"4 3 2 1 0 0.5 0.5 0.5"),
        CUBE_OFF.replace(b"4 3 2 1 0", b"4 3 2 1 0 255 0 0"),
        b"# made by hand\n\n" + CUBE_OFF,
    ],
    ids=[
        "plain",
        "crlf",
        "cr",
        "one-line",
        "glued",
        "no-edges",
        "bom",
        "rgb",
        "int-rgb",
        "comment",
    ],
)
def test_off_variants_are_the_same_cube(data: bytes) -> None:
    mesh = parse(data).mesh
    assert (mesh.n_vertices, mesh.n_faces) == (8, 12)
    assert_allclose(mesh.area, 6.0)
    assert_allclose(mesh.face_normals.sum(axis=0), 0.0)


@pytest.mark.parametrize(
    ("keyword", "extra"),
    [
        ("COFF", "255 0 0 255"),
        ("NOFF", "0 0 1"),
        ("STOFF", "0.5 0.5"),
        ("CNOFF", "0 0 1 0.1 0.2 0.3 1"),
        ("STCNOFF", "0 0 1 1 0 0 1 0 0"),
    ],
)
def test_off_prefixes_add_columns_that_are_left_out(keyword: str, extra: str) -> None:
    tetrahedron = f"0 0 0 {extra}\n1 0 0 {extra}\n0 1 0 {extra}\n0 0 1 {extra}\n"
    faces = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
    mesh = parse(f"{keyword}\n4 4 6\n{tetrahedron}{faces}".encode()).mesh
    assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def test_off_rows_may_differ_in_length() -> None:
    vertices = b"0 0 0\n1 0 0 9 9\n1 1 0\n0 1 0\n2 2 2 1\n"
    data = b"OFF\n5 3 0\n" + vertices + b"4 0 1 2 3\n3 0 1 4 0.5 0.5 0.5\n2 0 1\n"
    mesh = parse(data).mesh
    assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 4]])
    assert_array_equal(mesh.vertices[1], [1, 0, 0])


def test_off_without_lines_is_read_as_a_stream() -> None:
    data = b"OFF 4 4 6\n" + b" ".join(
        b"0 0 0 1 0 0 0 1 0 0 0 1 3 0 2 1 3 0 1 3 3 0 3 2 3 1 2 3".split()
    )
    assert parse(data).mesh.n_faces == 4


def test_obj_reads_textures_normals_relative_indices_colours_and_continuations() -> None:
    data = (
        b"# cube side\nmtllib a.mtl\no thing\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nvt 0 0\n"
        b"vn 0 0 1\ng one\nusemtl m\nf 1/1/1 2//1 3/1\ns off\nv 0 1 0\nf -4 -2 \\\n -1 # last\n"
        b"l 1 2\np 1\nv 0 0 1\nf 1 5 2\n"
    )
    mesh = parse(data).mesh
    assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 4, 1]])
    assert_array_equal(mesh.vertices[4], [0, 0, 1])


def test_obj_counts_from_one_in_its_messages() -> None:
    with pytest.raises(InvalidMeshError, match="face 0 refers to vertex 4, but the mesh has 3"):
        parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    with pytest.raises(InvalidMeshError, match="refers to vertex 0"):
        parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n")


def _ply(format: str, vertex_rows: bytes, face_rows: bytes, *, extra: str = "") -> bytes:
    header = (
        f"ply\nformat {format} 1.0\ncomment by hand\nelement vertex 4\nproperty float x\n"
        f"property float y\nproperty float z\nproperty uchar red\n{extra}element face 2\n"
        "property uchar flags\nproperty list uchar int vertex_indices\n"
        "property list uchar float texcoord\nend_header\n"
    )
    return header.encode() + vertex_rows + face_rows


SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


@pytest.mark.parametrize(("format", "order"), [("little", "<"), ("big", ">")])
def test_binary_ply_skips_what_it_does_not_need(format: str, order: str) -> None:
    vertices = b"".join(struct.pack(order + "3fB", *p, 7) for p in SQUARE)
    equal = b"".join(
        struct.pack(order + "BB3iB2f", 1, 3, *f, 2, 0, 0) for f in ((0, 1, 2), (0, 2, 3))
    )
    unequal = struct.pack(order + "BB4iB", 1, 4, 0, 1, 2, 3, 0) + struct.pack(
        order + "BB3iBf", 1, 3, 0, 2, 3, 1, 0.5
    )
    first = parse(_ply(f"binary_{format}_endian", vertices, equal)).mesh
    second = parse(_ply(f"binary_{format}_endian", vertices, unequal)).mesh
    assert_array_equal(first.faces, [[0, 1, 2], [0, 2, 3]])
    assert_array_equal(second.faces, [[0, 1, 2], [0, 2, 3], [0, 2, 3]])
    assert_array_equal(first.vertices, SQUARE)
    assert_array_equal(second.vertices, SQUARE)


def test_ascii_ply_reads_lists_behind_scalars() -> None:
    vertices = "".join(f"{x} {y} {z} 9\n" for x, y, z in SQUARE).encode()
    mesh = parse(_ply("ascii", vertices, b"1 3 0 1 2 2 0 0\n1 3 0 2 3 0\n")).mesh
    assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])
    assert_array_equal(mesh.vertices, SQUARE)


def test_ply_elements_may_come_in_any_order() -> None:
    data = (
        b"ply\r\nformat ascii 1.0\r\nelement face 1\r\nproperty list uchar int vertex_index\r\n"
        b"element vertex 3\r\nproperty double z\r\nproperty double x\r\nproperty double y\r\n"
        b"end_header\r\n3 0 1 2\r\n0 1 2\r\n3 4 5\r\n6 7 9\r\n"
    )
    mesh = parse(data).mesh
    assert_array_equal(mesh.vertices, [[1, 2, 0], [4, 5, 3], [7, 9, 6]])


def test_stl_text_equals_stl_binary() -> None:
    mesh = icosphere(1)
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join("  vertex {:.9g} {:.9g} {:.9g}\n".format(*p) for p in triangle)
        + " endloop\nendfacet\n"
        for triangle in mesh.vertices[mesh.faces]
    )
    text = parse(f"solid ball\n{facets}endsolid ball\n".encode())
    binary = parse(write(mesh, "stl"))
    assert text.format == binary.format == "stl"
    assert_allclose(text.mesh.vertices, binary.mesh.vertices, atol=1e-7)


def test_binary_stl_may_begin_with_solid_and_have_a_tail() -> None:
    data = b"solid" + write(box(), "stl")[5:]
    assert parse(data).mesh.n_faces == 12
    assert parse(data + b"tail", filename="a.stl").mesh.n_faces == 12


@pytest.mark.parametrize("format", WRITTEN_FORMATS)
def test_the_content_decides_where_the_ending_lies(format: str) -> None:
    data = write(octahedron(), format)
    for ending in ("off", "obj", "ply", "stl", "glb", "3mf", "txt"):
        assert detect_format(data, f"liar.{ending}") == format


def test_off_without_its_keyword_is_known_by_its_ending() -> None:
    data = CUBE_OFF.replace(b"OFF\n# a cube of quads\n", b"")
    assert parse(data, filename="cube.off").mesh.n_faces == 12


def test_a_concave_polygon_keeps_its_area() -> None:
    arrow = b"OFF\n4 1 0\n0 0 0\n2 1 0\n0 2 0\n1 1 0\n4 0 1 2 3\n"
    turned = arrow.replace(b"4 0 1 2 3", b"4 1 2 3 0")
    comb = (
        b"OFF\n8 1 0\n0 0 0\n5 0 0\n5 3 0\n4 3 0\n4 1 0\n1 1 0\n1 3 0\n0 3 0\n8 4 5 6 7 0 1 2 3\n"
    )
    for data, area in ((arrow, 1.0), (turned, 1.0), (comb, 9.0)):
        mesh = parse(data).mesh
        assert_allclose(mesh.area, area)
        assert (mesh.face_normals[:, 2] > 0).all()


def test_the_mesh_of_parse_is_read_only() -> None:
    mesh = parse(CUBE_OFF).mesh
    assert isinstance(mesh, TriangleMesh)
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = np.zeros(3)


@st.composite
def any_meshes(draw: st.DrawFn, *, width: Literal[32, 64]) -> TriangleMesh:
    """Meshes of any finite coordinates of a precision, and of any faces."""
    largest = 2.0**126 if width == 32 else 2.0**1000
    number = st.floats(-largest, largest, width=width, allow_subnormal=width == 64)
    vertices = draw(st.lists(st.tuples(number, number, number), min_size=3, max_size=12))
    corner = st.integers(0, len(vertices) - 1)
    faces = draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=20))
    return TriangleMesh(np.array(vertices), np.array(faces))


@pytest.mark.parametrize("format", ["off", "obj", "ply"])
@settings(max_examples=60, deadline=None)
@given(mesh=any_meshes(width=64))
def test_double_precision_reads_back_bit_for_bit(format: str, mesh: TriangleMesh) -> None:
    found = parse(write(mesh, format)).mesh
    assert found.vertices.tobytes() == mesh.vertices.tobytes()
    assert_array_equal(found.faces, mesh.faces)


@pytest.mark.parametrize("format", ["stl", "glb"])
@settings(max_examples=60, deadline=None)
@given(mesh=any_meshes(width=32))
def test_single_precision_reads_back_number_for_number(format: str, mesh: TriangleMesh) -> None:
    found = parse(write(mesh, format)).mesh
    corners = mesh.vertices[mesh.faces]
    assert_array_equal(found.vertices[found.faces], corners)  # a transform makes 0 of -0
    if format == "glb":
        assert_array_equal(found.vertices, mesh.vertices)
        assert_array_equal(found.faces, mesh.faces)


@pytest.mark.parametrize("format", WRITTEN_FORMATS)
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000), exponent=st.integers(-30, 30))
def test_numbering_and_unit_survive_writing(format: str, seed: int, exponent: int) -> None:
    """What is written of a renumbered mesh in another unit reads back as the mesh, so changed."""
    mesh = octahedron()
    shuffled, _ = renumbered(mesh, np.random.default_rng(seed))
    found = parse(write(scaled(shuffled, 2.0**exponent), format)).mesh
    expected = parse(write(shuffled, format)).mesh
    assert_array_equal(found.vertices, 2.0**exponent * expected.vertices)
    assert_array_equal(found.faces, expected.faces)
