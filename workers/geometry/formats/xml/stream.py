"""XML by expat as a stream: no document type that could declare entities, no recursion."""

from typing import Protocol
from xml.parsers import expat

from workers.errors import InvalidMeshError

TEXT_AT_ONCE = 1 << 20  # characters handed on together


class Handler(Protocol):
    """What takes up the elements and the text."""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up the beginning of an element.

        Parameters
        ----------
        tag : str
            Its name, without a namespace's prefix.
        attributes : dict of str
            As they stand there.
        """

    def end(self, tag: str) -> None:
        """Take up the end of an element.

        Parameters
        ----------
        tag : str
            Its name, without a namespace's prefix.
        """

    def text(self, piece: str) -> None:
        """Take up a piece of text.

        Parameters
        ----------
        piece : str
            Any length.
        """


def read_xml(data: bytes, handler: Handler, name: str, *, plain_doctype: bool = False) -> None:
    """Hand the elements and the text of an XML file to a handler.

    Parameters
    ----------
    data : bytes
        The whole file.
    handler : Handler
        Called in the order of the file.
    name : str
        The format, for messages.
    plain_doctype : bool
        Whether a document type is let through that only names a file. It is never fetched. One
        that declares something itself is refused all the same.

    Raises
    ------
    InvalidMeshError
        Damaged XML, or a document type.
    """

    def doctype(_name: str, _system: str | None, _public: str | None, internal: int) -> None:
        if internal or not plain_doctype:
            raise InvalidMeshError(
                f"the XML of the {name} file has a document type of its own, which is refused"
            )

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.buffer_size = TEXT_AT_ONCE
    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = lambda tag, attributes: handler.start(_local(tag), attributes)
    parser.EndElementHandler = lambda tag: handler.end(_local(tag))
    parser.CharacterDataHandler = handler.text
    try:
        parser.Parse(data.lstrip(), True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise InvalidMeshError(f"the XML of the {name} file is damaged: {error}") from None


def _local(tag: str) -> str:
    """Name of an element without its prefix."""
    return tag.rpartition(":")[2]
