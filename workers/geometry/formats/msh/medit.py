"""Medit's MESH in text, as Mmg, Gmsh and TetGen write it."""

import re

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.cells import (
    HEXAHEDRON,
    PYRAMID,
    QUAD,
    TETRAHEDRON,
    TRIANGLE,
    WEDGE,
    Cells,
    cells_of_one_type,
    join_cells,
    surface_of_cells,
)
from workers.geometry.formats.text.tokens import Polygons, floats, integers, quoted

COMMENT = re.compile(rb"#[^\r\n]*")
START = re.compile(rb"\s*+(?:#[^\r\n]*+\s*+)*+MeshVersionFormatted\b", re.IGNORECASE)
KEYWORD = re.compile(rb"(?<!\S)(?!nan|inf)[A-Z]\w*", re.IGNORECASE)
CELLS = {
    **{"triangles": (TRIANGLE, 3, 3), "quadrilaterals": (QUAD, 4, 4), "quads": (QUAD, 4, 4)},
    **{"tetrahedra": (TETRAHEDRON, 4, 4), "hexahedra": (HEXAHEDRON, 8, 8)},
    **{"hexaedra": (HEXAHEDRON, 8, 8), "prisms": (WEDGE, 6, 6), "pyramids": (PYRAMID, 5, 5)},
    **{"trianglesp2": (TRIANGLE, 6, 3), "tetrahedrap2": (TETRAHEDRON, 10, 4)},
}
"""VTK's type, how many nodes a row has, and how many of them are corners."""


def is_medit(data: bytes) -> bool:
    """Whether the text begins as Medit's meshes do.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        False for the binary format.
    """
    return START.match(data[:4096]) is not None


def read_medit(data: bytes, limits: MeshLimits) -> Reading:
    """Read a mesh of Medit.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        All vertices, triangles and quads, and the boundary of volume elements.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    sections = _sections(COMMENT.sub(b"", data) if b"#" in data else data)
    dimension = _count(sections.get("dimension", b"3"), "dimension")
    if dimension not in (2, 3):
        raise InvalidMeshError(f"the mesh has {dimension} dimensions; expected 2 or 3")
    vertices = _vertices(sections.get("vertices", b"0"), dimension, limits)
    cells = [_cells(text, name, limits) for name, text in sections.items() if name in CELLS]
    joined = join_cells(cells)
    corners = Polygons(joined.corners.counts, joined.corners.corners - 1)
    surface = surface_of_cells(vertices, Cells(joined.types, corners), limits)
    return Reading(surface.mesh, (), surface.found)


def _sections(text: bytes) -> dict[str, bytes]:
    """What follows each keyword, by its name in lower case; the first of each name."""
    sections: dict[str, bytes] = {}
    name, begin = "", 0
    for found in KEYWORD.finditer(text):
        if name in CELLS or name in ("dimension", "vertices"):
            sections.setdefault(name, text[begin : found.start()])
        name, begin = found[0].lower().decode(), found.end()
    sections.setdefault(name, text[begin:])
    return sections


def _count(text: bytes, noun: str) -> int:
    """First number of a section."""
    words = text.split(None, 1)
    if not (words and words[0].isdigit() and len(words[0]) <= 15):
        raise InvalidMeshError(
            f"expected a number after {noun}, found {quoted(words[0] if words else b'')}"
        )
    return int(words[0])


def _vertices(text: bytes, dimension: int, limits: MeshLimits) -> FloatArray:
    """Positions (n, 3); each row has a reference behind."""
    declared = _count(text, "Vertices")
    limits.check(vertices=declared)
    values = floats(text)[1:]
    _require(declared, dimension + 1, len(values), "vertices")
    table = values[: declared * (dimension + 1)].reshape(declared, dimension + 1)[:, :dimension]
    return np.pad(table, ((0, 0), (0, 3 - dimension)))


def _cells(text: bytes, name: str, limits: MeshLimits) -> Cells:
    """Cells of one section; vertices count from 1, each row has a reference behind."""
    cell_type, n_nodes, n_corners = CELLS[name]
    declared = _count(text, name)
    limits.check(faces=declared)
    values = integers(text)[1:]
    _require(declared, n_nodes + 1, len(values), name)
    table = values[: declared * (n_nodes + 1)].reshape(declared, n_nodes + 1)
    return cells_of_one_type(cell_type, table[:, :n_corners])


def _require(declared: int, width: int, available: int, noun: str) -> None:
    """Raise where fewer or more numbers than declared follow."""
    if available != declared * width:
        raise InvalidMeshError(
            f"the file declares {declared:,} {noun} of {width} numbers, but {available:,} numbers "
            "follow: it is truncated or damaged"
        )
