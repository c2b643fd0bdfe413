"""PLY, as text and binary of either byte order, with polygons, strips and any other properties."""

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, frozen
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.ply.bodies import read_binary, read_text
from workers.geometry.formats.ply.header import Header, read_header
from workers.geometry.formats.ply.names import axes_of, corners_of, holds_splats, what_else
from workers.geometry.formats.ply.strips import cut_strips
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.rows.tables import Rows
from workers.geometry.formats.surfaces.polygons import points_and_lines, polygon_mesh, require_faces
from workers.geometry.formats.text.tokens import Polygons

SHORTEST_TEXT_ROW = 2  # a digit and the end of the line
NEEDED = ("vertex", "face", "tristrips")


def read_ply(data: bytes, limits: MeshLimits) -> Reading:
    """Read a PLY file: elements ``vertex`` (x, y, z), ``face`` and ``tristrips`` (vertex_indices).

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Vertices in the order of the file, polygons and strips cut into triangles.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    header = read_header(data)
    _check(data, header, limits)
    n_elements = 1 + max(i for i, e in enumerate(header.elements) if e.name in NEEDED)
    read = read_binary if header.byte_order else read_text
    tables, repairs = read(data, header, n_elements)
    vertices = _vertices(tables, header)
    polygons = _polygons(tables, header, len(vertices))
    return Reading(
        polygon_mesh(vertices, polygons, limits),
        (*header.repairs, *repairs, *points_and_lines(polygons)),
        what_else(header.elements, header.comments),
    )


def _check(data: bytes, header: Header, limits: MeshLimits) -> None:
    """Hold what the header declares against the limits and the bytes that follow."""
    n_vertices, n_faces, n_strips = (header.count(name) for name in NEEDED)
    limits.check(vertices=n_vertices, faces=n_faces)
    if n_faces + n_strips == 0:
        _refuse_points(header)
    needed = sum(
        e.count * (e.shortest_row if header.byte_order else SHORTEST_TEXT_ROW)
        for e in header.elements
        if header.byte_order or e.name in NEEDED
    )
    available = len(data) - header.body
    if not header.byte_order:
        needed -= 1  # the last line's end may be missing
    check_length(needed, available, vertices=n_vertices, faces=n_faces)


def _refuse_points(header: Header) -> None:
    """Raise ``InvalidMeshError`` naming what a file without faces holds."""
    n_vertices = header.count("vertex")
    if header.count("range_grid"):
        raise InvalidMeshError(
            "the file holds a range grid, the depths that a scanner measured, and no faces; "
            "expected a surface: make triangles of it first, for example with MeshLab"
        )
    if holds_splats(header.elements):
        raise InvalidMeshError(
            f"the file holds {n_vertices:,} Gaussian splats and no faces; expected a surface: "
            "export a mesh from the program that made them"
        )
    require_faces(n_vertices, 0)


def _vertices(tables: list[Rows], header: Header) -> FloatArray:
    """Positions (n, 3)."""
    for rows, element in zip(tables, header.elements, strict=False):
        if element.name == "vertex":
            axes = axes_of(element)
            vertices = np.empty((element.count, 3))
            with np.errstate(invalid="ignore"):  # a signalling NaN becomes a plain one
                for i, axis in enumerate(axes):
                    vertices[:, i] = rows.numbers(axis)
            return frozen(vertices)
    return np.zeros((0, 3))


def _polygons(tables: list[Rows], header: Header, n_vertices: int) -> Polygons:
    """Faces, and triangles of strips, in the order of the file."""
    found: list[Polygons] = []
    for rows, element in zip(tables, header.elements, strict=False):
        if element.name == "face" and element.count:
            found.append(rows.lists(corners_of(element)))
        elif element.name == "tristrips":
            found.append(cut_strips(rows.lists(corners_of(element)), n_vertices))
    if len(found) == 1:
        return found[0]
    return Polygons(
        np.concatenate([polygons.counts for polygons in found]),
        np.concatenate([polygons.corners for polygons in found]),
    )
