"""Kinds of OBJ files."""

import re

import numpy as np

from tests.formats.kinds import BODY, Facts, kind, refused
from workers.geometry.formats import write

PLAIN = write(BODY, "obj").decode()
VERTICES = "".join(line + "\n" for line in PLAIN.split("\n") if line.startswith("v"))
FACES = PLAIN[len(VERTICES) :]


def faces_as(corner: str) -> str:
    """Every face, each corner as this pattern of its number from 1."""
    return "".join(
        "f " + " ".join(corner.format(i) for i in face) + "\n" for face in (BODY.faces + 1).tolist()
    )


def rows_of_vertices(pattern: str) -> str:
    return "".join(pattern.format(*p) + "\n" for p in BODY.vertices.tolist())


@kind("OBJ", "vertices and faces", "Read.")
def plain() -> bytes:
    return PLAIN.encode()


@kind(
    "OBJ",
    "corners as `v/vt/vn`, `v//vn` or `v/vt`",
    "Positions are read; texture coordinates and normals are left alone.",
    found=("texture coordinates",),
)
def corners() -> bytes:
    return (VERTICES + "vt 0 0\nvn 0 0 1\n" + faces_as("{0}/1/1")).encode()


@kind("OBJ", "relative (negative) indices", "Read.")
def relative() -> bytes:
    n = BODY.n_vertices + 1
    rows = "".join(f"f {a - n} {b - n} {c - n}\n" for a, b, c in (BODY.faces + 1).tolist())
    return (VERTICES + rows).encode()


@kind(
    "OBJ",
    "indices that count from 0",
    "Read so, if 0 occurs and the number of the last vertex by OBJ's count does not.",
    repairs=("count vertices from 0",),
)
def from_0() -> bytes:
    rows = "".join(f"f {a} {b} {c}\n" for a, b, c in BODY.faces.tolist())
    return (VERTICES + rows).encode()


@refused(
    "OBJ",
    "a face that refers to a vertex that there is not",
    "Refused: the file was cut or its numbers are wrong.",
    reason="face 0 refers to vertex 9999",
)
def out_of_range() -> bytes:
    return f"{VERTICES}f 1 2 9999\n{FACES}".encode()


@kind("OBJ", "faces before vertices", "Read.")
def faces_first() -> bytes:
    return (FACES + VERTICES).encode()


@kind(
    "OBJ",
    "colours or weights behind the coordinates",
    "Positions are read; colours are left alone.",
    found=("vertex colours",),
)
def colours() -> bytes:
    return (rows_of_vertices("v {} {} {} 0.5 0.25 1") + FACES).encode()


@kind("OBJ", "a weight behind the coordinates", "The weight is left out.")
def weights() -> bytes:
    return (rows_of_vertices("v {} {} {} 1.0") + FACES).encode()


@kind("OBJ", "the old keyword `fo` in place of `f`", "Read as a face.")
def fo() -> bytes:
    return PLAIN.replace("f ", "fo ").encode()


@kind("OBJ", "no blank behind `v` and `f`, or capital letters", "Read.")
def no_blanks() -> bytes:
    return PLAIN.replace("v ", "v").replace("f ", "F").encode()


@kind(
    "OBJ",
    "comments, names and paths that end in a backslash",
    "They end with the line; no vertex or face is lost.",
    found=("1 material",),
)
def backslashes() -> bytes:
    return f"# from C:\\models\\\n{VERTICES}usemtl A\\B\\\n{FACES}g C:\\\n# end\\".encode()


@kind("OBJ", "lines of faces and vertices that go on behind a backslash", "Read as one line.")
def continued() -> bytes:
    vertices = re.sub(r"^(v \S+ )", r"\1\\\n ", VERTICES, flags=re.MULTILINE)
    faces = re.sub(r"^(f \S+ \S+)", r"\1 \\ \r\n\t", FACES, flags=re.MULTILINE)
    return (vertices + faces).encode()


@kind(
    "OBJ",
    "decimal commas",
    "The commas are read as points.",
    repairs=("read decimal commas as points",),
)
def decimal_commas() -> bytes:
    return PLAIN.replace(".", ",").encode()


@kind("OBJ", "exponents of three or four digits, or Fortran's", "Read.")
def exponents() -> bytes:
    rows = rows_of_vertices("v {:.12e} {:.12e} {:.12e}")
    return (re.sub(r"e([+-])", r"D\g<1>00", rows) + FACES).encode()


@kind(
    "OBJ",
    "vertices of NaN that no face uses",
    "Left out.",
    repairs=("unreferenced",),
)
def nan_vertices() -> bytes:
    return f"{VERTICES}v nan nan nan\nv -nan(ind) 1.#QNAN -1.#INF\n{FACES}".encode()


