"""Kinds of OFF files."""

import numpy as np

from tests.formats.kinds import BODY, kind, refused
from workers.geometry.formats import write

N, M = BODY.n_vertices, BODY.n_faces
VERTEX_ROWS = [" ".join(repr(float(x)) for x in p) for p in BODY.vertices]
FACE_ROWS = [f"3 {a} {b} {c}" for a, b, c in BODY.faces]


def off(
    keyword: str = "OFF",
    counts: str = f"{N} {M} 0",
    *,
    more: str = "",
    colour: str = "",
    vertex_rows: list[str] = VERTEX_ROWS,
    face_rows: list[str] = FACE_ROWS,
    end: str = "\n",
) -> bytes:
    """The body as OFF, with something after each vertex and face."""
    lines = [keyword, counts] if keyword else [counts]
    lines += [row + more for row in vertex_rows] + [row + colour for row in face_rows]
    return (end.join(lines) + end).encode()


def binary_off(
    order: str, real: str, *, colours: int | None = None, keyword: str = "OFF", more: int = 0
) -> bytes:
    """The body as binary OFF; ``colours`` None leaves out the number of colours of a face."""
    table = np.hstack([BODY.vertices, np.zeros((N, more))]).astype(order + real)
    tail = [] if colours is None else [colours, *[0] * colours]
    faces = [[3, *face, *tail] for face in BODY.faces.tolist()]
    counts = np.array([N, M, 0], order + "i4").tobytes()
    rest = np.array(faces, order + "i4").tobytes()
    return f"{keyword} BINARY\n".encode() + counts + table.tobytes() + rest


@kind("OFF", "as the format's text says", "Read.")
def plain() -> bytes:
    return write(BODY, "off")


@kind(
    "OFF",
    "keyword in lower or mixed case",
    "Read as if in capitals; said.",
    repairs=("read the keyword 'Off' as OFF",),
)
def lower_case() -> bytes:
    return off("Off")


@kind(
    "OFF",
    "no keyword, name ends in .off",
    "Read; said.",
    filename="body.off",
    repairs=("does not begin with OFF",),
)
def no_keyword() -> bytes:
    return off("")


@kind("OFF", "counts on the keyword's line", "Read.")
def counts_beside() -> bytes:
    return off(f"OFF {N} {M} 0", "")


@kind("OFF", "counts on three lines", "Read.")
def three_lines() -> bytes:
    return off(counts=f"{N}\n{M}\n0")


@kind("OFF", "counts on two lines", "Read.")
def two_lines() -> bytes:
    return off(counts=f"{N}\n{M}")


@kind("OFF", "no count of edges", "Read.")
def no_edges() -> bytes:
    return off(counts=f"{N} {M}")


@kind("OFF", "a fourth number beside the counts", "Read; what follows the counts is passed over.")
def four_counts() -> bytes:
    return off(counts=f"{N} {M} 0 17")


@kind("OFF", "comments and blank lines anywhere", "Read.")
def comments() -> bytes:
    text = off(more="  # a vertex", colour="\t# a face\n\n#\n")
    return b"# made by hand\n\n  # twice\n" + text.replace(b"OFF\n", b"OFF # body\n# counts:\n")


@kind("OFF", "line ends of old Macs (CR)", "Read.")
def carriage_returns() -> bytes:
    return off(end="\r")


@kind(
    "OFF",
    "face rows that wrap, one index a line",
    "Read number after number; said.",
    repairs=("rows wrap",),
)
def wrapped_faces() -> bytes:
    return off(face_rows=[row.replace(" ", "\n") for row in FACE_ROWS])


@kind("OFF", "the whole file on one line", "Read number after number.", repairs=("rows wrap",))
def one_line() -> bytes:
    return off().replace(b"\n", b" ")


@kind(
    "OFF",
    "wrapped at a fixed width",
    "Read number after number; said.",
    repairs=("rows wrap",),
)
def wrapped() -> bytes:
    words = b" ".join([w.encode() for row in VERTEX_ROWS + FACE_ROWS for w in row.split()]).split()
    lines = [b" ".join(words[i : i + 7]) for i in range(0, len(words), 7)]
    return f"OFF\n{N} {M} 0\n".encode() + b"\n".join(lines)


@kind(
    "OFF",
    "wrapped faces with colours",
    "Read where every face has equally many colour numbers and the file ends with the last; said.",
    repairs=("took 3 numbers after each face as its colour",),
    found=("face colours",),
)
def wrapped_colours() -> bytes:
    return off(face_rows=[f"{row} 255 0 0".replace(" ", "\n") for row in FACE_ROWS])


@refused(
    "OFF",
    "wrapped faces, only some of which have colours",
    "Refused: nothing tells colours from corners. Write one face a line.",
    reason="their corners cannot be told from their colours",
)
def wrapped_some_colours() -> bytes:
    rows = [row + (" 0.5 0.5 0.5" if i % 3 else "") for i, row in enumerate(FACE_ROWS)]
    return off(face_rows=[row.replace(" ", "\n") for row in rows])


@kind("OFF", "face colours", "Read; colours are left alone.", found=("face colours",))
def face_colours() -> bytes:
    return off(colour=" 0.5 1.0 0.25 1")


@kind("OFF", "COFF: vertex colours", "Read; colours are left alone.", found=("vertex colours",))
def coff() -> bytes:
    return off("COFF", more=" 255 0 0 255")


