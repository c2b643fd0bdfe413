"""Kinds of STL files."""

import re
import struct
from functools import cache

import numpy as np

from tests.formats.kinds import BODY, Facts, kind, refused
from workers.geometry.formats import write

CORNERS = BODY.vertices[BODY.faces]
BINARY = write(BODY, "stl")
N = BODY.n_faces
UNIT = BODY.face_normals.astype(np.float32)


def with_count(count: int, data: bytes = BINARY) -> bytes:
    return data[:80] + struct.pack("<I", count) + data[84:]


@cache
def rows(order: str = "<", tail: bytes = b"") -> bytes:
    """Triangles one after the other, each with this behind its 48 bytes of coordinates."""
    numbers = np.concatenate([UNIT[:, None], CORNERS], axis=1).astype(order + "f4")
    return b"".join(row.tobytes() + tail for row in numbers)


def facet(corners: np.ndarray, number: str = "{:.9g}") -> str:
    points = "".join(f"      vertex {' '.join(number.format(x) for x in p)}\n" for p in corners)
    return f"  facet normal 0 0 1\n    outer loop\n{points}    endloop\n  endfacet\n"


FACETS = "".join(facet(corners) for corners in CORNERS)
TEXT = f"solid body\n{FACETS}endsolid body\n"
WRONG_COUNT = f"but the file has {N:,}"


@kind("STL", "binary", "Read.")
def binary() -> bytes:
    return BINARY


@kind("STL", "text", "Read.")
def text() -> bytes:
    return TEXT.encode()


@kind("STL", "binary, with a header that begins with `solid`", "Read as binary.")
def binary_solid() -> bytes:
    return b"solid made by a CAD program".ljust(80, b" ") + BINARY[80:]


@kind(
    "STL",
    "binary, with the number of triangles never filled in (0)",
    "All whole triangles are read.",
    repairs=(WRONG_COUNT,),
)
def count_0() -> bytes:
    return with_count(0)


@kind(
    "STL",
    "binary, with 0xFFFFFFFF or another impossible number of triangles",
    "All whole triangles are read.",
    repairs=(WRONG_COUNT,),
)
def count_all_bits() -> bytes:
    return with_count(0xFFFFFFFF) + b"tail"


@kind(
    "STL",
    "binary, whose header counts more triangles than there are",
    "All triangles are read, if the file ends behind a whole one.",
    filename="a.stl",
    repairs=(WRONG_COUNT,),
)
def count_more() -> bytes:
    return with_count(2 * N)


@kind(
    "STL",
    "binary, whose header counts fewer triangles than there are",
    "All are read, if the file ends behind a whole one and what follows looks like triangles.",
    repairs=(WRONG_COUNT,),
)
def count_less() -> bytes:
    return with_count(N - 7)


@kind(
    "STL",
    "binary, with other bytes behind the triangles",
    "The bytes are left out.",
    filename="a.stl",
    repairs=("left out 150 bytes behind",),
)
def tail() -> bytes:
    return BINARY + b"made by " + bytes(142)


@kind(
    "STL",
    "binary, cut within the last of its triangles",
    "Whole triangles are read, if less than 1 % of them is missing.",
    filename="a.stl",
    facts=Facts(area=None, vertices=None, loops=1),
    repairs=(f"but the file has {N - 1:,}",),
)
def cut_at_the_end() -> bytes:
    return BINARY[:-10]


@kind(
    "STL",
    "binary, without the two bytes behind the last triangle",
    "Read; nothing is missing.",
    filename="a.stl",
)
def without_the_last_attribute() -> bytes:
    return BINARY[:-2]


