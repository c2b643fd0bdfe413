"""From the statements of an OBJ file to a mesh."""

import re
from dataclasses import replace

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.obj.plain import read_plain
from workers.geometry.formats.obj.statements import (
    Others,
    Statements,
    read_others,
    read_statements,
)
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.polygons import polygon_mesh, require_corners, require_faces
from workers.geometry.formats.text.numerals import with_decimal_points
from workers.geometry.formats.text.tokens import Polygons, floats, integers

TEXTURE_AND_NORMAL = re.compile(rb"[/\\][^ \t\n]*")
COLOURED = 6  # numbers of a vertex x y z r g b; a seventh is a weight or transparency
FEWEST_FACES = 4  # a shape has no fewer; so many agree on where they count from


def read_obj(data: bytes, limits: MeshLimits) -> Reading:
    """Read an OBJ file: polygons, ``v/vt/vn`` corners, relative indices, colours.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Vertices in the order of the file, polygons cut into triangles.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    UnsupportedFormatError
        Nothing but free-form surfaces.
    """
    plain = read_plain(data.rstrip(b"\0\x1a"))
    if plain is None:
        return _read_any(data, limits)
    limits.check(vertices=len(plain.vertices), faces=len(plain.polygons.counts))
    is_coloured = plain.width >= COLOURED
    return _reading(
        plain.vertices, plain.polygons, read_others(plain.others), limits, is_coloured=is_coloured
    )


def _read_any(data: bytes, limits: MeshLimits) -> Reading:
    """Read a file with lines that are not plain."""
    statements = read_statements(data)
    limits.check(vertices=len(statements.vertices), faces=len(statements.faces))
    _require_polygons(statements)
    vertices, is_coloured, commas = _vertices(statements.vertices)
    polygons = _polygons(statements.faces)
    if (polygons.corners < 0).any():
        polygons = _absolute(polygons, statements.is_vertex)
    reading = _reading(vertices, polygons, statements.others, limits, is_coloured=is_coloured)
    return replace(reading, repairs=commas + reading.repairs)


def _reading(
    vertices: FloatArray,
    polygons: Polygons,
    others: Others,
    limits: MeshLimits,
    *,
    is_coloured: bool,
) -> Reading:
    """Mesh of polygons whose corners are as in the file, and what is to be said."""
    first, zero = _first_index(polygons, len(vertices))
    polygons = Polygons(polygons.counts, polygons.corners - first)
    require_corners(polygons, len(vertices), first=first)
    mesh = polygon_mesh(vertices, polygons, limits)
    colours = ("vertex colours",) if is_coloured else ()
    return Reading(mesh, repairs=zero + _left_out(polygons), found=others.found() + colours)


def _require_polygons(statements: Statements) -> None:
    """Raise an error that says what a file without faces has instead."""
    if statements.faces:
        return
    if statements.others.count("surf"):
        raise UnsupportedFormatError(
            "the OBJ file holds free-form surfaces but no polygons; expected polygons: "
            "export it as a mesh"
        )
    if n_lines := statements.others.count("l", "curv", "curv2"):
        raise InvalidMeshError(
            f"the file has lines but no faces ({n_lines:,} lines); expected a surface"
        )
    require_faces(len(statements.vertices), 0)


def _vertices(lines: list[bytes]) -> tuple[FloatArray, bool, tuple[str, ...]]:
    """Positions (n, 3) of bodies ``x y z [w | r g b]``, if there are colours, and repairs."""
    text, repairs = with_decimal_points(b"\n".join(lines))
    if repairs:
        lines = text.split(b"\n")
    width = len(lines[0].split()) if lines else 3
    values = floats(text)
    if width >= 3 and len(values) == width * len(lines):
        return values.reshape(-1, width)[:, :3], width >= COLOURED, repairs
    rows = [line.split()[:3] for line in lines]
    for vertex, row in enumerate(rows, start=1):
        if len(row) < 3:
            raise InvalidMeshError(f"vertex {vertex} has {len(row)} coordinates; expected 3")
    positions = floats(b"\n".join(b" ".join(row) for row in rows)).reshape(-1, 3)
    return positions, len(values) >= COLOURED * len(lines) / 2, repairs


def _polygons(lines: list[bytes]) -> Polygons:
    """Polygons of bodies ``v[/vt[/vn]] …``; corners as in the file, from 1 or negative."""
    text = b"\n".join(lines)
    if b"," in text:
        text = text.replace(b",", b" ")
        lines = text.split(b"\n")
    if b"/" in text or b"\\" in text:
        text = TEXTURE_AND_NORMAL.sub(b"", text)
    counts = np.array([len(line.split()) for line in lines], dtype=np.int64)
    corners = integers(text)
    if len(corners) != counts.sum():
        raise InvalidMeshError("a face has a corner without a vertex index")
    return Polygons(counts, corners)


def _absolute(polygons: Polygons, is_vertex: list[bool]) -> Polygons:
    """Replace relative indices (-1 is the last vertex before the face) by those from 1."""
    flags = np.array(is_vertex)
    seen = np.cumsum(flags)[~flags]  # (p,): vertices before each face
    before = np.repeat(seen, polygons.counts)  # (corners,)
    corners = np.where(polygons.corners < 0, before + polygons.corners + 1, polygons.corners)
    return Polygons(polygons.counts, corners)


def _first_index(polygons: Polygons, n_vertices: int) -> tuple[int, tuple[str, ...]]:
    """Number of the first vertex, 1 by the format, and what is to be said if it is 0."""
    corners = polygons.corners
    counts_from_0 = (
        len(polygons.counts) >= FEWEST_FACES
        and corners.size > 0
        and corners.min() == 0
        and corners.max() == n_vertices - 1
    )
    if counts_from_0:
        return 0, ("the faces count vertices from 0, not from 1 as in OBJ; read so",)
    return 1, ()


def _left_out(polygons: Polygons) -> tuple[str, ...]:
    """Say how many faces have too few corners."""
    count = int((polygons.counts < 3).sum())
    noun = "face" if count == 1 else "faces"
    return (f"left out {count:,} {noun} of fewer than 3 corners",) if count else ()