@kind(
    "OFF",
    "colours without the C of COFF",
    "Read; what follows x, y and z is left alone.",
    found=("vertex colours or normals",),
)
def colours_without_c() -> bytes:
    return off(more=" 255 0 0")


@kind("OFF", "NOFF: vertex normals", "Read; normals are left alone.", found=("vertex normals",))
def noff() -> bytes:
    return off("NOFF", more=" 0 0 1")


@kind(
    "OFF",
    "STOFF, CNOFF and all other prefixes",
    "Read; the first three numbers of a vertex are its place.",
    found=("vertex normals", "vertex colours", "vertex texture coordinates"),
)
def all_prefixes() -> bytes:
    return off("STCNOFF", more=" 0 0 1 0.5 0.5 0.5 1 0.25 0.75")


@kind(
    "OFF",
    "COFF that wraps",
    "Read number after number, colours of 4 or of 3 numbers.",
    repairs=("rows wrap",),
    found=("vertex colours",),
)
def wrapped_coff() -> bytes:
    return off("COFF", more=" 255 0 0").replace(b" ", b"\n")


@kind("OFF", "keyword that promises more than rows have", "Read.")
def promised() -> bytes:
    return off("CNOFF")


@kind("OFF", "4OFF: a fourth coordinate", "The first three are divided by it.")
def four() -> bytes:
    rows = [" ".join(repr(float(x) * 2) for x in p) + " 2" for p in BODY.vertices]
    return off("4OFF", vertex_rows=rows)


@refused("OFF", "4OFF with a fourth coordinate 0", "Refused by vertex.", reason="vertex 7 has the")
def at_infinity() -> bytes:
    rows = [f"{row} {int(i != 7)}" for i, row in enumerate(VERTEX_ROWS)]
    return off("4OFF", vertex_rows=rows)


@kind("OFF", "nOFF of 3 dimensions", "Read.")
def n_off() -> bytes:
    return off("nOFF", f"3\n{N} {M} 0")


@kind("OFF", "4nOFF of 3 dimensions", "Read; the first three are divided by the fourth.")
def four_n_off() -> bytes:
    return off("4nOFF 3", more=" 1")


@refused("OFF", "nOFF of other dimensions", "Refused: a surface in space is needed.", reason="5 co")
def n_off_of_five() -> bytes:
    return off("nOFF", f"5\n{N} {M} 0", more=" 0 0")


@kind("OFF", "OFF BINARY as Geomview writes it", "Read: big-endian, colours after each face.")
def geomview() -> bytes:
    return binary_off(">", "f4", colours=0)


@kind(
    "OFF",
    "OFF BINARY with face colours",
    "Read; colours are left alone.",
    found=("face colours",),
)
def geomview_colours() -> bytes:
    return binary_off(">", "f4", colours=4)


@kind("OFF", "COFF BINARY", "Read; colours are left alone.", found=("vertex colours",))
def binary_coff() -> bytes:
    return binary_off(">", "f4", colours=0, keyword="COFF", more=4)


@kind("OFF", "OFF BINARY as the PMP library writes it", "Read: little-endian, no colours.")
def pmp() -> bytes:
    return binary_off("<", "f4")


@kind("OFF", "OFF BINARY of float64", "Read: what makes sense to the last byte is taken.")
def pmp_double() -> bytes:
    return binary_off("<", "f8")


@kind(
    "OFF", "OFF BINARY with a tail", "Read; the tail is left out and said.", repairs=("left out",)
)
def binary_tail() -> bytes:
    return binary_off(">", "f4", colours=0) + b"tail"


@refused("OFF", "OFF BINARY, cut off", "Refused with its counts.", reason=f"{N} vertices")
def binary_cut() -> bytes:
    return binary_off(">", "f4", colours=0)[:-100]


@refused("OFF", "cut off", "Refused with its counts.", reason=f"declares {N} vertices")
def cut() -> bytes:
    return off()[: len(off()) // 3]


@refused("OFF", "cut off within the faces", "Refused with its counts.", reason="truncated")
def cut_faces() -> bytes:
    return off(face_rows=FACE_ROWS[:-100])


@kind(
    "OFF",
    "words or numbers after the last face",
    "Read; they are left out and said.",
    repairs=("left out what follows the last face",),
)
def tail() -> bytes:
    return off() + b"made by hand\n1 2 3\n"


@kind(
    "OFF",
    "faces of 1 or 2 corners among the others",
    "The others are read; said.",
    repairs=("left out 2 faces that are points or lines",),
)
def lines_among() -> bytes:
    return off(counts=f"{N} {M + 2} 0", face_rows=["1 5", *FACE_ROWS, "2 7 8"])


@kind("OFF", "numbers as Fortran prints them", "Read: 1.0d+00 is 1.")
def fortran() -> bytes:
    rows = [" ".join(f"{x:.16e}".replace("e", "D") for x in p) for p in BODY.vertices]
    return off(vertex_rows=rows)


@kind("OFF", "a byte order mark before the keyword", "Read.")
def byte_order_mark() -> bytes:
    return b"\xef\xbb\xbf" + off()


@kind("OFF", "decimal commas", "Read as points; said.", repairs=("decimal commas",))
def decimal_commas() -> bytes:
    return off(vertex_rows=[row.replace(".", ",") for row in VERTEX_ROWS])
