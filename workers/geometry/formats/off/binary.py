"""Binary OFF of either byte order, as Geomview and as the PMP library write it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.off.keyword import SPACE, Layout
from workers.geometry.formats.off.rows import LEFT, Body
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.rows.tables import Element, Property
from workers.geometry.formats.rows.walking import read_rows

INTEGER = 4  # bytes
COUNTS = ("vertices", "faces", "edges")
BYTE_ORDERS = (">", "<")
CORNERS = Property("corners", "i4", "i4")
COLOURS = Property("colours", "i4", "i4")  # as bits: nothing reads them


@dataclass(frozen=True)
class _Head:
    """Counts as read in one byte order, and where the vertices begin."""

    byte_order: str
    dimension: int
    vertices: int
    faces: int
    begin: int


def read_binary_body(data: bytes, begin: int, layout: Layout, limits: MeshLimits) -> Body:
    """Read what follows after the line ``OFF BINARY``.

    Geomview writes big-endian float32, and after each face the numbers of its colour. The PMP
    library writes the byte order and precision of the computer, and no colours. The header does
    not tell them apart: taken is what makes sense down to the last byte.

    Parameters
    ----------
    data : bytes
        The whole file.
    begin : int
        Where the counts stand, in bytes.
    layout : Layout
        What stands for each vertex.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Body
        Of the first way to read it that leaves no byte, or, if there is none, of the first.

    Raises
    ------
    InvalidMeshError
        No way makes sense.
    UploadTooLargeError
        More vertices or faces than the limits allow.
    """
    with_rest: list[Body] = []
    heads = [_head(data, begin, layout, order) for order in BYTE_ORDERS]
    for head in heads:
        for body, end in _ways(data, head, layout, limits):
            if end == len(data):
                return body
            with_rest.append(body)
    if with_rest:
        return replace(with_rest[0], repairs=(*with_rest[0].repairs, LEFT))
    likely = min(heads, key=lambda head: abs(head.vertices) + abs(head.faces))
    raise InvalidMeshError(
        f"the binary OFF file declares {likely.vertices:,} vertices and {likely.faces:,} faces, "
        "but what follows makes no such rows: it is truncated or damaged"
    )


def _head(data: bytes, begin: int, layout: Layout, byte_order: str) -> _Head:
    """Read the counts in one byte order."""
    n_numbers = len(COUNTS) + layout.has_dimension
    if begin + n_numbers * INTEGER > len(data):
        raise InvalidMeshError("the binary OFF file ends before its counts: it is truncated")
    counts = np.frombuffer(data, byte_order + "i4", n_numbers, begin).tolist()
    dimension = counts.pop(0) if layout.has_dimension else SPACE
    return _Head(byte_order, dimension, counts[0], counts[1], begin + n_numbers * INTEGER)


def _ways(
    data: bytes, head: _Head, layout: Layout, limits: MeshLimits
) -> Iterator[tuple[Body, int]]:
    """Ways to read the body in which all corners are vertices, and where each ends."""
    if min(head.vertices, head.faces) < 0 or head.dimension != SPACE:
        return
    for real, width, coloured in product(("f4", "f8"), layout.widths, (True, False)):
        numbers = tuple(Property("", real) for _ in range(width))
        faces = Element("face", head.faces, (CORNERS, COLOURS) if coloured else (CORNERS,))
        points = Element("vertex", head.vertices, numbers)
        shortest = head.vertices * points.shortest_row + head.faces * faces.shortest_row
        if head.begin + shortest > len(data):
            continue
        limits.check(vertices=head.vertices, faces=head.faces)
        try:
            rows = read_rows(data, head.begin, points, head.byte_order)
            face_rows = read_rows(data, rows.end, faces, head.byte_order)
            polygons = face_rows.lists(0)
        except InvalidMeshError:
            continue
        axes = [as_floats(rows.numbers(i)) for i in range(layout.n_coordinates)]
        has_colours = coloured and bool(face_rows.lists(1).counts.any())
        found = ("face colours",) if has_colours else ()
        body = Body(np.stack(axes, axis=1), polygons, (), found)
        if body.in_range and (polygons.counts > 0).all():  # 0: a number of colours, no face
            yield body, face_rows.end
