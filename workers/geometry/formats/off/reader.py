"""OFF: text with rows of any layout, and the entrance to binary."""

import re
from dataclasses import replace

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.off.binary import read_binary_body
from workers.geometry.formats.off.keyword import BINARY, Layout, layout_of, read_keyword
from workers.geometry.formats.off.rows import Body, Counts, read_body
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.polygons import points_and_lines, polygon_mesh
from workers.geometry.formats.text.numbers import NumberText, read_numbers, without_comments
from workers.geometry.formats.text.numerals import with_decimal_points
from workers.geometry.formats.text.tokens import quoted

SHORTEST_VERTEX, SHORTEST_FACE = len(b"0 0 0\n"), len(b"0\n")
LARGEST_COUNT = 1e15
COUNTS_LINE = re.compile(rb"\s*\d+\s+\d+(?:\s+\d+)?[ \t]*(?=[\r\n])")
FIRST_LINE = re.compile(rb"\s*([^\r\n]*)")


def read_off(data: bytes, limits: MeshLimits) -> Reading:
    """Read an OFF file: any prefix, comments, polygons, wrapped rows, binary, no keyword needed.

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
    binary = BINARY.match(data)
    if binary:
        layout = layout_of(binary[1])
        body = read_binary_body(data, binary.end(), layout, limits)
    else:
        layout, body = _read_text(without_comments(data), limits)
    vertices = _in_space(body.coordinates, layout)
    return Reading(
        polygon_mesh(vertices, body.polygons, limits),
        (*layout.repairs, *body.repairs, *points_and_lines(body.polygons)),
        (*layout.found, *body.found),
    )


def _read_text(text: bytes, limits: MeshLimits) -> tuple[Layout, Body]:
    """Layout and body of a text without comments."""
    layout, end = read_keyword(text)
    text = text[end:]
    counts_line = COUNTS_LINE.match(text)
    begin = counts_line.end() if counts_line else 0
    rows, repairs = with_decimal_points(text[begin:])
    text = text[:begin] + rows if repairs else text
    numbers = read_numbers(text)
    counts = _counts(numbers, layout, text)
    limits.check(vertices=counts.vertices, faces=counts.faces)
    needed = counts.vertices * SHORTEST_VERTEX + counts.faces * SHORTEST_FACE - 1
    check_length(needed, len(text), vertices=counts.vertices, faces=counts.faces)
    body = read_body(numbers, counts, layout)
    return layout, replace(body, repairs=(*repairs, *body.repairs))


def _counts(numbers: NumberText, layout: Layout, text: bytes) -> Counts:
    """Numbers of vertices, faces and perhaps edges, on one line or more."""
    values, begin = numbers.values, 0
    if layout.has_dimension and len(values):
        layout.require_space(int(np.nan_to_num(values[0])))
        begin = 1
    found = FIRST_LINE.match(text)
    line = found[1].strip() if found else b""
    pair = values[begin : begin + 2]
    if len(pair) < 2 or (pair < 0).any() or (pair != np.rint(pair)).any():
        raise InvalidMeshError(
            "expected OFF's numbers of vertices, faces and edges, "
            f"found {quoted(line) if line else 'nothing'}"
        )
    if not (pair < LARGEST_COUNT).all():
        raise InvalidMeshError(f"OFF's counts {quoted(line)} are no sensible numbers")
    return Counts(int(pair[0]), int(pair[1]), _after_counts(numbers, begin + 2, int(pair.sum())))


def _after_counts(numbers: NumberText, place: int, n_rows: int) -> int:
    """Which number is the first after the counts; the one at ``place`` may count edges.

    It does if it stands on the line of the counts, or alone on the next.
    """
    line = int(np.searchsorted(numbers.lines, place))
    edges = numbers.lines[line : line + 2]
    if len(edges) and edges[0] == place:  # the line of the counts is over
        return place + 1 if len(edges) == 2 and edges[1] - edges[0] == 1 else place
    if len(edges) and numbers.n_lines - line >= n_rows:
        return int(edges[0])  # whatever else stands on the line of the counts
    return place + 1


def _in_space(coordinates: FloatArray, layout: Layout) -> FloatArray:
    """Positions (n, 3), divided by the fourth coordinate where there is one."""
    if not layout.homogeneous:
        return coordinates.astype(np.float64)
    weights = coordinates[:, 3:]
    if (weights == 0).any():
        vertex = int(np.argmax(weights[:, 0] == 0))
        raise InvalidMeshError(
            f"vertex {vertex} has the fourth coordinate 0: it lies at infinity; "
            "expected another number, by which the first three are divided"
        )
    with np.errstate(all="ignore"):  # what is not finite is left to cleaning
        positions: FloatArray = coordinates[:, :3].astype(np.float64) / weights
    return positions
