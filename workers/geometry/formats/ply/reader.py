"""PLY, as text and binary of either byte order, with polygons and any other properties."""

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.ply.header import Element, Header, Property, read_header
from workers.geometry.formats.ply.rows import binary_list, binary_rows, skip_rows
from workers.geometry.formats.polygons import polygon_mesh, require_faces
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.tokens import Polygons, floats, polygon_lines

SHORTEST_TEXT_ROW = 2  # a digit and the end of the line
NO_POLYGONS = Polygons(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))


def read_ply(data: bytes, limits: MeshLimits) -> Reading:
    """Read a PLY file: elements ``vertex`` (x, y, z) and ``face`` (vertex_indices).

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
    header = read_header(data)
    vertex, face = header.element("vertex"), header.element("face")
    n_vertices, n_faces = (e.count if e else 0 for e in (vertex, face))
    limits.check(vertices=n_vertices, faces=n_faces)
    require_faces(n_vertices, n_faces)
    needed = sum(
        e.count * (e.shortest_row if header.byte_order else SHORTEST_TEXT_ROW)
        for e in header.elements
    )
    check_length(needed - 1, len(data) - header.body, vertices=n_vertices, faces=n_faces)
    reader = _read_binary if header.byte_order else _read_text
    vertices, polygons = reader(data, header)
    return Reading(polygon_mesh(vertices, polygons, limits))


def _indices_of(element: Element) -> Property:
    """Return the list property that holds the corners of the faces."""
    for prop in element.properties:
        if prop.name in ("vertex_indices", "vertex_index") and prop.length_type:
            return prop
    raise InvalidMeshError("PLY's faces have no list 'vertex_indices'")


def _axes(element: Element) -> list[str]:
    """Return the names of the three coordinates, or raise ``InvalidMeshError``."""
    names = [p.name for p in element.properties if p.length_type is None]
    if not {"x", "y", "z"} <= set(names):
        first = [name[:24] for name in names[:8]]
        raise InvalidMeshError(f"PLY's vertices have the properties {first}; expected x, y and z")
    return ["x", "y", "z"]


def _read_binary(data: bytes, header: Header) -> tuple[FloatArray, Polygons]:
    """Vertices and polygons of a binary body."""
    vertices, polygons = np.zeros((0, 3)), NO_POLYGONS
    position = header.body
    for element in header.elements:
        if element.name == "vertex":
            axes = _axes(element)
            rows, position = binary_rows(data, position, element, header.byte_order)
            vertices = np.stack([rows[axis].astype(np.float64) for axis in axes], axis=1)
        elif element.name == "face":
            indices = _indices_of(element)
            polygons, position = binary_list(data, position, element, indices, header.byte_order)
        else:
            position = skip_rows(data, position, element, header.byte_order)
    return vertices, polygons


def _read_text(data: bytes, header: Header) -> tuple[FloatArray, Polygons]:
    """Vertices and polygons of a body in text, one row a line."""
    lines = [s for s in data[header.body :].splitlines() if s and not s.isspace()]
    declared = sum(e.count for e in header.elements)
    if len(lines) < declared:
        raise InvalidMeshError(
            f"the PLY header declares {declared:,} rows, but {len(lines):,} follow: "
            "the file is truncated"
        )
    vertices, polygons = np.zeros((0, 3)), NO_POLYGONS
    start = 0
    for element in header.elements:
        rows = lines[start : start + element.count]
        start += element.count
        if element.name == "vertex":
            vertices = _text_vertices(rows, element)
        elif element.name == "face":
            polygons = _text_polygons(rows, element)
    return vertices, polygons


def _text_vertices(rows: list[bytes], element: Element) -> FloatArray:
    """Positions (n, 3) of rows of scalars."""
    axes = _axes(element)
    names = [p.name for p in element.properties]
    columns = [names.index(axis) for axis in axes]
    if any(p.length_type for p in element.properties[: max(columns)]):
        raise InvalidMeshError("PLY's vertices have a list before x, y and z")
    if not rows:
        return np.zeros((0, 3))
    values = floats(b"\n".join(rows))
    if len(values) == len(names) * len(rows):
        return values.reshape(len(rows), -1)[:, columns]
    picked = []
    for vertex, row in enumerate(rows):
        tokens = row.split()
        if len(tokens) <= max(columns):
            raise InvalidMeshError(f"vertex {vertex} has {len(tokens)} numbers, fewer than x, y, z")
        picked.append(b" ".join(tokens[column] for column in columns))
    return floats(b"\n".join(picked)).reshape(-1, 3)


def _text_polygons(rows: list[bytes], element: Element) -> Polygons:
    """Polygons of rows that hold the indices anywhere."""
    before = element.properties[: element.properties.index(_indices_of(element))]
    if not before:
        return polygon_lines(rows)
    cut = []
    for face, row in enumerate(rows):
        tokens = row.split()
        position = 0
        for prop in before:
            length = tokens[position : position + 1] if prop.length_type else [b"0"]
            if not (length and length[0].isdigit() and len(length[0]) < 10):
                raise InvalidMeshError(f"face {face} of the PLY file cannot be read")
            position += 1 + int(length[0])
        if position >= len(tokens):
            raise InvalidMeshError(f"face {face} of the PLY file has no vertex indices")
        cut.append(b" ".join(tokens[position:]))
    return polygon_lines(cut)
