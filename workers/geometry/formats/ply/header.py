"""The header of a PLY file: its encoding, elements and properties."""

import re
from dataclasses import dataclass

from workers.errors import InvalidMeshError
from workers.geometry.formats.ply.names import ELEMENTS
from workers.geometry.formats.rows.tables import Element, Property
from workers.geometry.formats.text.tokens import quoted

LONGEST_HEADER = 1 << 20  # bytes
LONGEST_COUNT = 15  # digits
MOST_SAID = 3  # lines of the header that are quoted
MAGIC = re.compile(rb"ply[ \t]*(\r\n|\n|\r)", re.IGNORECASE)
END = re.compile(rb"[\r\n][ \t]*end_header[ \t]*(\r\n|\n|\r|\Z)", re.IGNORECASE)
ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"long": "i8", "ulong": "u8", "longlong": "i8", "ulonglong": "u8", "size": "u8"},
    **{"int64": "i8", "uint64": "u8", "byte": "i1", "ubyte": "u1", "bool": "u1"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8", "float16": "f2"},
    **{"half": "f2", "single": "f4", "real": "f4", "integer": "i4"},
}


@dataclass(frozen=True)
class Header:
    """What the header says.

    Attributes
    ----------
    byte_order : str
        "<" or ">", or "" for text.
    elements : tuple of Element
        In the order of the file; the names are those of `ELEMENTS` where they mean the same.
    body : int
        Where the data begins, in bytes.
    comments : tuple of str
        What follows ``comment`` and ``obj_info``.
    repairs : tuple of str
        Lines that are none of PLY's.
    """

    byte_order: str
    elements: tuple[Element, ...]
    body: int
    comments: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()

    def count(self, name: str) -> int:
        """Add up the rows of the elements of a name.

        Parameters
        ----------
        name : str
            One of `ELEMENTS`, or any other.

        Returns
        -------
        int
            0 where there is no such element.
        """
        return sum(e.count for e in self.elements if e.name == name)


def is_ply(data: bytes) -> bool:
    """Tell whether a file begins as PLY.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.

    Returns
    -------
    bool
        Whether its first line is ``ply``.
    """
    return MAGIC.match(data) is not None


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
        A line of PLY's own that means nothing, which the message quotes, or no end.
    """
    end = END.search(data[:LONGEST_HEADER])
    if end is None:
        raise InvalidMeshError("the PLY header has no 'end_header': the file is truncated")
    lines = [line.strip() for line in data[: end.start()].splitlines()[1:]]
    split = [(line, line.decode("latin-1").split()) for line in lines if line]
    byte_order = _byte_order(split)
    comments: list[str] = []
    unknown: list[bytes] = []
    elements: list[tuple[str, int, list[Property]]] = []
    for line, words in split:
        match words[0].lower():
            case "comment" | "obj_info":
                comments.append(" ".join(words[1:]))
            case "element":
                elements.append((*_element(words, line), []))
            case "property" if elements:
                elements[-1][2].append(_property(words, line, byte_order))
            case "property":
                raise _meaningless(line)
            case "format":
                pass
            case _:
                unknown.append(line)
    made = tuple(Element(name, count, tuple(properties)) for name, count, properties in elements)
    return Header(byte_order, made, _body(data, end), tuple(comments), _said(unknown))


def _body(data: bytes, end: re.Match[bytes]) -> int:
    """Where the data begins: a body after a header with CR ends may begin with a line feed."""
    first = MAGIC.match(data)
    if first and first[1] == b"\r" and end[1] == b"\r\n":
        return end.end() - 1
    return end.end()


def _byte_order(lines: list[tuple[bytes, list[str]]]) -> str:
    """Byte order of the line ``format``, "" for text."""
    for line, words in lines:
        if words[0].lower() == "format":
            encoding = "_".join(words[1:]).lower().replace("-", "_")
            found = [order for name, order in ENCODINGS.items() if encoding.startswith(name)]
            if not found:
                raise _meaningless(line)
            return found[0]
    raise InvalidMeshError(f"the PLY header has no format line; expected one of {[*ENCODINGS]}")


def _element(words: list[str], line: bytes) -> tuple[str, int]:
    """Name and count of a line ``element name count``."""
    if len(words) < 3 or not (words[2].isascii() and words[2].isdigit()):
        raise _meaningless(line)
    if len(words[2]) > LONGEST_COUNT:
        raise InvalidMeshError(f"PLY declares a senseless count: {quoted(line)}")
    name = words[1].lower()
    return next((known for known, others in ELEMENTS.items() if name in others), name), int(
        words[2]
    )


def _property(words: list[str], line: bytes, byte_order: str) -> Property:
    """Property of a line ``property type name`` or ``property list type type name``."""
    rest = words[1:]
    is_list = bool(rest) and rest[0].lower() == "list"
    types: list[str] = []
    for _ in range(2 if is_list else 1):
        rest = rest[1:] if is_list and not types else rest
        found, rest = _type(rest, line, byte_order)
        types.append(found)
    if not rest:
        raise _meaningless(line)
    name = "_".join(rest).lower()
    return Property(name, types[1], types[0]) if is_list else Property(name, types[0])


def _type(words: list[str], line: bytes, byte_order: str) -> tuple[str, list[str]]:
    """Type that the words begin with, and the words after it. In text any type will do."""
    if not words:
        raise _meaningless(line)
    name, rest = words[0].lower(), words[1:]
    if name in ("unsigned", "signed") and len(rest) >= 2 and rest[0].lower() in TYPES:
        name, rest = ("u" if name == "unsigned" else "") + rest[0].lower(), rest[1:]
    found = TYPES.get(name.removesuffix("_t"), None if byte_order else "f8")
    if found is None:
        raise InvalidMeshError(f"the PLY header has a property of no known type: {quoted(line)}")
    return found, rest


def _meaningless(line: bytes) -> InvalidMeshError:
    """Error of a line that begins with a word of PLY's and cannot be read."""
    return InvalidMeshError(f"the PLY header has a line that means nothing: {quoted(line)}")


def _said(unknown: list[bytes]) -> tuple[str, ...]:
    """Sentences on lines that begin with no word of PLY's."""
    more = [f"passed over {len(unknown) - MOST_SAID:,} more such lines"]
    return (
        *(
            f"passed over a line of the header that is none of PLY's: {quoted(line)}"
            for line in unknown[:MOST_SAID]
        ),
        *(more if len(unknown) > MOST_SAID else []),
    )
