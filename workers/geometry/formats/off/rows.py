"""Vertices and polygons of a text, with a row a line or wrapped in any way."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.off.keyword import Layout
from workers.geometry.formats.rows.tables import Element, Property
from workers.geometry.formats.rows.walking import read_rows
from workers.geometry.formats.text.numbers import NumberText
from workers.geometry.formats.text.tokens import Polygons, integral, places_in_runs, quoted

NUMBER_SIZE = 8  # bytes of a float64
COLOURS = (0, 3, 4, 1)  # numbers after each face that are tried where rows wrap
TRIANGLE = 4  # numbers of a face of 3 corners
WRAPPED = "rows wrap over several lines: numbers were read one after the other"
LEFT = "left out what follows the last face"


@dataclass(frozen=True)
class Counts:
    """What the file declares.

    Attributes
    ----------
    vertices, faces : int
        How many there are.
    begin : int
        Which number is the first after the counts.
    """

    vertices: int
    faces: int
    begin: int


@dataclass(frozen=True, eq=False)
class Body:
    """Vertices and polygons.

    Attributes
    ----------
    coordinates : (n, 3 or 4) float64
        Of the vertices.
    polygons : Polygons
        Corners are not checked.
    repairs, found : tuple of str
        As in `Reading`.
    """

    coordinates: FloatArray
    polygons: Polygons
    repairs: tuple[str, ...]
    found: tuple[str, ...]

    @property
    def in_range(self) -> bool:
        """Whether all corners are vertices."""
        corners = self.polygons.corners
        n_vertices = len(self.coordinates)
        return not len(corners) or bool(corners.min() >= 0 and corners.max() < n_vertices)


@dataclass(frozen=True, eq=False)
class _Vertices:
    """Coordinates, how they were found, and which number comes after them."""

    coordinates: FloatArray
    end: int
    repairs: tuple[str, ...] = ()
    found: tuple[str, ...] = ()


def read_body(numbers: NumberText, counts: Counts, layout: Layout) -> Body:
    """Read the rows after the counts.

    A row a line is tried first. Where that does not work out, vertices or faces or both are read
    number after number; if colours follow the faces, each face has equally many numbers of them.

    Parameters
    ----------
    numbers : NumberText
        Of the whole file.
    counts : Counts
        What it declares.
    layout : Layout
        What stands for each vertex.

    Returns
    -------
    Body
        The first reading in which all corners are vertices and no number is left, or the first
        with numbers left.

    Raises
    ------
    InvalidMeshError
        None works out. The message says what is wrong with a row a line, or how the text ends.
    """
    first = int(np.searchsorted(numbers.lines, counts.begin))
    n_missing = counts.vertices + counts.faces - (numbers.n_lines - first)
    spare: list[Body] = []
    errors: list[InvalidMeshError] = []
    for vertices in _vertices(numbers, first, counts, layout):
        try:
            body = _face_lines(numbers, vertices, counts)
            if body.in_range or n_missing == 0:
                return body
            spare.append(body)
        except InvalidMeshError as error:
            if n_missing == 0 and numbers.word is None:
                raise
            errors.insert(0 if n_missing < 0 else len(errors), error)
        for n_colours in COLOURS:
            try:
                body = _face_stream(numbers, vertices, counts, n_colours)
            except InvalidMeshError as error:
                errors.append(error)
                continue
            if body.in_range and LEFT not in body.repairs:
                return body
            if n_colours == 0:
                spare.append(body)
    spare.sort(key=lambda body: not body.in_range)
    if spare:
        return spare[0]
    raise _reason(numbers, errors, n_missing, counts.faces, vertices.end)


def _reason(
    numbers: NumberText, errors: list[InvalidMeshError], n_missing: int, n_faces: int, begin: int
) -> InvalidMeshError:
    """Error of a text that no reading fits; ``begin`` is the number that the faces begin with."""
    if numbers.word is not None:
        return InvalidMeshError(f"expected a number, found {quoted(numbers.word)}")
    if n_missing != 0 and len(numbers.values) - begin >= TRIANGLE * n_faces:
        return InvalidMeshError(
            f"the {n_faces:,} faces wrap over several lines, and their corners cannot be told from "
            "their colours, or some are missing; expected one face a line"
        )
    return errors[0]


def _vertices(
    numbers: NumberText, first: int, counts: Counts, layout: Layout
) -> Iterator[_Vertices]:
    """Ways to read the vertices; the first line after the counts has number ``first``."""
    n, width = counts.vertices, layout.n_coordinates
    n_missing = n + counts.faces - (numbers.n_lines - first)
    edges = numbers.lines[first : first + n + 1]
    lengths = np.diff(edges)
    enough_lines = len(lengths) == n
    if enough_lines and (lengths >= width).all():
        table = numbers.values[edges[:-1, None] + np.arange(width)]
        more = () if layout.found or not (lengths > width).any() else ("vertex colours or normals",)
        yield _Vertices(table, int(edges[-1]) if n else counts.begin, found=more)
    elif n_missing == 0 and numbers.word is None:
        raise _short_vertex(lengths, width)
    is_there = False
    for row in layout.widths:
        end = counts.begin + n * row
        if end <= len(numbers.values):
            is_there = True
            table = numbers.values[counts.begin : end].reshape(n, row)[:, :width]
            yield _Vertices(table, end, repairs=(WRAPPED,))
    if is_there:
        return
    if numbers.word is not None:
        raise InvalidMeshError(f"expected a number, found {quoted(numbers.word)}")
    raise InvalidMeshError(
        f"the file declares {n:,} vertices and {counts.faces:,} faces, "
        f"but ends after {len(numbers.values) - counts.begin:,} numbers: it is truncated"
    )


def _short_vertex(lengths: IntArray, width: int) -> InvalidMeshError:
    """Error of a vertex whose line has too few numbers."""
    vertex = int(np.argmax(lengths < width))
    return InvalidMeshError(f"vertex {vertex} has {lengths[vertex]} coordinates; expected {width}")


def _face_lines(numbers: NumberText, vertices: _Vertices, counts: Counts) -> Body:
    """Read one face a line."""
    first = int(np.searchsorted(numbers.lines, vertices.end))
    edges = numbers.lines[first : first + counts.faces + 1]
    if len(edges) <= counts.faces or edges[0] != vertices.end:
        raise InvalidMeshError(
            f"the file declares {counts.faces:,} faces, but {max(len(edges) - 1, 0):,} "
            "lines follow: it is truncated"
        )
    starts, lengths = edges[:-1], np.diff(edges)
    n_corners = integral(numbers.values[starts])
    bad = (n_corners < 0) | (n_corners >= lengths)
    if bad.any():
        face = int(np.argmax(bad))
        raise InvalidMeshError(
            f"face {face} declares {n_corners[face]} corners, "
            f"but {lengths[face] - 1} numbers follow"
        )
    corners = numbers.values[np.repeat(starts + 1, n_corners) + places_in_runs(n_corners)]
    coloured = (lengths > n_corners + 1).any()
    return Body(
        *(vertices.coordinates, Polygons(n_corners, integral(corners))),
        (*vertices.repairs, *_left(numbers, int(edges[-1]))),
        (*vertices.found, *(("face colours",) if coloured else ())),
    )


def _face_stream(numbers: NumberText, vertices: _Vertices, counts: Counts, colours: int) -> Body:
    """Read faces number after number, with so many numbers of colours each."""
    properties = (Property("corners", "f8", "f8"), *(Property("", "f8") for _ in range(colours)))
    data = numbers.data
    begin = NUMBER_SIZE * vertices.end
    rows = read_rows(data, begin, Element("face", counts.faces, properties), "<")
    polygons = rows.lists(0)
    if (polygons.counts < 1).any():
        raise InvalidMeshError(f"face {int(np.argmin(polygons.counts))} declares no corners")
    said = (f"took {colours} numbers after each face as its colour",) if colours else ()
    return Body(
        *(vertices.coordinates, polygons),
        tuple(dict.fromkeys([WRAPPED, *said, *_left(numbers, rows.end // NUMBER_SIZE)])),
        (*vertices.found, *(("face colours",) if colours else ())),
    )


def _left(numbers: NumberText, end: int) -> tuple[str, ...]:
    """Say that something follows after the last face."""
    return (LEFT,) if end < len(numbers.values) or numbers.word is not None else ()
