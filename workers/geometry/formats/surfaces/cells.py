"""Cells of finite element meshes: surfaces as they are, volumes by their boundary."""

from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.surfaces.polygons import polygon_mesh, require_indices
from workers.geometry.formats.surfaces.volumes import VOLUME_CORNERS, boundary_faces
from workers.geometry.formats.text.tokens import Polygons, places_in_runs
from workers.geometry.mesh import TriangleMesh

# Numbers of VTK's cell types. Those of higher order begin with the corners of the plain one.
STRIP, POLYGON, PIXEL, VOXEL, QUADRATIC_POLYGON, POLYHEDRON = 6, 7, 8, 11, 36, 42
TRIANGLE, QUAD, TETRAHEDRON, HEXAHEDRON, WEDGE, PYRAMID = 5, 9, 10, 12, 13, 14
POINTS_AND_LINES = frozenset({0, 1, 2, 3, 4, 21, 35, 68, 75})
PLAIN = {
    **{TRIANGLE: TRIANGLE, 22: TRIANGLE, 34: TRIANGLE, 69: TRIANGLE, 76: TRIANGLE},
    **{QUAD: QUAD, PIXEL: QUAD, 23: QUAD, 28: QUAD, 30: QUAD, 70: QUAD, 77: QUAD},
    **{TETRAHEDRON: TETRAHEDRON, 24: TETRAHEDRON, 71: TETRAHEDRON, 78: TETRAHEDRON},
    **{HEXAHEDRON: HEXAHEDRON, VOXEL: HEXAHEDRON, 25: HEXAHEDRON, 29: HEXAHEDRON},
    **{33: HEXAHEDRON, 72: HEXAHEDRON, 79: HEXAHEDRON},
    **{WEDGE: WEDGE, 26: WEDGE, 31: WEDGE, 32: WEDGE, 73: WEDGE, 80: WEDGE},
    **{PYRAMID: PYRAMID, 27: PYRAMID, 37: PYRAMID, 74: PYRAMID, 81: PYRAMID, 15: 15, 16: 16},
}
SURFACE_CORNERS = {TRIANGLE: 3, QUAD: 4}
HIGHER_ORDER = frozenset(set(range(22, 38)) - {35} | set(range(69, 75)) | set(range(76, 82)))


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of any type.

    Attributes
    ----------
    types : (c,) int64
        VTK's numbers: 5 for a triangle, 10 for a tetrahedron.
    corners : Polygons
        Vertex indices from 0, in VTK's order, one polygon a cell.
    """

    types: IntArray
    corners: Polygons


@dataclass(frozen=True, eq=False)
class Surface:
    """The surface of cells.

    Attributes
    ----------
    mesh : TriangleMesh
        All vertices, also those inside a volume.
    found : tuple of str
        What was made of volumes, and what is left out.
    """

    mesh: TriangleMesh
    found: tuple[str, ...]


def cells_of_one_type(cell_type: int, corners: IntArray) -> Cells:
    """Make cells of a table.

    Parameters
    ----------
    cell_type : int
        VTK's number.
    corners : (c, k) int64
        Vertex indices.

    Returns
    -------
    Cells
        One a row.
    """
    counts = np.full(len(corners), corners.shape[1], dtype=np.int64)
    types = np.full(len(corners), cell_type, dtype=np.int64)
    return Cells(types, Polygons(counts, np.reshape(corners, -1)))


def join_polygons(parts: list[Polygons]) -> Polygons:
    """Put lists of polygons one behind the other.

    Parameters
    ----------
    parts : list of Polygons
        Any number.

    Returns
    -------
    Polygons
        All of them.
    """
    none = np.zeros(0, dtype=np.int64)
    return Polygons(
        np.concatenate([none, *(part.counts for part in parts)]),
        np.concatenate([none, *(part.corners for part in parts)]),
    )


def join_cells(parts: list[Cells]) -> Cells:
    """Put lists of cells one behind the other.

    Parameters
    ----------
    parts : list of Cells
        Any number.

    Returns
    -------
    Cells
        All of them.
    """
    types = np.concatenate([np.zeros(0, dtype=np.int64), *(part.types for part in parts)])
    return Cells(types, join_polygons([part.corners for part in parts]))


def cut_strips(strips: Polygons) -> Polygons:
    """Cut triangle strips; every second triangle is turned round.

    Parameters
    ----------
    strips : Polygons
        Vertex indices a strip; less than 3 make no triangle.

    Returns
    -------
    Polygons
        Triangles.
    """
    counts = np.maximum(strips.counts - 2, 0)  # triangles a strip
    starts = np.cumsum(strips.counts) - strips.counts
    place = places_in_runs(counts)  # (t,)
    begin = np.repeat(starts, counts) + place  # (t,)
    odd = place % 2
    order = np.stack([begin, begin + 1 + odd, begin + 2 - odd], axis=1)  # (t, 3)
    return Polygons(np.full(len(begin), 3, dtype=np.int64), strips.corners[order].ravel())


def surface_of_cells(vertices: FloatArray, cells: Cells, limits: MeshLimits) -> Surface:
    """Make a mesh of cells: faces as they are, and of volumes the faces that one cell alone has.

    A face in the file that is also a face of a volume is left out: the boundary has it already, or
    it lies inside.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    cells : Cells
        Of any type; corners are not checked before.
    limits : MeshLimits
        Most vertices and triangles that are accepted.

    Returns
    -------
    Surface
        The mesh, and what was left out.

    Raises
    ------
    InvalidMeshError
        No faces, a cell with too few corners, or a corner that is no vertex.
    UnsupportedFormatError
        A cell of a type that has no surface here.
    UploadTooLargeError
        More vertices or triangles than the limits allow.
    """
    limits.check(vertices=len(vertices))
    counts = cells.corners.counts
    require_indices(cells.corners.corners, np.repeat(np.arange(len(counts)), counts), len(vertices))
    faces: list[Polygons] = []
    volumes: dict[int, list[IntArray]] = {}
    for cell_type in np.unique(cells.types).tolist():
        rows = np.flatnonzero(cells.types == cell_type)
        plain = PLAIN.get(cell_type)
        if plain in VOLUME_CORNERS:
            table = _table(cells, rows, cell_type, VOLUME_CORNERS[plain])
            volumes.setdefault(plain, []).append(table)
        elif cell_type not in POINTS_AND_LINES:
            faces.append(_faces(cells, rows, cell_type))
    joined = {plain: np.concatenate(tables) for plain, tables in volumes.items()}
    found = _left_out(cells)
    surface = join_polygons(faces)
    if joined:
        surface, inner = boundary_faces(vertices, joined, surface)
        n_volumes = sum(len(table) for table in joined.values())
        found += (f"{n_volumes:,} volume cells, of which the boundary surface is read",)
        found += (f"{inner:,} faces that are also faces of the volume cells",) if inner else ()
    return Surface(polygon_mesh(vertices, surface, limits), found)


def _left_out(cells: Cells) -> tuple[str, ...]:
    """Sentences on points, lines and the further points of curved cells."""
    n_lines = int(np.isin(cells.types, list(POINTS_AND_LINES)).sum())
    n_curved = int(np.isin(cells.types, list(HIGHER_ORDER)).sum())
    lines = (f"{n_lines:,} points and lines",) if n_lines else ()
    curved = (f"{n_curved:,} cells of higher order, read by their corners",) if n_curved else ()
    return lines + curved


def _faces(cells: Cells, rows: IntArray, cell_type: int) -> Polygons:
    """Polygons of surface cells of one type."""
    if cell_type in (STRIP, POLYGON, QUADRATIC_POLYGON):
        counts = cells.corners.counts[rows]
        starts = (np.cumsum(cells.corners.counts) - cells.corners.counts)[rows]
        if cell_type == QUADRATIC_POLYGON:  # corners first, then as many middles of sides
            counts = counts // 2
        picked = np.repeat(starts, counts) + places_in_runs(counts)
        polygons = Polygons(counts, cells.corners.corners[picked])
        return cut_strips(polygons) if cell_type == STRIP else polygons
    if cell_type not in PLAIN:
        name = "polyhedra" if cell_type == POLYHEDRON else f"cells of VTK's type {cell_type}"
        raise UnsupportedFormatError(
            f"{len(rows):,} {name} are not read; "
            "extract the surface (ParaView: Extract Surface) and upload that"
        )
    n_corners = SURFACE_CORNERS[PLAIN[cell_type]]
    table = _table(cells, rows, cell_type, n_corners)
    return Polygons(np.full(len(table), n_corners, dtype=np.int64), table.ravel())


def _table(cells: Cells, rows: IntArray, cell_type: int, n_corners: int) -> IntArray:
    """First corners of cells (r, n_corners), in the order of the plain type."""
    counts = cells.corners.counts
    short = counts[rows] < n_corners
    if short.any():
        bad = int(rows[np.argmax(short)])
        raise InvalidMeshError(f"cell {bad} has {counts[bad]} corners; expected {n_corners}")
    starts = (np.cumsum(counts) - counts)[rows]
    table: IntArray = cells.corners.corners[starts[:, None] + np.arange(n_corners)]
    if cell_type == PIXEL:
        return table[:, [0, 1, 3, 2]]
    return table[:, [0, 1, 3, 2, 4, 5, 7, 6]] if cell_type == VOXEL else table
