"""Whatever the bytes are: a mesh, or one of three errors that say what is wrong."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.meshes import bumpy_sphere, icosahedron, octahedron, translated, union
from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.cleaning import clean
from workers.geometry.components import MOST_DESCRIBED, described_components
from workers.geometry.formats import WRITTEN_FORMATS, MeshLimits, parse, write
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import count_components

REFUSALS = (InvalidMeshError, UnsupportedFormatError, UploadTooLargeError)
PLY_HEAD = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
PLY_TAIL = "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n"


def ply_claiming(vertices: int, faces: int, *, format: str = "binary_little_endian") -> bytes:
    return (PLY_HEAD.format(format, vertices) + PLY_TAIL.format(faces)).encode()


@pytest.mark.parametrize(
    ("data", "error", "message"),
    [
        (b"", InvalidMeshError, "file is empty"),
        (b"\0" * 500, InvalidMeshError, "500 bytes, all of them zero"),
        (b"%PDF-1.7 not a mesh", UnsupportedFormatError, "a PDF document, which is not read"),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), UnsupportedFormatError, "a picture .PNG."),
        (b"PK\x03\x04broken", UnsupportedFormatError, "it has no directory"),
        (b"OFF\nhello world\n", InvalidMeshError, "numbers of vertices.*found 'hello world'"),
        (b"OFF\n", InvalidMeshError, "found nothing"),
        (b"OFF\n99999999999999999999 1 1\n", InvalidMeshError, "no sensible numbers"),
        (b"OFF\n-3 1 1\n", InvalidMeshError, "found '-3 1 1'"),
        (b"OFF\n1 1 0\n0 0 zero\n3 0 0 0\n", InvalidMeshError, "expected a number, found 'zero'"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 99\n", InvalidMeshError, "face 0 refers to ver"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", InvalidMeshError, "vertex -1"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n", InvalidMeshError, "found 1.5"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n", InvalidMeshError, "declares 9 corners"),
        (b"OFF\n3 1 0\n0 0\n1 0 0\n0 1 0\n3 0 1 2\n", InvalidMeshError, "vertex 0 has 2"),
        (b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", InvalidMeshError, "points but no faces"),
        (b"OFF\n0 0 0\n", InvalidMeshError, "neither vertices nor faces"),
        (b"OFF BINARY\n\0\0\0", InvalidMeshError, "ends before its counts"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", InvalidMeshError, "points but no faces .3 points"),
        (b"v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", InvalidMeshError, "vertex 1 has 2 coordinates"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 /3", InvalidMeshError, "without a vertex index"),
        (ply_claiming(3, 0), InvalidMeshError, "points but no faces"),
        (ply_claiming(3, 1)[:60], InvalidMeshError, "no 'end_header'"),
        (ply_claiming(3, 1), InvalidMeshError, "declares 3 vertices and 1 faces.*truncated"),
        (ply_claiming(3, 1, format="ascii") + b"0 0 0\n", InvalidMeshError, "truncated"),
        (ply_claiming(3, 1, format="ebcdic"), InvalidMeshError, "means nothing"),
        (b"solid x\nfacet\nvertex 0 0 0\nvertex 1 0 0\n", InvalidMeshError, "within facet 0"),
        (b"glTF" + b"\x01\0\0\0" + b"\x0c\0\0\0", UnsupportedFormatError, "GLB version 1"),
        (write(octahedron(), "glb")[:-9], InvalidMeshError, "truncated"),
        (b'{"asset": {"version": "2.0"}}', InvalidMeshError, "neither vertices nor faces"),
        (b'{"asset": ' + b"[" * 100_000, InvalidMeshError, "nested too deeply"),
    ],
)
def test_nonsense_is_named(data: bytes, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        parse(data)


@pytest.mark.parametrize(
    "data",
    [
        b"OFF\n1000000 1000000 0\n",
        ply_claiming(1_000_000, 1_000_000),
        ply_claiming(1_000_000, 1_000_000, format="ascii"),
    ],
)
def test_a_million_declared_vertices_without_data_are_named(data: bytes) -> None:
    with pytest.raises(InvalidMeshError, match=r"declares 1,000,000 vertices.*only .* follow"):
        parse(data)


def test_a_million_declared_triangles_without_data_are_named() -> None:
    data = b"\0" * 80 + (1_000_000).to_bytes(4, "little") + b"\1" * 100
    with pytest.raises(InvalidMeshError, match="declares 1,000,000 triangles"):
        parse(data, filename="thing.stl")


@pytest.mark.parametrize("format", WRITTEN_FORMATS)
def test_limits_are_those_given(format: str) -> None:
    data = write(icosahedron(), format)
    parse(data, limits=MeshLimits(vertices=12, faces=20))
    with pytest.raises(UploadTooLargeError, match="20 faces, but at most 19 are accepted"):
        parse(data, limits=MeshLimits(vertices=12, faces=19))
    if format != "stl":
        with pytest.raises(UploadTooLargeError, match="12 vertices, but at most 11 are accepted"):
            parse(data, limits=MeshLimits(vertices=11, faces=20))


def test_declared_counts_over_the_limits_are_refused_before_the_data_is_looked_at() -> None:
    for data in (b"OFF\n3000000 1 0\n", ply_claiming(3_000_000, 1)):
        with pytest.raises(UploadTooLargeError, match="3,000,000 vertices, but at most 2,000,000"):
            parse(data)


def test_triangles_of_polygons_count_against_the_limits() -> None:
    fan = (
        b"OFF\n6 1 0\n" + b"".join(b"%d %d 0\n" % (i, i * i) for i in range(6)) + b"6 0 1 2 3 4 5\n"
    )
    with pytest.raises(UploadTooLargeError, match="4 faces, but at most 3"):
        parse(fan, limits=MeshLimits(faces=3))


@pytest.mark.parametrize("format", WRITTEN_FORMATS)
def test_every_truncation_is_refused_or_read(format: str) -> None:
    data = write(octahedron(), format)
    for length in range(len(data)):
        with contextlib.suppress(*REFUSALS):
            parse(data[:length], filename=f"cut.{format}")


@pytest.mark.parametrize("format", [f for f in WRITTEN_FORMATS if f != "obj"])  # it has no end
@pytest.mark.parametrize("keep", [0.2, 0.5, 0.9])
def test_a_truncated_file_is_refused(format: str, keep: float) -> None:
    data = write(bumpy_sphere(2), format)
    with pytest.raises(InvalidMeshError):
        parse(data[: int(keep * len(data))], filename=f"cut.{format}")


ORIGINALS = {format: write(octahedron(), format) for format in WRITTEN_FORMATS}
JUNK = [b"-1", b"1e999", b"nan", b"\0", b"\xff\xff\xff\xff", b"999999999", b" ", b"\n", b"{", b'"']


@settings(max_examples=400, deadline=None)
@given(
    format=st.sampled_from(WRITTEN_FORMATS),
    edits=st.lists(
        st.tuples(
            st.floats(0, 1), st.integers(0, 6), st.sampled_from(JUNK) | st.binary(max_size=5)
        ),
        min_size=1,
        max_size=4,
    ),
)
def test_damaged_files_never_raise_anything_else(
    format: str, edits: list[tuple[float, int, bytes]]
) -> None:
    data = ORIGINALS[format]
    for place, removed, junk in edits:
        at = int(place * len(data))
        data = data[:at] + junk + data[at + removed :]
    with contextlib.suppress(*REFUSALS):
        mesh = clean(parse(data, filename=f"x.{format}").mesh).mesh
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.max() < mesh.n_vertices
        assert mesh.n_faces >= 4


@settings(max_examples=200, deadline=None)
@given(
    data=st.binary(max_size=300),
    start=st.sampled_from(
        [b"", b"OFF ", b"ply\n", b"solid facet ", b"glTF", b"v 1", b"PK\x03\x04"]
    ),
)
def test_any_bytes_are_refused_or_read(data: bytes, start: bytes) -> None:
    with contextlib.suppress(*REFUSALS):
        parse(start + data, filename="x.stl")


def test_nan_is_found_by_cleaning() -> None:
    parsed = parse(b"OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n")
    reason = r"1 of 1 faces .* face 0 has the coordinate nan; expected finite"
    with pytest.raises(InvalidMeshError, match=reason):
        clean(parsed.mesh)


def test_infinity_is_found_by_cleaning() -> None:
    parsed = parse(b"v 0 0 0\nv 1 0 0\nv 0 -inf 0\nf 1 2 3\n")
    with pytest.raises(InvalidMeshError, match="face 0 has the coordinate -inf"):
        clean(parsed.mesh)


def test_one_triangle_is_no_shape() -> None:
    parsed = parse(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    with pytest.raises(InvalidMeshError, match=r"1 face left.*at least 4"):
        clean(parsed.mesh)


def test_sixty_equal_components_are_all_kept() -> None:
    many = union(*[translated(octahedron(), (3.0 * i, 0, 0)) for i in range(60)])
    cleaned = clean(parse(write(many, "stl")).mesh)
    assert count_components(cleaned.mesh) == 60
    assert cleaned.mesh.n_vertices == 360


def test_two_thousand_equal_components_are_weighed_at_once() -> None:
    many = union(*[translated(octahedron(), (3.0 * i, 0, 0)) for i in range(2000)])
    found = described_components(clean(many).mesh)
    assert len(found) <= MOST_DESCRIBED
    assert found[0].body == pytest.approx(2000)


def test_coordinates_that_overflow_when_squared_are_refused() -> None:
    huge = TriangleMesh(octahedron().vertices * 1e300, octahedron().faces)
    with pytest.raises(InvalidMeshError, match="units long"):
        clean(huge)
    tiny = TriangleMesh(octahedron().vertices * 1e-300, octahedron().faces)
    with pytest.raises(InvalidMeshError, match="units long"):
        clean(tiny)
