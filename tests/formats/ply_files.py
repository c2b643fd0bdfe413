"""Kinds of PLY files."""

from collections.abc import Sequence

import numpy as np

from tests.formats.kinds import BODY, kind, refused
from workers.geometry.arrays import IntArray
from workers.geometry.formats import write

N, M = BODY.n_vertices, BODY.n_faces
ORDERS = {"<": "binary_little_endian", ">": "binary_big_endian"}
XYZ = ("double x", "double y", "double z")
CORNERS = ("list uchar int vertex_indices",)


def header(
    format: str,
    vertex: Sequence[str] = XYZ,
    face: Sequence[str] = CORNERS,
    *,
    vertices: str = f"vertex {N}",
    faces: str = f"face {M}",
    more: Sequence[str] = (),
    end: str = "\n",
) -> bytes:
    """A header; ``more`` are lines after its format."""
    lines = ["ply", f"format {format} 1.0", *more]
    lines += [f"element {vertices}", *(f"property {p}" for p in vertex)]
    lines += [f"element {faces}", *(f"property {p}" for p in face)] if faces else []
    return (end.join([*lines, "end_header"]) + end).encode()


VERTEX_ROWS = [" ".join(repr(float(x)) for x in p) for p in BODY.vertices]
FACE_ROWS = [f"3 {a} {b} {c}" for a, b, c in BODY.faces]


def text(
    head: bytes | None = None,
    vertex_rows: list[str] = VERTEX_ROWS,
    face_rows: list[str] = FACE_ROWS,
    end: str = "\n",
) -> bytes:
    """The body as text, a row a line."""
    return (head or header("ascii")) + (end.join(vertex_rows + face_rows) + end).encode()


def points(order: str, type: str = "f8") -> bytes:
    """The coordinates, row after row."""
    return BODY.vertices.astype(order + type).tobytes()


def triangles(order: str, length: str = "u1", index: str = "i4") -> bytes:
    """The faces as lists of three indices."""
    rows = np.empty(M, dtype=[("n", order + length), ("corners", order + index, (3,))])
    rows["n"], rows["corners"] = 3, BODY.faces
    return rows.tobytes()


def polygons(order: str, rows: Sequence[Sequence[int]], tail: bytes = b"") -> bytes:
    """Lists of any lengths, each followed by ``tail``."""
    return b"".join(
        bytes([len(row)]) + np.array(row, order + "i4").tobytes() + tail for row in rows
    )


def strips(rows: IntArray) -> list[list[int]]:
    """One strip a triangle, and for every second triangle one that turns twice before it."""
    return [
        [a, b, c, -1] if place % 2 else [a, a, a, b, c, -1]
        for place, (a, b, c) in enumerate(rows.tolist())
    ]


STRIPS = [corner for strip in strips(BODY.faces) for corner in strip]


@kind("PLY", "text", "Read.")
def plain_text() -> bytes:
    return text()


@kind("PLY", "binary, little-endian", "Read.")
def little_endian() -> bytes:
    return write(BODY, "ply")


@kind("PLY", "binary, big-endian", "Read.")
def big_endian() -> bytes:
    return header(ORDERS[">"]) + points(">") + triangles(">")


@kind("PLY", "triangle strips in one row, -1 between them, binary", "Cut into triangles.")
def strips_little() -> bytes:
    head = header(ORDERS["<"], face=("list int int vertex_indices",), faces="tristrips 1")
    return head + points("<") + np.array([len(STRIPS), *STRIPS], "<i4").tobytes()


@kind("PLY", "triangle strips, big-endian", "Cut into triangles.")
def strips_big() -> bytes:
    head = header(ORDERS[">"], face=("list uint int vertex_indices",), faces="tristrips 1")
    return head + points(">") + np.array([len(STRIPS), *STRIPS], ">i4").tobytes()


@kind("PLY", "triangle strips of unsigned indices", "The largest number is -1 there.")
def strips_unsigned() -> bytes:
    head = header(ORDERS["<"], face=("list int uint vertex_indices",), faces="tristrips 1")
    return head + points("<") + np.array([len(STRIPS), *STRIPS], "<i4").tobytes()


@kind("PLY", "triangle strips, one a row", "Cut into triangles.")
def strips_in_rows() -> bytes:
    rows = strips(BODY.faces)
    head = header(ORDERS["<"], faces=f"tri_strips {len(rows)}")
    return head + points("<") + polygons("<", rows)


@kind("PLY", "triangle strips in text", "Cut into triangles.")
def strips_text() -> bytes:
    head = header("ascii", faces="tristrips 1")
    return text(head, face_rows=[" ".join(map(str, [len(STRIPS), *STRIPS]))])


@kind("PLY", "text with CR line ends", "Read.")
def cr_text() -> bytes:
    return text(header("ascii", end="\r"), end="\r")