@kind(
    "OBJ",
    "several objects, groups and materials",
    "All are read together and named; materials are left alone.",
    found=("2 objects", "3 groups", "2 materials (body.mtl)"),
)
def objects() -> bytes:
    lines = FACES.split("\n")
    heads = ["o a\ng x\nusemtl red", "g y", "o b\ng z\nusemtl blue"]
    parts = zip(heads, (lines[:300], lines[300:800], lines[800:]), strict=True)
    body = "".join(f"{head}\n" + "\n".join(part) + "\n" for head, part in parts)
    return f"mtllib body.mtl\n{VERTICES}{body}".encode()


@kind(
    "OBJ",
    "lines (`l`), points (`p`) and faces of one or two corners beside the surface",
    "Left out and counted.",
    repairs=("left out 2 faces of fewer than 3 corners",),
    found=("1 line", "2 points"),
)
def lines_and_points() -> bytes:
    return f"{VERTICES}p 1\np 2\nl 1 2 3\nf 1 2\nf 3\n{FACES}".encode()


@kind("OBJ", "old Mac line ends (CR)", "Read.")
def carriage_returns() -> bytes:
    return PLAIN.replace("\n", "\r").encode()


@kind("OBJ", "Windows line ends, also doubled ones (CR CR LF)", "Read.")
def doubled_line_ends() -> bytes:
    return PLAIN.replace("\n", "\r\r\n").encode()


@kind("OBJ", "NULs or a DOS end-of-file behind the text", "Left out.")
def padded() -> bytes:
    return PLAIN.encode() + b"\x1a" + bytes(500)


@kind("OBJ", "comments behind faces, tabs and blank lines", "Read.")
def comments() -> bytes:
    return re.sub(r"^f (.*)$", r"\n\tf\t\1\t# a face", PLAIN, flags=re.MULTILINE).encode()


@refused(
    "OBJ",
    "free-form surfaces only (`curv`, `surf`)",
    "Refused: export the file as a mesh.",
    reason="free-form surfaces but no polygons",
)
def free_form() -> bytes:
    return (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ncstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nend\n"
    )


@refused(
    "OBJ",
    "lines only (`l`)",
    "Refused: there is no surface.",
    reason="lines but no faces",
)
def lines_only() -> bytes:
    return f"{VERTICES}l 1 2 3\n".encode()


TEETH = 100
TOOTH = ((1.0, 5.0), (2.0, 5.0), (2.0, 1.0), (3.0, 1.0))
COMB = np.array(
    [
        (0.0, 0.0),
        (2.0 * TEETH - 1.0, 0.0),
        *[(2.0 * i - shift, height) for i in range(TEETH, 0, -1) for shift, height in TOOTH][:-2],
    ]
)
RIM = np.linalg.norm(COMB - np.roll(COMB, 1, axis=0), axis=1).sum()
COMB_AREA = 2.0 * TEETH - 1.0 + 4.0 * TEETH


def prism(outline: np.ndarray, height: float) -> bytes:
    """Walls between two polygons of so many corners."""
    n = len(outline)
    rows = [f"v {x} {y} {z}" for z in (0.0, height) for x, y in outline]
    rows.append("f " + " ".join(str(i) for i in range(n, 0, -1)))
    rows.append("f " + " ".join(str(n + i) for i in range(1, n + 1)))
    rows += [f"f {i + 1} {j + 1} {n + j + 1} {n + i + 1}" for i, j in _sides(n)]
    return ("\n".join(rows) + "\n").encode()


def _sides(n: int) -> list[tuple[int, int]]:
    return [(i, (i + 1) % n) for i in range(n)]


@kind(
    "OBJ",
    "concave polygons of hundreds of corners",
    "Cut into triangles that cover each polygon once.",
    facts=Facts(area=2.0 * COMB_AREA + 2.0 * RIM, vertices=2 * len(COMB)),
)
def comb() -> bytes:
    return prism(COMB, 2.0)


@kind(
    "OBJ",
    "polygons with holes, bridged by a slit",
    "Cut into triangles; the hole stays open.",
    facts=Facts(area=2.0 * (81 - 9) + 36 + 12, vertices=16),
)
def holes() -> bytes:
    outline = [1, 2, 3, 4, 1, 5, 8, 7, 6, 5]
    square = [(0, 0), (9, 0), (9, 9), (0, 9), (3, 3), (6, 3), (6, 6), (3, 6)]
    rows = [f"v {x} {y} {z}" for z in (0, 1) for x, y in square]
    rows.append("f " + " ".join(str(i + 8) for i in outline))
    rows.append("f " + " ".join(str(i) for i in reversed(outline)))
    for ring in ((1, 2, 3, 4), (8, 7, 6, 5)):
        sides = zip(ring, (*ring[1:], ring[0]), strict=True)
        rows += [f"f {i} {j} {j + 8} {i + 8}" for i, j in sides]
    return ("\n".join(rows) + "\n").encode()
