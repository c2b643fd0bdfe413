"""Kinds of FreeSurfer files."""

import struct

import numpy as np

from tests.formats.kinds import BODY, Facts, kind, refused

FORMAT = "FreeSurfer"
N, M = BODY.n_vertices, BODY.n_faces
GRID = np.array([[x, y, 0] for y in range(4) for x in range(5)])
QUADS = np.array([[5 * y + x + d for d in (0, 1, 6, 5)] for y in range(3) for x in range(4)])
THE_GRID = Facts(area=12.0, vertices=20, loops=1)
VOLUME = b"valid = 1  # volume info valid\nfilename = T1.mgz\nvolume = 256 256 256\n"


def triangles(comment: bytes = b"created by somebody on a day\n\n", footer: bytes = b"") -> bytes:
    """The body behind a comment."""
    numbers = BODY.vertices.astype(">f4").tobytes() + BODY.faces.astype(">i4").tobytes()
    return b"\xff\xff\xfe" + comment + struct.pack(">ii", N, M) + numbers + footer


def three_bytes(values: object) -> bytes:
    """Whole numbers of three bytes."""
    whole = np.asarray(values, dtype=">u4").ravel()
    return whole.view(np.uint8).reshape(-1, 4)[:, 1:].tobytes()


def quads(magic: bytes, type: str, scale: float) -> bytes:
    """A grid of quads."""
    points = np.round(GRID * scale).astype(type).tobytes()
    return magic + three_bytes([20, 12]) + points + three_bytes(QUADS)


@kind(FORMAT, "surface (lh.pial, rh.white)", "Read; the name may have no ending at all.")
def surface() -> bytes:
    return triangles()


@kind(
    FORMAT,
    "surface with the geometry of the scan behind",
    "Read; coordinates stay as they are in the file.",
    found=("geometry of the scan",),
)
def with_footer() -> bytes:
    return triangles(footer=struct.pack(">iii", 2, 0, 20) + VOLUME)


@kind(FORMAT, "surface with one line of comment, without the empty line", "Read.")
def one_line() -> bytes:
    return triangles(b"made by a program\n")


@kind(FORMAT, "surface with two lines of comment", "Read.")
def two_lines() -> bytes:
    return triangles(b"created by somebody\non Friday\n")


@kind(FORMAT, "surface without a comment", "Read.")
def no_comment() -> bytes:
    return triangles(b"\n\n")


@kind(
    FORMAT,
    "quads of old versions, as hundredths",
    "Cut in two as FreeSurfer does.",
    facts=THE_GRID,
    found=("12 quads",),
)
def old_quads() -> bytes:
    return quads(b"\xff\xff\xff", ">i2", 100)


@kind(FORMAT, "quads of old versions, as floats", "Cut in two.", facts=THE_GRID)
def float_quads() -> bytes:
    return quads(b"\xff\xff\xfd", ">f4", 1)


def rows(values: object) -> str:
    """Each row on a line, with a 0 behind."""
    table = np.asarray(values).tolist()
    return "".join(" ".join(str(value) for value in row) + " 0\n" for row in table)


@kind(FORMAT, "surface in text (.asc, .srf)", "Read.", filename="lh.pial.asc")
def text() -> bytes:
    head = f"#!ascii version of lh.pial\n{N} {M}\n"
    return (head + rows(BODY.vertices) + rows(BODY.faces)).encode()


@kind(FORMAT, "surface in text without its first line", "Read by its ending.", filename="lh.srf")
def text_without_comment() -> bytes:
    return text().partition(b"\n")[2].replace(b"\n", b"\r\n")


NO_SURFACE = "Refused: it holds no triangles. Upload the surface it belongs to."


@refused(FORMAT, "values on vertices (curv, sulc, thickness)", NO_SURFACE, reason="values")
def curvature() -> bytes:
    return b"\xff\xff\xff" + struct.pack(">iii", N, M, 1) + np.zeros(N, ">f4").tobytes()


@refused(FORMAT, "patch", NO_SURFACE, reason="a FreeSurfer patch")
def patch() -> bytes:
    row = np.array([(1, 0.0, 0.0, 0.0)] * 9, dtype=">i4, >f4, >f4, >f4")
    return struct.pack(">ii", -1, 9) + row.tobytes()


@refused(FORMAT, "label", NO_SURFACE, reason="a FreeSurfer label", filename="lh.V1.label")
def label() -> bytes:
    return b"#!ascii label  , from subject bert vox2ras=TkReg\n1\n7 -1.0 2.0 3.0 0.0\n"


@refused(FORMAT, "annotation", NO_SURFACE, reason="a FreeSurfer annotation", filename="lh.annot")
def annotation() -> bytes:
    pairs = np.column_stack([np.arange(N), np.full(N, 255)])
    return struct.pack(">i", N) + pairs.astype(">i4").tobytes() + struct.pack(">i", 0)


@refused(
    FORMAT,
    "MGH image",
    "Refused: a volume without a surface. Extract one in 3D Slicer or FreeSurfer.",
    reason="an MGH image",
    filename="brain.mgh",
)
def image() -> bytes:
    return struct.pack(">7i", 1, 4, 4, 4, 1, 3, 1).ljust(284, b"\0") + bytes(256)


@refused(FORMAT, "a file that ends early", "Refused.", reason="it is truncated")
def truncated() -> bytes:
    return triangles()[:-99]
