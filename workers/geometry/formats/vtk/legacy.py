"""Legacy VTK: text and binary, polygonal data, unstructured and structured grids."""

import re
from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.cells import Cells, surface_of_cells
from workers.geometry.formats.text.tokens import Polygons, quoted
from workers.geometry.formats.vtk.cursor import Cursor
from workers.geometry.formats.vtk.datasets import GRIDS, poly_cells, require_read
from workers.geometry.formats.vtk.grid import grid_cells
from workers.geometry.formats.vtk.legacy_cells import read_cells

MAGIC = re.compile(rb"\s*#\s*vtk\s+DataFile\s+Version", re.IGNORECASE)
ENCODING = re.compile(rb"^[ \t]*(ASCII|BINARY)[ \t\r]*$", re.IGNORECASE | re.MULTILINE)
TEXT_COMMENT = re.compile(rb"^[ \t]*#[^\n]*", re.MULTILINE)
LONGEST_HEADER = 1 << 16  # bytes to the word ASCII or BINARY; VTK's titles have at most 256
LISTS = ("vertices", "lines", "polygons", "triangle_strips", "cells")


@dataclass
class _Body:
    """What was read so far."""

    dataset: str = ""
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    lists: dict[str, Polygons] = field(default_factory=dict)
    types: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    dimensions: tuple[int, int, int] = (0, 0, 0)
    repairs: list[str] = field(default_factory=list)
    found: list[str] = field(default_factory=list)


def is_legacy_vtk(data: bytes) -> bool:
    """Whether the first line is that of a legacy VTK file.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        True for text and binary alike.
    """
    return MAGIC.match(data[:4096]) is not None


