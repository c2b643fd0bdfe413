"""Kinds of VTK files."""

import struct

import numpy as np

from tests.formats.kinds import BODY, Facts, kind, refused
from tests.formats.vtk_builders import (
    TETRAHEDRA,
    WITH_MIDDLE,
    Xml,
    binary,
    binary_body,
    block,
    counted,
    points,
    polygons,
    rows,
    text,
)

VTK, XML = "VTK", "VTP, VTU, VTS"
N, M = BODY.n_vertices, BODY.n_faces
POLYDATA = "DATASET POLYDATA\n"
CUBE = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1)
BOX = np.transpose(CUBE, (2, 1, 0, 3)).reshape(-1, 3)  # the first axis runs fastest
THE_BOX = Facts(area=54.0, vertices=56)
GRID = np.column_stack([np.tile(np.arange(5), 4), np.repeat(np.arange(4), 5), np.zeros(20)])
THE_GRID = Facts(area=12.0, vertices=20, loops=1)


@kind(VTK, "polygons in text", "Read.")
def plain() -> bytes:
    return text(POLYDATA + points(), polygons())


@kind(VTK, "polygons in binary, as float or double", "Read; the numbers are big-endian.")
def in_binary() -> bytes:
    return binary_body()


@kind(VTK, "binary without a line end after a block", "Read.")
def without_line_ends() -> bytes:
    return binary_body(type="double", end="")


@kind(
    VTK,
    "binary with little-endian numbers",
    "Read, though the format asks for big-endian ones.",
    repairs=("little-endian",),
)
def little_endian() -> bytes:
    return binary_body(order="<")


@kind(VTK, "CR LF line ends, lower case, blank lines, no title", "Read.")
def other_manners() -> bytes:
    file = text("\n" + POLYDATA + "\n" + points(type="float"), polygons(), title="", end="\r\n")
    return file.replace(b"POLY", b"poly").replace(b"POINTS", b"points").replace(b"ASCII", b"ascii")


@kind(VTK, "old Mac line ends, comments in the body", "Read.")
def carriage_returns() -> bytes:
    return text(POLYDATA + "# a comment\n" + points(), "# another\n" + polygons(), end="\r")


@kind(VTK, "all numbers of a block on one line, behind its keyword", "Read.")
def on_one_line() -> bytes:
    sections = points().replace("\n", " "), polygons().replace("\n", " ")
    return text(POLYDATA + sections[0], sections[1])


