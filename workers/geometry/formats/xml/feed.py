"""XML read as a stream: 3MF, AMF and COLLADA share this.

expat reads it. A document type, and with it every entity, is refused.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Protocol
from xml.parsers import expat

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.text.tokens import floats, integers

PIECE = 1 << 16  # bytes that are parsed at a time
ENCODING = re.compile(rb"\s*<\?xml[^>]{0,200}encoding\s*=")


class XmlReader(Protocol):
    """Takes up what the XML has, in its order; ``text`` may get a text in several parts."""

    @property
    def start(self) -> Callable[[str, dict[str, str]], None]:
        """Called with the tag, which may have a prefix, and the attributes of each element."""

    @property
    def text(self) -> Callable[[str], None]:
        """Called with text between tags."""

    @property
    def end(self) -> Callable[[str], None]:
        """Called with the tag where an element ends."""


def read_xml(
    pieces: Iterable[bytes], reader: XmlReader, *, format: str, encoding: str | None = None
) -> None:
    """Give all elements to a reader.

    Parameters
    ----------
    pieces : iterable of bytes
        The XML, piece after piece.
    reader : XmlReader
        Is called element by element. A ``KeyError`` of it names a missing attribute.
    format : str
        For messages: "3MF".
    encoding : str or None
        In place of the one that the XML declares.

    Raises
    ------
    InvalidMeshError
        Damaged XML, a document type, a missing attribute.
    """

    def doctype(*_: object) -> None:
        raise InvalidMeshError(
            f"the XML of the {format} file has a document type, which is refused"
        )

    parser = expat.ParserCreate(encoding)
    parser.buffer_text = True
    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.CharacterDataHandler = reader.text
    try:
        _feed(parser, _without_blanks_before(pieces))
    except expat.ExpatError as error:
        raise InvalidMeshError(f"the XML of the {format} file is damaged: {error}") from None
    except KeyError as error:
        raise InvalidMeshError(
            f"the XML of the {format} file lacks the attribute {error}"
        ) from None


def pieces_of(data: bytes) -> Iterator[bytes]:
    """Cut a file into the pieces that `read_xml` takes.

    Parameters
    ----------
    data : bytes
        The whole file.

    Yields
    ------
    bytes
        64 KB each.
    """
    for start in range(0, len(data), PIECE):
        yield data[start : start + PIECE]


def encoding_of(data: bytes) -> str | None:
    """Find the encoding that a file has and does not declare.

    Parameters
    ----------
    data : bytes
        The whole file, UTF-8 or of one byte a character.

    Returns
    -------
    str or None
        "iso-8859-1" for XML that declares nothing and is no UTF-8; otherwise None.
    """
    if data.isascii() or ENCODING.match(data):
        return None
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "iso-8859-1"
    return None


def local(tag: str) -> str:
    """Take the name of an element or attribute without its prefix.

    Parameters
    ----------
    tag : str
        "p:path" or "path".

    Returns
    -------
    str
        "path".
    """
    return tag.rpartition(":")[2]


def attribute(attributes: dict[str, str], name: str) -> str | None:
    """Find an attribute, whatever its prefix.

    Parameters
    ----------
    attributes : dict
        Of an element.
    name : str
        Without a prefix.

    Returns
    -------
    str or None
        Its value.
    """
    if name in attributes:
        return attributes[name]
    return next((value for key, value in attributes.items() if local(key) == name), None)


def as_floats(values: Sequence[str], *, format: str) -> FloatArray:
    """Read numbers that each stand in an attribute or element of their own.

    Parameters
    ----------
    values : sequence of str
        Numbers; a comma may stand for the decimal point.
    format : str
        For messages.

    Returns
    -------
    (count,) float64
        One for each value.

    Raises
    ------
    InvalidMeshError
        One is no number.
    """
    try:
        return np.array(values, dtype=np.float64)
    except ValueError:
        pass
    try:
        numbers = floats("\n".join(values).replace(",", ".").encode())
    except InvalidMeshError as error:
        raise InvalidMeshError(f"the {format} file has a bad coordinate: {error}") from None
    if len(numbers) != len(values):
        raise InvalidMeshError(f"the {format} file has a coordinate that is no number")
    return numbers


def as_integers(values: Sequence[str], *, format: str) -> IntArray:
    """Read indices that each stand in an attribute or element of their own.

    Parameters
    ----------
    values : sequence of str
        Whole numbers.
    format : str
        For messages.

    Returns
    -------
    (count,) int64
        One for each value.

    Raises
    ------
    InvalidMeshError
        One is no whole number.
    """
    try:
        return np.array(values, dtype=np.int64)
    except (ValueError, OverflowError):
        pass
    try:
        numbers = integers("\n".join(values).encode())
    except InvalidMeshError as error:
        raise InvalidMeshError(f"the {format} file has a bad index: {error}") from None
    if len(numbers) != len(values):
        raise InvalidMeshError(f"the {format} file has an index that is no number")
    return numbers


def _without_blanks_before(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Pieces without blanks or byte order marks before the first tag."""
    begun = False
    for piece in pieces:
        rest = piece if begun else piece.lstrip(b" \t\r\n\xef\xbb\xbf")
        begun = begun or bool(rest)
        yield rest


def _feed(parser: expat.XMLParserType, pieces: Iterable[bytes]) -> None:
    """Parse all pieces, with as much at a time as an unfinished tag or comment is long.

    expat before 2.6 reads an unfinished one from its beginning each time something is added, so
    small pieces would take the square of its length.
    """
    waiting: list[bytes] = []
    n_waiting = n_parsed = 0
    for piece in pieces:
        waiting.append(piece)
        n_waiting += len(piece)
        if n_waiting >= n_parsed - max(parser.CurrentByteIndex, 0):
            parser.Parse(b"".join(waiting), False)
            n_parsed += n_waiting
            waiting, n_waiting = [], 0
    parser.Parse(b"".join(waiting), True)