def read_legacy_vtk(data: bytes, limits: MeshLimits) -> Reading:
    """Read a legacy VTK file.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        All points, polygons and strips cut into triangles, and the boundary of volume cells.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    encoding = ENCODING.search(data[:LONGEST_HEADER].replace(b"\r", b"\n"))
    if encoding is None:
        raise InvalidMeshError("the VTK file says neither ASCII nor BINARY; expected it in line 3")
    if encoding[1].upper() == b"ASCII":
        text = data.replace(b"\r", b"\n") if b"\r" in data else data
        if b"#" in text[encoding.end() :]:
            text = text[: encoding.end()] + TEXT_COMMENT.sub(b"", text[encoding.end() :])
        return _reading(Cursor(text, encoding.end(), ""), limits)
    try:
        return _reading(Cursor(data, encoding.end(), ">"), limits)
    except InvalidMeshError as error:
        try:
            reading = _reading(Cursor(data, encoding.end(), "<"), limits)
        except InvalidMeshError:
            raise error from None
    repair = "the numbers are little-endian; expected big-endian, as VTK writes them"
    return Reading(reading.mesh, (repair, *reading.repairs), reading.found)


def _reading(cursor: Cursor, limits: MeshLimits) -> Reading:
    """Read the sections from the cursor onward."""
    body = _Body()
    while (keyword := cursor.word()) and _section(cursor, keyword, body, limits):
        pass
    require_read(body.dataset)
    if body.dataset in GRIDS:
        cells = grid_cells(body.dimensions, len(body.points))
    elif body.dataset == "polydata":
        cells = poly_cells(body.lists)
    else:
        polygons = body.lists.get("cells", Polygons(body.types[:0], body.types[:0]))
        if len(body.types) != len(polygons.counts):
            raise InvalidMeshError(
                f"the VTK file has {len(polygons.counts):,} cells, "
                f"but {len(body.types):,} types of cells"
            )
        cells = Cells(body.types, polygons)
    surface = surface_of_cells(body.points, cells, limits)
    return Reading(surface.mesh, tuple(body.repairs), (*surface.found, *body.found))


def _section(cursor: Cursor, keyword: str, body: _Body, limits: MeshLimits) -> bool:
    """Read one section; False where the geometry ends."""
    if keyword == "dataset":
        body.dataset = cursor.word()
        require_read(body.dataset)
    elif keyword == "points":
        body.points = _points(cursor, body, limits)
    elif keyword in LISTS:
        body.lists[keyword] = read_cells(cursor, keyword, limits, body.repairs)
    elif keyword == "cell_types":
        count = cursor.count(keyword)
        cursor.end_line()
        body.types = cursor.integers(count, "i4", keyword)[:count]
    elif keyword == "dimensions":
        body.dimensions = (cursor.count(keyword), cursor.count(keyword), cursor.count(keyword))
    elif keyword == "metadata":
        _skip_metadata(cursor)
    elif keyword == "field":
        _skip_fields(cursor)
    elif keyword in ("point_data", "cell_data"):
        _name_attributes(cursor, keyword, body)
        return False
    elif body.lists:  # whatever follows the geometry
        unknown = quoted(keyword.encode())
        body.repairs.append(f"what follows the cells is no section of VTK: {unknown}")
        return False
    else:
        raise InvalidMeshError(
            f"expected a section of a VTK file such as POINTS, found {quoted(keyword.encode())}"
        )
    return True


def _points(cursor: Cursor, body: _Body, limits: MeshLimits) -> FloatArray:
    """Positions (n, 3)."""
    declared = cursor.count("points")
    limits.check(vertices=declared)
    type = cursor.type()
    available = len(cursor.data) - cursor.position
    size = 3 * int(type[1]) if cursor.byte_order else len(b"0 0 0\n")
    check_length(declared * size - 1, available, vertices=declared, faces=0)
    values = cursor.floats(3 * declared, type, "points")
    n_points, rest = divmod(len(values), 3)
    if rest or (n_points < declared and not body.lists and cursor.position == len(cursor.data)):
        raise InvalidMeshError(
            f"the VTK file declares {declared:,} points, but {len(values):,} coordinates follow: "
            "it is truncated or damaged"
        )
    if n_points != declared:
        body.repairs.append(f"the file declares {declared:,} points, but has {n_points:,}")
    return values.reshape(-1, 3)


def _skip_metadata(cursor: Cursor) -> None:
    """Go on behind a METADATA section, which ends at a blank line."""
    cursor.skip_line()
    blank = re.compile(rb"^[ \t\r]*\n", re.MULTILINE).search(cursor.data, cursor.position)
    cursor.position = blank.end() if blank else len(cursor.data)


def _skip_fields(cursor: Cursor) -> None:
    """Go on behind a FIELD section: arrays ``name components tuples type`` and their numbers."""
    cursor.word()
    for _ in range(cursor.count("field")):
        if cursor.next_is("metadata"):
            cursor.word()
            _skip_metadata(cursor)
        name = cursor.word()
        if not name:
            break
        count = cursor.count(name[:24]) * cursor.count(name[:24])
        word = cursor.word()
        cursor.end_line()
        if word in ("string", "variant", "utf8_string"):
            raise UnsupportedFormatError(
                "the VTK file has a field of text before its points, which is not read; "
                "save it without field data"
            )
        _skip_numbers(cursor, count, word)


def _skip_numbers(cursor: Cursor, count: int, word: str) -> None:
    """Go on behind a block of numbers that are not needed."""
    if not cursor.byte_order:
        cursor.skip_words(count)
    elif word == "bit":
        cursor.position += (count + 7) // 8
    else:
        from_name = Cursor(word.encode() + b"\n", 0, cursor.byte_order).type()
        cursor.position += count * int(from_name[1])


def _name_attributes(cursor: Cursor, keyword: str, body: _Body) -> None:
    """Say that there are values on points or cells."""
    rest = cursor.data[cursor.position :]
    for name in ("point_data", "cell_data"):
        section = re.compile(rb"^[ \t]*" + name.encode() + rb"[ \t]+\d", re.I | re.M)
        if name == keyword or section.search(rest):
            body.found.append(name.replace("_", " "))
