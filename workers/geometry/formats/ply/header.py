"""The header of a PLY file: its encoding, elements and properties."""

import re
from dataclasses import dataclass

from workers.errors import InvalidMeshError
from workers.geometry.formats.tokens import quoted

LONGEST_HEADER = 1 << 20  # bytes
END = re.compile(rb"^end_header[ \t]*(\r\n|\n|\r)", re.MULTILINE)
ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}


@dataclass(frozen=True)
class Property:
    """One property; ``length_type`` is None for a scalar. Types are numpy codes such as "f4"."""

    name: str
    type: str
    length_type: str | None = None


@dataclass(frozen=True)
class Element:
    """So many rows of these properties."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def shortest_row(self) -> int:
        """Bytes a row takes at least in a binary file (all lists empty)."""
        return sum(int((p.length_type or p.type)[1]) for p in self.properties)


@dataclass(frozen=True)
class Header:
    """What the header says.

    Attributes
    ----------
    byte_order : str
        "<" or ">", or "" for text.
    elements : tuple of Element
        In the order of the file.
    body : int
        Where the data begins, in bytes.
    """

    byte_order: str
    elements: tuple[Element, ...]
    body: int

    def element(self, *names: str) -> Element | None:
        """Return the first element of one of these names.

        Parameters
        ----------
        *names : str
            As they stand in the header.

        Returns
        -------
        Element or None
            None where there is no such element.
        """
        return next((e for e in self.elements if e.name in names), None)


def read_header(data: bytes) -> Header:
    """Read the header of a PLY file.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    Header
        With the place where the data begins.

    Raises
    ------
    InvalidMeshError
        A line that means nothing, which the message quotes, or no end.
    """
    end = END.search(data[:LONGEST_HEADER])
    if end is None:
        raise InvalidMeshError("the PLY header has no 'end_header': the file is truncated")
    byte_order: str | None = None
    elements: list[tuple[str, int, list[Property]]] = []
    for line in data[: end.start()].splitlines()[1:]:
        words = line.decode("ascii", "replace").split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and len(words) >= 2 and words[1] in ENCODINGS:
            byte_order = ENCODINGS[words[1]]
        elif words[0] == "element" and len(words) == 3 and words[2].isdigit():
            if len(words[2]) > 15:
                raise InvalidMeshError(f"PLY declares a senseless count: {quoted(line)}")
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property" and elements:
            elements[-1][2].append(_property(words, line))
        else:
            raise InvalidMeshError(f"the PLY header has a line that means nothing: {quoted(line)}")
    if byte_order is None:
        raise InvalidMeshError(f"the PLY header has no format line; expected one of {[*ENCODINGS]}")
    return Header(byte_order, tuple(Element(n, c, tuple(p)) for n, c, p in elements), end.end())


def _property(words: list[str], line: bytes) -> Property:
    """Property of a line ``property type name`` or ``property list type type name``."""
    if len(words) == 3 and words[1] in TYPES:
        return Property(words[2], TYPES[words[1]])
    if len(words) == 5 and words[1] == "list" and words[2] in TYPES and words[3] in TYPES:
        length_type = TYPES[words[2]]
        if length_type[0] != "f":
            return Property(words[4], TYPES[words[3]], length_type)
    raise InvalidMeshError(f"the PLY header has a property of no known type: {quoted(line)}")