@kind("PLY", "text with CRLF line ends", "Read.")
def crlf_text() -> bytes:
    return text(header("ascii", end="\r\n"), end="\r\n")


@kind("PLY", "binary after a header with CR line ends", "Read.")
def cr_binary() -> bytes:
    return header(ORDERS["<"], end="\r") + points("<") + triangles("<")


@kind("PLY", "binary after a header with CRLF line ends", "Read.")
def crlf_binary() -> bytes:
    return header(ORDERS["<"], end="\r\n") + points("<") + triangles("<")


@kind("PLY", "a binary body whose first byte reads as a line feed", "Read.")
def body_begins_with_line_feed() -> bytes:
    head = header(ORDERS["<"], ("uchar flag", *XYZ), end="\r")
    rows = b"".join(b"\n" + row.astype("<f8").tobytes() for row in BODY.vertices)
    return head + rows + triangles("<")


@kind(
    "PLY",
    "a line of the header that is none of PLY's",
    "Passed over; said.",
    repairs=("passed over a line of the header that is none of PLY's: 'Created by",),
)
def credit_line() -> bytes:
    return text(header("ascii", more=["Created by Blender3D 247 - www.blender.org, source:"]))


@kind("PLY", "comments in Latin-1", "Read.")
def latin() -> bytes:
    return text(header("ascii", more=["comment Gr\xf6\xdfe"]).decode("utf-8").encode("latin-1"))


@kind("PLY", "comments and blank lines among the rows", "Read.")
def body_comments() -> bytes:
    rows = ["comment vertices", "", *VERTEX_ROWS, "comment faces", "obj_info 1", "# more"]
    return text(vertex_rows=rows)


@kind("PLY", "no version after the format", "Read.")
def no_version() -> bytes:
    return text(header("ascii").replace(b"ascii 1.0", b"ascii"))


@kind("PLY", "keywords, names and types in capitals", "Read.")
def capitals() -> bytes:
    return text(header("ascii").upper().replace(b"PLY", b"ply"))


@kind("PLY", "elements vertices and faces", "Read as vertex and face.")
def plural() -> bytes:
    return text(header("ascii", vertices=f"vertices {N}", faces=f"Faces {M}"))


@kind("PLY", "indices of int64", "Read.")
def int64() -> bytes:
    head = header(ORDERS["<"], face=("list uchar int64 vertex_indices",))
    return head + points("<") + triangles("<", index="i8")


@kind("PLY", "other names of types", "Read: uint32_t, unsigned int, ulong, half and the like.")
def type_names() -> bytes:
    face = ("list uint16_t unsigned int vertex_indices",)
    head = header(ORDERS[">"], ("float64_t x", "real64 y", "double z"), face)
    head = head.replace(b"real64", b"DOUBLE")
    return head + points(">") + triangles(">", "u2", "u4")


@kind("PLY", "list lengths of any type", "Read, floats too.")
def float_lengths() -> bytes:
    head = header(ORDERS["<"], face=("list float int vertex_indices",))
    return head + points("<") + triangles("<", "f4")


@kind("PLY", "indices named vertex_index, vertex_indexes or anything", "The only list is taken.")
def other_list() -> bytes:
    return text(header("ascii", face=("list uchar int corners_of_it",)))


@refused(
    "PLY",
    "faces with two lists of other names",
    "Refused with their names.",
    reason="['a', 'b']; expected one list",
)
def two_lists() -> bytes:
    head = header("ascii", face=("list uchar int a", "list uchar int b"))
    return text(head, face_rows=[row + " 0" for row in FACE_ROWS])


@kind("PLY", "lists of unequal lengths after x, y and z", "Read.")
def list_after() -> bytes:
    head = header(ORDERS["<"], (*XYZ, "list uchar int seen_by"))
    rows = [
        p.astype("<f8").tobytes() + bytes([i % 4]) + bytes(4 * (i % 4))
        for i, p in enumerate(BODY.vertices)
    ]
    return head + b"".join(rows) + triangles("<")


@kind("PLY", "lists of unequal lengths before x, y and z", "Read, in text too.")
def list_before() -> bytes:
    rows = [f"{i % 3} {'7 ' * (i % 3)}{row}" for i, row in enumerate(VERTEX_ROWS)]
    return text(header("ascii", ("list uchar int seen_by", *XYZ)), rows)


@kind(
    "PLY",
    "triangles and other polygons mixed, with texture coordinates",
    "Polygons are cut into triangles; lines and points are left out and said.",
    repairs=("left out 1 face that is a point or a line",),
    found=("face texture coordinates",),
)
def mixed() -> bytes:
    face = (*CORNERS, "list uchar float texcoord", "uchar flags")
    head = header(ORDERS[">"], face=face, faces=f"face {M + 1}")
    rows = [*BODY.faces.tolist(), [3, 4]]
    tails = [bytes([2]) + bytes(8) + b"\7" if i % 2 else b"\0\7" for i in range(M + 1)]
    faces = [polygons(">", [row], tail) for row, tail in zip(rows, tails, strict=True)]
    return head + points(">") + b"".join(faces)


