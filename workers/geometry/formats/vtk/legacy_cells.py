"""Lists of cells in a legacy VTK file, in the layout before version 5 and in that of 5.1."""

from workers.errors import InvalidMeshError
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.rows.records import counted_polygons, polygons_by_offsets
from workers.geometry.formats.text.tokens import Polygons
from workers.geometry.formats.vtk.cursor import Cursor


def read_cells(cursor: Cursor, keyword: str, limits: MeshLimits, repairs: list[str]) -> Polygons:
    """Read one list of cells.

    Parameters
    ----------
    cursor : Cursor
        Behind the keyword.
    keyword : str
        Such as "polygons".
    limits : MeshLimits
        Most faces that are accepted.
    repairs : list of str
        What is wrong with the counts is added here.

    Returns
    -------
    Polygons
        Corners of each cell.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        Truncated, damaged, or over the limits.
    """
    n_cells, size = cursor.count(keyword), cursor.count(keyword)
    cursor.end_line()
    limits.check(faces=n_cells)
    if cursor.next_is("offsets"):
        return _by_offsets(cursor, n_cells, size)
    available = len(cursor.data) - cursor.position
    check_length(n_cells * 2 - 1, available, vertices=0, faces=n_cells)
    if not cursor.byte_order:
        return _text_cells(cursor, keyword, n_cells, repairs)
    start = cursor.position
    values = cursor.integers(available // 4, "i4", keyword)  # the size may be wrong
    polygons, end = counted_polygons(values, n_cells, "cell")
    if len(polygons.counts) < n_cells:
        raise InvalidMeshError(
            f"the VTK file ends within cell {len(polygons.counts)} of {n_cells}: it is truncated"
        )
    cursor.position = start + 4 * end
    if end != size:
        repairs.append(f"the cells take {end:,} numbers, but the file declares {size:,}")
    return polygons


def _text_cells(cursor: Cursor, keyword: str, declared: int, repairs: list[str]) -> Polygons:
    """Cells of a text; all there are, whatever number is declared."""
    values = cursor.integers(0, "i4", keyword)
    polygons, _ = counted_polygons(values, len(values), "cell")
    n_cells = len(polygons.counts)
    at_end = cursor.position == len(cursor.data)
    if n_cells < declared - 1 and at_end:
        raise InvalidMeshError(
            f"the VTK file declares {declared:,} cells, but ends after {n_cells:,}: it is truncated"
        )
    if n_cells != declared:
        repairs.append(f"the file declares {declared:,} cells, but has {n_cells:,}")
    return polygons


def _by_offsets(cursor: Cursor, n_offsets: int, n_corners: int) -> Polygons:
    """Cells in the layout of version 5.1: offsets, then indices."""
    cursor.word()
    offsets = cursor.integers(n_offsets, cursor.type(), "offsets")
    if cursor.word() != "connectivity":
        raise InvalidMeshError("expected CONNECTIVITY after the OFFSETS of the VTK file")
    corners = cursor.integers(n_corners, cursor.type(), "connectivity")
    if len(offsets) != n_offsets or len(corners) != n_corners:
        raise InvalidMeshError(
            f"the VTK file declares {n_offsets:,} offsets and {n_corners:,} indices, "
            f"but has {len(offsets):,} and {len(corners):,}: it is truncated or damaged"
        )
    return polygons_by_offsets(offsets[1:], corners)
