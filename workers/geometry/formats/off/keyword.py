"""The keyword that an OFF file begins with, and what its prefix says of a vertex."""

import re
from dataclasses import dataclass

from workers.errors import InvalidMeshError
from workers.geometry.formats.text.numbers import without_comments

LOOKED_AT = 1 << 16  # bytes
KEYWORD = re.compile(rb"\s*((?:ST|[CN4n])*OFF)(?=[\s\d]|\Z)")
OTHER_CASE = re.compile(rb"\s*((?:ST|[CN4])*OFF)(?=\s*\d|[ \t]+BINARY\b)", re.IGNORECASE)
BINARY = re.compile(
    rb"(?:\s|#[^\r\n]*[\r\n])*((?:ST|[CN4n])*OFF)[ \t]+BINARY[ \t]*(?:#[^\r\n]*)?(?:\r\n|\n|\r)",
    re.IGNORECASE,
)
COUNTS = re.compile(rb"\s*\d+\s+\d+(?:[ \t]+\d+)?[ \t]*[\r\n]")
SPACE = 3  # coordinates


@dataclass(frozen=True)
class Layout:
    """What stands for each vertex.

    Attributes
    ----------
    keyword : str
        As in the file, "" where there is none.
    homogeneous : bool
        Whether a fourth coordinate divides the other three.
    has_dimension : bool
        Whether the number of coordinates stands before the counts.
    normals, colours, textures : bool
        What follows the coordinates, in this order.
    """

    keyword: str
    homogeneous: bool = False
    has_dimension: bool = False
    normals: bool = False
    colours: bool = False
    textures: bool = False

    @property
    def n_coordinates(self) -> int:
        """Coordinates of a vertex, the one that divides with them."""
        return SPACE + self.homogeneous

    @property
    def widths(self) -> tuple[int, ...]:
        """Numbers a vertex may have; a colour has 4 by the format's text, others write 3."""
        others = self.n_coordinates + SPACE * self.normals + 2 * self.textures
        return (others + 4, others + 3) if self.colours else (others,)

    @property
    def found(self) -> tuple[str, ...]:
        """What is left alone."""
        return tuple(
            what
            for is_there, what in (
                (self.normals, "vertex normals"),
                (self.colours, "vertex colours"),
                (self.textures, "vertex texture coordinates"),
            )
            if is_there
        )

    @property
    def repairs(self) -> tuple[str, ...]:
        """What is unusual with the keyword."""
        if not self.keyword:
            return ("the file does not begin with OFF: read as OFF, after its name",)
        if self.keyword.endswith("OFF"):
            return ()
        return (f"read the keyword '{self.keyword}' as {self.keyword.upper()}",)

    def require_space(self, dimension: int) -> None:
        """Raise ``InvalidMeshError`` where vertices do not lie in space.

        Parameters
        ----------
        dimension : int
            As the file says.

        Raises
        ------
        InvalidMeshError
            It is not 3.
        """
        if dimension != SPACE:
            raise InvalidMeshError(
                f"{self.keyword} has {dimension} coordinates a vertex; expected 3, as in OFF"
            )


def read_keyword(text: bytes) -> tuple[Layout, int]:
    """Read the keyword of a text.

    Parameters
    ----------
    text : bytes
        Without comments.

    Returns
    -------
    layout : Layout
        What the keyword says; that of OFF where there is none.
    end : int
        Where the keyword ends, in bytes.
    """
    found = KEYWORD.match(text) or OTHER_CASE.match(text)
    if found is None:
        return Layout(""), 0
    return layout_of(found[1]), found.end()


def layout_of(keyword: bytes) -> Layout:
    """Tell what a keyword says of the vertices.

    Parameters
    ----------
    keyword : bytes
        Such as ``STCN4nOFF``, or ``coff``, whose letters are read as capitals.

    Returns
    -------
    Layout
        What stands for each vertex.
    """
    name = keyword.decode("ascii")
    prefix = (name if name.endswith("OFF") else name.upper())[:-3]
    textures = "ST" in prefix
    rest = prefix.replace("ST", "")
    return Layout(name, "4" in rest, "n" in rest, "N" in rest, "C" in rest, textures)


def is_off(data: bytes) -> bool:
    """Tell whether a file begins as OFF, text or binary.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.

    Returns
    -------
    bool
        Whether the keyword stands where it should.
    """
    head = data[:LOOKED_AT]
    if BINARY.match(head):
        return True
    text = without_comments(head)
    return b"\0" not in head and bool(KEYWORD.match(text) or OTHER_CASE.match(text))


def begins_with_counts(data: bytes) -> bool:
    """Tell whether a file can be OFF without its keyword.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.

    Returns
    -------
    bool
        Whether it begins with two or three whole numbers.
    """
    head = data[:LOOKED_AT]
    return b"\0" not in head and bool(COUNTS.match(without_comments(head)))