@refused(
    "STL",
    "binary, cut in the middle",
    "Refused: the shape would be another one. Save or copy the file again.",
    filename="a.stl",
    reason="is truncated",
)
def cut() -> bytes:
    return BINARY[: len(BINARY) // 2 + 7]


@refused(
    "STL",
    "binary, cut within its header",
    "Refused: it has no triangle.",
    filename="a.stl",
    reason="binary STL has at least 84 bytes",
)
def cut_header() -> bytes:
    return b"made by a program\0\0\0\0\0"


@kind(
    "STL",
    "binary, with attribute bytes behind each triangle, as many as it says",
    "The bytes are left out.",
    filename="a.stl",
    repairs=("left out the bytes that follow each triangle",),
)
def attribute_bytes() -> bytes:
    body = b"".join(
        rows()[48 * i : 48 * i + 48] + struct.pack("<H", i % 5) + bytes(range(i % 5))
        for i in range(N)
    )
    return BINARY[:84] + body


@kind(
    "STL",
    "binary, with 52 or 48 bytes a triangle, as C compilers fill up or drop the attribute",
    "Read.",
    repairs=("read 52 bytes a triangle",),
)
def padded() -> bytes:
    return BINARY[:84] + rows(tail=bytes(4))


@kind(
    "STL",
    "binary, with the high byte first",
    "Read.",
    repairs=("high byte first",),
)
def high_byte_first() -> bytes:
    return bytes(80) + struct.pack(">I", N) + rows(">", bytes(2))


@kind(
    "STL",
    "binary, with colours as Magics or VisCAM write them",
    "Read; colours are left alone.",
    found=("colours of triangles",),
)
def colours() -> bytes:
    return b"COLOR=\xff\0\0\xff,MATERIAL=".ljust(80) + BINARY[80:84] + rows(tail=b"\x1f\x80")


@kind(
    "STL",
    "text that ends with `end solid`",
    "Read.",
    repairs=("read 'end solid' as 'endsolid'",),
)
def end_solid() -> bytes:
    return TEXT.replace("endsolid", "end solid").encode()


@kind(
    "STL",
    "text without `endsolid`",
    "Read, if the last facet is whole.",
    repairs=("ends without 'endsolid'",),
)
def no_end() -> bytes:
    return f"solid body\n{FACETS}".encode()


@refused(
    "STL",
    "text that ends within a facet",
    "Refused: nobody knows how much is missing. Save or copy the file again.",
    reason="it is truncated",
)
def text_cut() -> bytes:
    return text()[: len(TEXT) // 2 + 30]


@kind(
    "STL",
    "text without `solid` at the beginning",
    "Read.",
    repairs=("does not begin with 'solid'",),
)
def no_beginning() -> bytes:
    return f"{FACETS}endsolid\n".encode()


@kind(
    "STL",
    "text of several solids",
    "All are read together.",
    found=("3 solids",),
)
def solids() -> bytes:
    parts = [CORNERS[:100], CORNERS[100:700], CORNERS[700:]]
    return "".join(
        f"solid part {i}\n{''.join(map(facet, part))}endsolid part {i}\n"
        for i, part in enumerate(parts)
    ).encode()


@kind("STL", "text in upper case, with tabs and Windows line ends", "Read.")
def upper_case() -> bytes:
    return TEXT.upper().replace("  ", "\t").replace("\n", "\r\n").encode()


@kind("STL", "text with old Mac line ends (CR)", "Read.")
def carriage_returns() -> bytes:
    return TEXT.replace("\n", "\r").encode()


@kind("STL", "text all in one line", "Read.")
def one_line() -> bytes:
    return " ".join(TEXT.split()).encode()


@kind(
    "STL",
    "text with decimal commas",
    "The commas are read as points.",
    repairs=("read decimal commas as points",),
)
def decimal_commas() -> bytes:
    return re.sub(r"(\d)\.(\d)", r"\1,\2", TEXT).encode()


@kind("STL", "text with Fortran's exponents (`1.5d+00`)", "Read.")
def fortran() -> bytes:
    facets = "".join(facet(corners, "{:.9e}").replace("e+", "d+") for corners in CORNERS)
    return f"solid\n{facets.replace('e-', 'D-')}endsolid\n".encode()


@kind(
    "STL",
    "text with facets of more than three corners, or fewer",
    "Larger facets are cut into triangles, smaller ones are left out.",
    repairs=("cut 1 facet of more than 3", "left out 1 facet of fewer than 3"),
)
def larger_facets() -> bytes:
    first = CORNERS[0]
    doubled = first[[0, 1, 1, 2]]
    rest = "".join(map(facet, CORNERS[1:]))
    return f"solid\n{facet(doubled)}{facet(first[:2])}{rest}endsolid\n".encode()


@kind(
    "STL",
    "text with NULs or a DOS end-of-file behind it",
    "Read.",
)
def text_tail() -> bytes:
    return TEXT.encode() + b"\x1a" + bytes(100)


@kind(
    "STL",
    "an OBJ file with the ending `.stl`",
    "Read as OBJ: the content decides.",
    filename="a.stl",
)
def other_format() -> bytes:
    return write(BODY, "obj")


@refused(
    "STL",
    "text without facets with the ending `.stl`",
    "Refused by name.",
    filename="a.stl",
    reason="text without facets",
)
def other_text() -> bytes:
    return b"this is a letter to somebody who asked for a mesh; it has none\n" * 20