@kind(
    "PLY",
    "colours, normals, texture coordinates, quality, other elements",
    "Left alone; named in what was found.",
    found=(
        *("vertex colours", "vertex normals", "vertex texture coordinates", "vertex quality"),
        *("1 texture", "elements 'edge'"),
    ),
)
def extras() -> bytes:
    names = ("nx", "ny", "nz", "red", "green", "blue", "s", "t", "quality")
    vertex = ("float confidence", *XYZ, *(f"float {name}" for name in names))
    head = header("ascii", vertex, more=["comment TextureFile skin.png"])
    head = head.replace(b"end_header", b"element edge 2\nproperty int a\nend_header")
    rows = [f"1 {row} 0 0 1 255 0 0 0.5 0.5 1" for row in VERTEX_ROWS]
    return text(head, rows) + b"1\n2\n"


@kind("PLY", "faces before vertices", "Read.")
def faces_first() -> bytes:
    lines = header("ascii").decode().split("\n")
    swapped = "\n".join([*lines[:2], *lines[6:8], *lines[2:6], *lines[8:]])
    return text(swapped.encode(), FACE_ROWS, VERTEX_ROWS)


@kind(
    "PLY",
    "text in one line, or wrapped in any way",
    "Read number after number; said.",
    repairs=("lines are not rows",),
)
def one_line() -> bytes:
    return text(end=" ")


@kind(
    "PLY",
    "text whose rows have more numbers than the header names",
    "The first of each row are read; said.",
    repairs=("left out numbers at the end of 'vertex' lines",),
)
def longer_rows() -> bytes:
    return text(vertex_rows=[row + " 0 0 1" for row in VERTEX_ROWS])


@kind("PLY", "text without its last line end", "Read.")
def no_last_line_end() -> bytes:
    return text().rstrip()


@kind(
    "PLY",
    "words or more rows after the last row, in text",
    "Read; they are left out and said.",
    repairs=("left out what follows the last row",),
)
def words_after() -> bytes:
    return text() + b"made by hand\n"


@kind(
    "PLY",
    "bytes after the last row",
    "Read; they are left out and said.",
    repairs=("left out 4 bytes after the last row",),
)
def bytes_after() -> bytes:
    return write(BODY, "ply") + b"tail"


@refused("PLY", "cut off, binary", "Refused with its counts.", reason="the file ends after 1,272")
def cut_binary() -> bytes:
    return write(BODY, "ply")[:-100]


@refused("PLY", "cut off, text", "Refused with its counts.", reason="rows of 'face', but the file")
def cut_text() -> bytes:
    return text(face_rows=FACE_ROWS[:-100])


@refused(
    "PLY",
    "points without faces",
    "Refused as a point cloud: make a surface of it first, for example with MeshLab.",
    reason="it is a point cloud",
)
def point_cloud() -> bytes:
    return text(header("ascii", faces=""), face_rows=[])


@refused(
    "PLY",
    "Gaussian splats",
    "Refused by name: export a mesh from the program that made them.",
    reason="Gaussian splats",
)
def splats() -> bytes:
    more = tuple(f"float {name}" for name in ("f_dc_0", "opacity", "scale_0", "rot_0"))
    return header(ORDERS["<"], (*XYZ, *more), faces="") + bytes(40 * N)


@refused(
    "PLY",
    "a range grid of a scanner",
    "Refused by name: make triangles of it first, for example with MeshLab.",
    reason="a range grid",
)
def range_grid() -> bytes:
    head = header(
        "ascii", faces="range_grid 4", more=["obj_info num_cols 2", "obj_info num_rows 2"]
    )
    return text(head, face_rows=["1 0", "1 1", "0", "1 2"])


@refused("PLY", "no end_header", "Refused as cut off.", reason="no 'end_header'")
def no_end() -> bytes:
    return header("ascii")[:-12]


@kind(
    "PLY",
    "a vertex that no face uses and is no number, as Windows prints it",
    "The vertex is left out.",
)
def not_a_number() -> bytes:
    head = header("ascii", vertices=f"vertex {N + 1}")
    return text(head, [*VERTEX_ROWS, "-1.#IND 1.#QNAN -nan(ind)"])


@kind("PLY", "decimal commas in text", "Read as points; said.", repairs=("decimal commas",))
def decimal_commas() -> bytes:
    return text(vertex_rows=[row.replace(".", ",") for row in VERTEX_ROWS])


@kind("PLY", "commas between numbers in text", "Read as blanks; said.", repairs=("commas between",))
def commas_between() -> bytes:
    return text(vertex_rows=[row.replace(" ", ", ") for row in VERTEX_ROWS])
