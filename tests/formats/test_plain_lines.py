"""What is read in pieces, as most files are, is the same as what is read line by line."""

import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.formats.kinds import BODY
from tests.formats.obj_files import FACES, PLAIN, VERTICES, faces_as, rows_of_vertices
from tests.formats.stl_files import TEXT
from tests.meshes import triangle_soup
from workers.errors import InvalidMeshError, UploadTooLargeError
from workers.geometry.formats import MeshLimits, parse
from workers.geometry.formats.obj import plain as plain_obj
from workers.geometry.formats.obj import reader as obj_reader
from workers.geometry.formats.stl import plain as plain_stl
from workers.geometry.formats.stl import text as stl_text

COMMENTS = "# a comment, 1/2 of it\nmtllib a\\b.mtl\n\ns off\n"
ZERO = "".join("f {} {} {}\n".format(*face) for face in BODY.faces.tolist())
OBJ = {
    "plain": PLAIN,
    "texture and normals": COMMENTS + VERTICES + "vt 0 0\nvn 0 0 1\n" + faces_as("{0}/1/1"),
    "normals": VERTICES + "vn 0 0 1\n" + faces_as("{0}//1"),
    "groups": "o a\no b\n" + VERTICES + "g x\nusemtl m\n" + FACES + "g y\n",
    "tabs": rows_of_vertices("v\t{0}\t{1}\t{2}") + FACES.replace(" ", "\t"),
    "colours": rows_of_vertices("v {0} {1} {2} 0.1 0.2 0.3") + FACES,
    "weights": rows_of_vertices("v {0} {1} {2} 1.0") + FACES,
    "quads": VERTICES + FACES + "f 1 2 3 4\nf 1 2\nf 5 6 7 8 9\n",
    "from 0": VERTICES + ZERO,
    "no end": PLAIN.rstrip("\n"),
    "Windows": PLAIN.replace("\n", "\r\n"),
    "leading zeros": VERTICES + faces_as("00{0}"),
    "two halves": VERTICES + FACES + VERTICES + FACES,
    "ends of a file": PLAIN + "\0\x1a",
    "names of many letters": "# \N{GREEK SMALL LETTER ALPHA}\no \N{SNOWMAN}\n" + PLAIN,
}


@pytest.mark.parametrize("piece", [1, 100, plain_obj.PIECE])
@pytest.mark.parametrize("name", OBJ)
def test_obj_of_plain_lines(name: str, piece: int, monkeypatch: pytest.MonkeyPatch) -> None:
    data = OBJ[name].encode()
    monkeypatch.setattr(plain_obj, "PIECE", piece)
    assert plain_obj.read_plain(data.rstrip(b"\0\x1a")) is not None
    found = parse(data, filename="a.obj")
    monkeypatch.setattr(obj_reader, "read_plain", lambda _: None)
    expected = parse(data, filename="a.obj")
    assert_array_equal(found.mesh.vertices, expected.mesh.vertices)
    assert_array_equal(found.mesh.faces, expected.mesh.faces)
    assert (found.found, found.repairs) == (expected.found, expected.repairs)


@pytest.mark.parametrize(
    "line",
    [
        *("f -1 -2 -3", "f 1 2 3 # c", "f 1 2 \\\n3", "f 1.0 2 3", "F 1 2 3", "f1 2 3"),
        *("  f 1 2 3", "f /1 2 3", "f 1,2,3", "v 0 0", "v 0 0 x", "v 0 0 0 # c", "v 0,5 0,5 0,5"),
        *("v 1.#INF 0 0", "v", "V 0 0 0", "vp 0 0 0", "f " + "1" * 19 + " 2 3", "f +1 2 3"),
        "v 0 0 0 1 1 1 1",
    ],
)
def test_lines_that_are_not_plain_are_left_to_the_other_reader(line: str) -> None:
    assert plain_obj.read_plain(f"{PLAIN}{line}\n".encode()) is None


def test_faces_between_many_other_lines_are_left_to_the_other_reader() -> None:
    face = "g a\nf 1 2 3\n"
    assert plain_obj.read_plain((VERTICES + face * 100_000).encode()) is None


def test_a_plain_file_is_held_to_the_limits_and_to_its_vertices() -> None:
    with pytest.raises(UploadTooLargeError, match="vertices, but at most 3"):
        parse(PLAIN.encode(), limits=MeshLimits(vertices=3))
    with pytest.raises(UploadTooLargeError, match="faces, but at most 3"):
        parse(PLAIN.encode(), limits=MeshLimits(faces=3))
    with pytest.raises(InvalidMeshError, match=f"face {BODY.n_faces} refers to vertex 99999"):
        parse(f"{PLAIN}f 1 2 99999\n".encode())


def facets(*, facet: str = "facet", end: str = "endfacet", exponent: str = "e") -> str:
    rows = ["solid a part\n"]
    for corners in BODY.vertices[BODY.faces].tolist():
        rows.append(f" {facet} normal 0 0 1\n  outer loop\n")
        rows += [
            f"   vertex {x:e} {y:e} {z:e}\n".replace("e-", exponent + "-") for x, y, z in corners
        ]
        rows.append(f"  endloop\n {end}\n")
    return "".join([*rows, "endsolid a part\n"])


STL = {
    "plain": facets(),
    "as others write it": TEXT if isinstance(TEXT, str) else TEXT.decode(),
    "upper case": facets().upper(),
    "Windows": facets().replace("\n", "\r\n"),
    "no last word": facets().rpartition("endsolid")[0],
    "no last line end": facets().rstrip("\n"),
    "one word": facets().replace("a part", "facet"),
}


@pytest.mark.parametrize("piece", [1, 1000, plain_stl.PIECE])
@pytest.mark.parametrize("name", STL)
def test_stl_of_facets_that_are_alike(
    name: str, piece: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = STL[name].encode()
    monkeypatch.setattr(plain_stl, "PIECE", piece)
    assert plain_stl.read_plain(data) is not None
    found = parse(data, filename="a.stl")
    monkeypatch.setattr(stl_text, "read_plain", lambda _: None)
    expected = parse(data, filename="a.stl")
    assert_array_equal(found.mesh.vertices, expected.mesh.vertices)
    assert_array_equal(found.mesh.faces, expected.mesh.faces)
    assert (found.found, found.repairs) == (expected.found, expected.repairs)


@pytest.mark.parametrize(
    "data",
    [
        facets().replace("endfacet", "end facet"),
        facets(exponent="d"),
        facets() + facets(),
        facets().replace("solid a part\n", "", 1),
        facets().replace("endfacet", "", 1),
        facets().replace("vertex", "vertex 1", 1),
        facets().replace("   vertex", "   vertex 0 0 0\n   vertex", 1),
        facets().replace(".", ","),
        facets().replace("   vertex", "   Vertex", 1),
        facets().replace("0 0 1", "nothing", 1),
        facets().replace("endsolid a part", "and more"),
    ],
)
def test_stl_that_is_written_otherwise_is_left_to_the_other_reader(data: str) -> None:
    assert plain_stl.read_plain(data.encode()) is None


def test_plain_stl_is_held_to_the_limits() -> None:
    with pytest.raises(UploadTooLargeError, match="faces, but at most 3"):
        parse(facets().encode(), limits=MeshLimits(faces=3))
    assert_allclose(parse(facets().encode()).mesh.vertices, triangle_soup(BODY).vertices, rtol=1e-6)