@kind(
    VTK,
    "values on points and cells, FIELD and METADATA blocks",
    "Read; the values are left alone and named.",
    found=("point data", "cell data"),
)
def with_values() -> bytes:
    return text(
        "FIELD FieldData 1\nTimeValue 1 1 double\n0.5\n" + POLYDATA + points(),
        "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n",
        polygons(),
        f"CELL_DATA {M}\nSCALARS a float 1\nLOOKUP_TABLE default\n" + "0 1 2 3\n" * (M // 4),
        f"POINT_DATA {N}\nFIELD FieldData 1\nthickness 1 {N} float\n" + "1.5\n" * N,
    )


@kind(
    VTK,
    "binary with METADATA, FIELD and values",
    "Read; the values are left alone and named.",
    found=("point data",),
)
def binary_with_values() -> bytes:
    metadata = b"METADATA\nINFORMATION 0\n\n"
    return binary(
        b"FIELD FieldData 1\n" + block("TimeValue 1 1 double", [0.5], "double"),
        block(f"POINTS {N} double", BODY.vertices, "double") + metadata,
        block(f"POLYGONS {M} {4 * M}", counted(BODY.faces), "int"),
        block(f"\nPOINT_DATA {N}\nSCALARS a float\nLOOKUP_TABLE default", np.zeros(N), "float"),
    )


@kind(VTK, "version 5.1 with OFFSETS and CONNECTIVITY, text", "Read.")
def version_5_text() -> bytes:
    offsets = rows(np.arange(M + 1) * 3)
    return text(
        POLYDATA + points(),
        f"POLYGONS {M + 1} {3 * M}\nOFFSETS vtktypeint64\n{offsets}",
        f"CONNECTIVITY vtktypeint64\n{rows(BODY.faces)}",
        version="5.1",
    )


@kind(VTK, "version 5.1 with OFFSETS and CONNECTIVITY, binary", "Read.")
def version_5_binary() -> bytes:
    return binary(
        block(f"POINTS {N} float", BODY.vertices, "float"),
        block(
            f"POLYGONS {M + 1} {3 * M}\nOFFSETS vtktypeint64", np.arange(M + 1) * 3, "vtktypeint64"
        ),
        block("CONNECTIVITY vtktypeint64", BODY.faces, "vtktypeint64"),
        version="5.1",
    )


@kind(
    VTK,
    "vertices, lines and triangle strips beside polygons",
    "Strips are cut into triangles; points and lines are left out and named.",
    found=("points and lines",),
)
def strips() -> bytes:
    half = M // 2
    return text(
        POLYDATA + points(),
        "VERTICES 1 2\n1 0\n",
        "LINES 1 3\n2 0 1\n",
        polygons(BODY.faces[:half]),
        polygons(BODY.faces[half:], "TRIANGLE_STRIPS"),
    )


@kind(VTK, "a long triangle strip", "Cut into triangles of one winding.", facts=THE_GRID)
def long_strip() -> bytes:
    strips = [[5 * row + 5 * side + x for x in range(5) for side in (0, 1)] for row in range(3)]
    return text(POLYDATA + points(GRID), polygons(strips, "TRIANGLE_STRIPS"))


@kind(
    VTK,
    "counts that are one off",
    "All points and polygons of the file are read.",
    repairs=("declares 641 points, but has 642", "declares 1,281 cells, but has 1,280"),
)
def wrong_counts() -> bytes:
    file = text(POLYDATA + points(), polygons())
    return file.replace(b"POINTS 642", b"POINTS 641").replace(b"POLYGONS 1280", b"POLYGONS 1281")


@kind(
    VTK,
    "a wrong size of the list of polygons",
    "The polygons decide.",
    repairs=("take 5,120 numbers, but the file declares 5,000",),
)
def wrong_size() -> bytes:
    return binary_body().replace(b" 5120", b" 5000")


@kind(VTK, "cells: triangles", "Read.")
def cells() -> bytes:
    types = "5\n" * M
    return text(
        "DATASET UNSTRUCTURED_GRID\n" + points(), polygons(name="CELLS"), f"CELL_TYPES {M}\n{types}"
    )


@kind(
    VTK,
    "cells: tetrahedra",
    "The boundary surface of the volume is read: faces that one cell alone has.",
    found=("1,280 volume cells",),
)
def tetrahedra() -> bytes:
    return binary(
        block(f"POINTS {N + 1} double", WITH_MIDDLE, "double"),
        block(f"CELLS {M} {5 * M}", counted(TETRAHEDRA), "int"),
        block(f"CELL_TYPES {M}", np.full(M, 10), "int"),
        dataset="UNSTRUCTURED_GRID",
    )


@kind(
    VTK,
    "cells: tetrahedra and the triangles around them",
    "Each face of the boundary is read once.",
    found=("1,280 faces that are also faces of the volume cells",),
)
def tetrahedra_with_faces() -> bytes:
    types = f"CELL_TYPES {2 * M}\n" + "10\n" * M + "5\n" * M
    both = f"CELLS {2 * M} {9 * M}\n" + rows(counted(TETRAHEDRA)) + rows(counted(BODY.faces))
    return text("DATASET UNSTRUCTURED_GRID\n" + points(WITH_MIDDLE), both, types)


@kind(
    VTK,
    "structured grid, one point thick",
    "Read as quads between neighbours.",
    facts=THE_GRID,
)
def structured() -> bytes:
    return text("DATASET STRUCTURED_GRID\nDIMENSIONS 5 4 1\n" + points(GRID))


@kind(
    VTK,
    "structured grid of a volume",
    "The boundary surface is read.",
    facts=THE_BOX,
    found=("27 volume cells",),
)
def structured_volume() -> bytes:
    return text("DATASET STRUCTURED_GRID\nDIMENSIONS 4 4 4\n" + points(BOX))


@kind(VTK, "numbers that are none, in points that nothing uses", "Read; the points are left out.")
def not_finite() -> bytes:
    strays = "nan -inf 1e999\nInfinity -nan +NAN\n"
    return text(POLYDATA + points().replace("642", "644") + strays, polygons())


@refused(
    VTK,
    "images and regular grids",
    "Refused: they hold no surface. Extract one in ParaView.",
    reason="extract a surface",
)
def image() -> bytes:
    return text("DATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n")


@refused(VTK, "lines alone", "Refused: there are no faces.", reason="points but no faces")
def lines_alone() -> bytes:
    return text(POLYDATA + points(), "LINES 1 3\n2 0 1\n")


@refused(VTK, "a file that ends early", "Refused.", reason="it is truncated")
def truncated() -> bytes:
    return binary_body()[:-4000]


@refused(VTK, "a text that ends early", "Refused.", reason="it is truncated")
def truncated_text() -> bytes:
    return plain()[:-4000].rpartition(b"\n")[0]


for _format in ("ascii", "binary", "appended"):

    @kind(XML, f"polygons, {_format} arrays", "Read.")
    def xml(format: str = _format) -> bytes:
        return Xml(format).body()


@kind(XML, "arrays appended as base64, 64 bit sizes", "Read.")
def appended_base64() -> bytes:
    return Xml("appended", appended="base64", header="UInt64").body()


@kind(XML, "appended, packed by zlib, big-endian", "Read.")
def appended_zlib() -> bytes:
    return Xml("appended", compressor="vtkZLibDataCompressor", order=">").body()


@kind(XML, "base64 arrays packed by zlib", "Read.")
def inline_zlib() -> bytes:
    return Xml("binary", compressor="vtkZLibDataCompressor", header="UInt64").body()


@kind(XML, "arrays packed by LZMA", "Read.")
def inline_lzma() -> bytes:
    return Xml("appended", compressor="vtkLZMADataCompressor", appended="base64").body()


@kind(
    XML,
    "several pieces, strips, lines, and values on points",
    "Pieces are joined; lines are left out; values are named.",
    found=("2 pieces", "point data", "points and lines"),
)
def pieces() -> bytes:
    half = M // 2
    one = Xml()
    values = f'<PointData Scalars="a">{one.array("a", np.zeros(N))}</PointData>'
    return one.file(
        "PolyData",
        one.piece(values, one.points(), one.polys(BODY.faces[:half], "Strips")),
        one.piece(one.points(), one.polys([[0, 1]], "Lines"), one.polys(BODY.faces[half:])),
    )


@kind(
    XML,
    "VTU: tetrahedra",
    "The boundary surface of the volume is read.",
    found=("1,280 volume cells",),
)
def unstructured() -> bytes:
    one = Xml("binary")
    types = one.array("types", np.full(M, 10), "UInt8")
    cells = one.polys(TETRAHEDRA, "Cells").replace("</Cells>", types + "</Cells>")
    piece = one.piece(one.points(WITH_MIDDLE), cells, n_points=N + 1)
    return one.file("UnstructuredGrid", piece)


@kind(XML, "VTS: structured grid", "Read as quads between neighbours.", facts=THE_GRID)
def structured_xml() -> bytes:
    one = Xml()
    piece = one.piece(one.points(GRID), n_points=20).replace(
        "<Piece", '<Piece Extent="0 4 0 3 0 0"'
    )
    return one.file("StructuredGrid", piece)


@refused(
    XML,
    "packed by LZ4",
    "Refused: save it with ZLib compression or without.",
    reason="vtkLZ4DataCompressor".lower(),
)
def lz4() -> bytes:
    file = Xml("binary", compressor="vtkZLibDataCompressor").body()
    return file.replace(b"vtkZLib", b"vtkLZ4")


@refused(XML, "VTI and VTR: images", "Refused: they hold no surface.", reason="extract a surface")
def image_xml() -> bytes:
    return Xml().file("ImageData", "<Piece/>")


@refused(
    XML,
    "VTM, PVTP and PVD: lists of other files",
    "Refused: upload the files they list.",
    reason="only lists other files",
)
def collection() -> bytes:
    return Xml().file("vtkMultiBlockDataSet", '<DataSet index="0" file="a.vtp"/>')


@refused(XML, "a document type", "Refused.", reason="document type")
def document_type() -> bytes:
    declared = b'<!DOCTYPE VTKFile [<!ENTITY a "b">]>\n<VTKFile'
    return Xml().body().replace(b"<VTKFile", declared, 1)


@refused(
    XML,
    "an array that unpacks to more than its size",
    "Refused.",
    reason="unpacks to more bytes; expected 16",
)
def bomb() -> bytes:
    file = Xml("appended", compressor="vtkZLibDataCompressor", block=1 << 20).body()
    return file.replace(struct.pack("<I", 24 * N), struct.pack("<I", 16), 1)
