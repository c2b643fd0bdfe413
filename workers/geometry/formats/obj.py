"""Wavefront OBJ: the ``v`` and ``f`` lines; everything else is left out."""

import re

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.polygons import polygon_mesh, require_faces, require_indices
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.tokens import Polygons, floats, integers

ELEMENT = re.compile(rb"^[ \t]*([vf])[ \t]+([^\r\n#]*)", re.MULTILINE)
CONTINUATION = re.compile(rb"\\[ \t]*\r?\n")
TEXTURE_AND_NORMAL = re.compile(rb"/[^ \t\n]*")


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
    """
    text = CONTINUATION.sub(b" ", data) if b"\\" in data else data
    if b"\r" in text and b"\n" not in text:
        text = text.replace(b"\r", b"\n")
    elements = ELEMENT.findall(text)
    vertex_lines = [body for kind, body in elements if kind == b"v"]
    face_lines = [body for kind, body in elements if kind == b"f"]
    limits.check(vertices=len(vertex_lines), faces=len(face_lines))
    require_faces(len(vertex_lines), len(face_lines))
    vertices = _vertices(vertex_lines)
    polygons = _polygons(face_lines)
    if (polygons.corners < 0).any():
        polygons = _absolute(polygons, [kind == b"v" for kind, _ in elements])
    of_corners = np.repeat(np.arange(len(face_lines)), polygons.counts)
    require_indices(polygons.corners - 1, of_corners, len(vertices), first=1)
    return Reading(polygon_mesh(vertices, Polygons(polygons.counts, polygons.corners - 1), limits))


def _vertices(lines: list[bytes]) -> FloatArray:
    """Positions (n, 3) of bodies ``x y z [w | r g b]``."""
    width = len(lines[0].split()) if lines else 3
    values = floats(b"\n".join(lines))
    if width >= 3 and len(values) == width * len(lines):
        return values.reshape(-1, width)[:, :3]
    rows = [line.split()[:3] for line in lines]
    for vertex, row in enumerate(rows, start=1):
        if len(row) < 3:
            raise InvalidMeshError(f"vertex {vertex} has {len(row)} coordinates; expected 3")
    return floats(b"\n".join(b" ".join(row) for row in rows)).reshape(-1, 3)


def _polygons(lines: list[bytes]) -> Polygons:
    """Polygons of bodies ``v[/vt[/vn]] …``; corners as in the file, from 1 or negative."""
    text = b"\n".join(lines)
    if b"/" in text:
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
