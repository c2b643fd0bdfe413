"""The rows of a PLY file's elements, binary or as text."""

import re
from dataclasses import replace

from workers.errors import InvalidMeshError
from workers.geometry.formats.ply.header import Header
from workers.geometry.formats.rows.tables import Element, Rows
from workers.geometry.formats.rows.walking import read_rows, rows_at
from workers.geometry.formats.text.numbers import NumberText, read_numbers, without_comments
from workers.geometry.formats.text.numerals import with_decimal_points
from workers.geometry.formats.text.tokens import quoted

COMMENT_LINE = re.compile(rb"^[ \t]*(?:comment|obj_info)\b[^\n]*", re.MULTILINE | re.IGNORECASE)
NUMBER_SIZE = 8  # bytes of a number of a text, once read


def read_binary(data: bytes, header: Header, n_elements: int) -> tuple[list[Rows], list[str]]:
    """Find the rows of the first elements of a binary file.

    Parameters
    ----------
    data : bytes
        The whole file.
    header : Header
        Of this file.
    n_elements : int
        How many elements are wanted; nothing after them is looked at.

    Returns
    -------
    rows : list of Rows
        One for each element.
    repairs : list of str
        What is left over after the last element.

    Raises
    ------
    InvalidMeshError
        The file ends before the rows do, or a list has no sensible length.
    """
    tables: list[Rows] = []
    position = header.body
    for element in header.elements[:n_elements]:
        tables.append(read_rows(data, position, element, header.byte_order))
        position = tables[-1].end
    left = len(data) - position
    if n_elements < len(header.elements) or not data[position:].strip(b"\0 \t\r\n\x1a"):
        return tables, []
    return tables, [f"left out {left:,} bytes after the last row"]


def read_text(data: bytes, header: Header, n_elements: int) -> tuple[list[Rows], list[str]]:
    """Find the rows of the first elements of a text, one a line or wrapped in any way.

    Parameters
    ----------
    data : bytes
        The whole file.
    header : Header
        Of this file.
    n_elements : int
        How many elements are wanted; nothing after them is looked at.

    Returns
    -------
    rows : list of Rows
        One for each element; their numbers are all float64.
    repairs : list of str
        How the lines depart from one row each.

    Raises
    ------
    InvalidMeshError
        The text ends before the rows do, or has a word where a number is expected.
    """
    body = data[header.body :]
    if b"\r" in body:
        body = body.replace(b"\r", b"\n")
    body, repairs = with_decimal_points(without_comments(COMMENT_LINE.sub(b"", body)))
    numbers = read_numbers(body)
    elements = [_as_text(element) for element in header.elements[:n_elements]]
    declared = sum(element.count for element in elements)
    try:
        tables, said = _by_lines(numbers, elements)
    except InvalidMeshError:
        if numbers.word is None and numbers.n_lines == declared:
            raise
        tables, said = _as_stream(numbers, elements)
    rest = n_elements == len(header.elements) and _rest(numbers, tables)
    return tables, [*repairs, *said, *(["left out what follows the last row"] if rest else [])]


def _as_text(element: Element) -> Element:
    """Element whose numbers are all float64."""
    properties = [
        replace(p, type="f8", length_type="f8" if p.length_type else None)
        for p in element.properties
    ]
    return replace(element, properties=tuple(properties))


def _by_lines(numbers: NumberText, elements: list[Element]) -> tuple[list[Rows], list[str]]:
    """Take one line for each row; what a line has beyond its row is left out."""
    data = numbers.data
    declared = sum(element.count for element in elements)
    if numbers.n_lines < declared:
        raise InvalidMeshError(f"{declared:,} rows are declared, {numbers.n_lines:,} lines follow")
    edges = NUMBER_SIZE * numbers.lines
    tables, repairs = [], []
    first = 0
    for element in elements:
        last = first + element.count
        rows, filled = rows_at(data, edges[first:last], edges[first + 1 : last + 1], element, "<")
        tables.append(rows)
        if not filled:
            repairs.append(
                f"left out numbers at the end of '{element.name[:24]}' lines: "
                "the header names fewer"
            )
        first = last
    return tables, repairs


def _as_stream(numbers: NumberText, elements: list[Element]) -> tuple[list[Rows], list[str]]:
    """Read number after number, wherever lines end."""
    tables: list[Rows] = []
    position = 0
    for element in elements:
        try:
            tables.append(read_rows(numbers.data, position, element, "<"))
        except InvalidMeshError:
            if numbers.word is None:
                raise
            reason = f"expected a number, found {quoted(numbers.word)}"
            raise InvalidMeshError(reason) from None
        position = tables[-1].end
    return tables, ["lines are not rows: numbers were read one after the other"]


def _rest(numbers: NumberText, tables: list[Rows]) -> bool:
    """Whether something follows after the last row."""
    return tables[-1].end < NUMBER_SIZE * len(numbers.values) or numbers.word is not None
