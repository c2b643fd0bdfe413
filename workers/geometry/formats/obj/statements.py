"""The lines of an OBJ file: vertices and faces, and what else there is."""

import re
from collections import defaultdict
from dataclasses import dataclass

from workers.geometry.formats.text.numerals import without_number_signs

# Only v and f go on behind a backslash. In other lines it ends a Windows path, and in front of
# another statement it means nothing.
STATEMENT = rb"(?:[vflpogs]|v[tnp]|fo|usemtl|mtllib|#)(?:[ \t\n]|\Z)"
CONTINUED = re.compile(
    rb"^[ \t]*(?:v|fo?)[ \t][^\n#\\]*(?:\\[ \t]*\n(?![ \t]*" + STATEMENT + rb")[^\n#\\]*)+",
    re.MULTILINE | re.IGNORECASE,
)
ENDING_BACKSLASH = re.compile(
    rb"^([ \t]*(?:v|fo?)[ \t][^\n#\\]*)\\[ \t]*$", re.MULTILINE | re.IGNORECASE
)
CONTINUATION = re.compile(rb"\\[ \t]*\n")
# A vertex or a face; some writers put no blank behind the letter.
ELEMENT = re.compile(
    rb"^[ \t]*([vf])(?:o(?=[ \t]))?(?=[ \t]|[-+.\d])[ \t]*([^\n#]*)", re.MULTILINE | re.IGNORECASE
)
NUMBER = rb"[-+.\d][^ \t\n]*"
SIGN = re.compile(
    rb"^[ \t]*(?:v[ \t]+[-+.\d]|v" + NUMBER + 2 * (rb"[ \t]+" + NUMBER) + rb"|"
    rb"fo?[ \t]+-?\d[/\d-]*[ \t]+-?\d[/\d-]*[ \t]+-?\d)",
    re.MULTILINE | re.IGNORECASE,
)
OTHER = re.compile(
    rb"^[ \t]*(o|g|l|p|usemtl|mtllib|curv2?|surf)[ \t]+([^\n]*)", re.MULTILINE | re.IGNORECASE
)
TEXTURE_COORDINATES = re.compile(rb"^[ \t]*vt[ \t]", re.MULTILINE | re.IGNORECASE)
LONGEST_NAME = 60


@dataclass(frozen=True, eq=False)
class Others:
    """What is neither a vertex nor a face.

    Attributes
    ----------
    bodies : dict of str to list of bytes
        Bodies of the lines that are named to people, by keyword.
    has_texture : bool
        Whether there are texture coordinates.
    """

    bodies: dict[str, list[bytes]]
    has_texture: bool

    def count(self, *keywords: str) -> int:
        """Count lines with these keywords.

        Parameters
        ----------
        *keywords : str
            In lower case.

        Returns
        -------
        int
            All of them together.
        """
        return sum(len(self.bodies.get(keyword, ())) for keyword in keywords)

    def found(self) -> tuple[str, ...]:
        """Say what is left alone.

        Returns
        -------
        tuple of str
            In short: "2 materials (body.mtl)", "3 objects".
        """
        parts = [
            _counted("object", len(set(self.bodies.get("o", ()))), at_least=2),
            _counted("group", len(set(self.bodies.get("g", ()))), at_least=2),
            self._materials(),
            "texture coordinates" if self.has_texture else "",
            _counted("line", self.count("l")),
            _counted("point", self.count("p")),
            _counted("free-form curve", self.count("curv", "curv2")),
            _counted("free-form surface", self.count("surf")),
        ]
        return tuple(part for part in parts if part)

    def _materials(self) -> str:
        """Count the materials, with the file that they are in."""
        materials = _counted("material", len(set(self.bodies.get("usemtl", ()))))
        libraries = self.bodies.get("mtllib")
        if not libraries:
            return materials
        name = libraries[0].strip().decode("utf-8", "replace")[:LONGEST_NAME]
        printable = "".join(c for c in name if c.isprintable())
        return f"{materials or 'materials'} ({printable})"


@dataclass(frozen=True, eq=False)
class Statements:
    """What the lines of a file say.

    Attributes
    ----------
    vertices, faces : list of bytes
        Bodies of the lines: numbers between blanks.
    is_vertex : list of bool
        Which of all vertices and faces, in the file's order, are vertices.
    others : Others
        All other lines.
    """

    vertices: list[bytes]
    faces: list[bytes]
    is_vertex: list[bool]
    others: Others


def is_obj(head: bytes) -> bool:
    """Whether text has a line that is a vertex or a face of an OBJ file.

    Parameters
    ----------
    head : bytes
        The file's beginning, of text.

    Returns
    -------
    bool
        False where comments fill the beginning.
    """
    return SIGN.search(head.replace(b"\r", b"\n")) is not None


def read_statements(data: bytes) -> Statements:
    r"""Split a file into its statements, whatever its line ends are.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    Statements
        Lines of ``v`` and ``f`` that end in a backslash go on in the next line.
    """
    text = without_number_signs(data.rstrip(b"\0\x1a"))
    if b"\r" in text:
        text = text.replace(b"\r\r\n", b"\n").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\\" in text:
        text = CONTINUED.sub(lambda found: CONTINUATION.sub(b" ", found[0]), text)
        text = ENDING_BACKSLASH.sub(rb"\1", text)
    elements = ELEMENT.findall(text)
    is_vertex = [kind in b"vV" for kind, _ in elements]
    return Statements(
        [body for (_, body), flag in zip(elements, is_vertex, strict=True) if flag],
        [body for (_, body), flag in zip(elements, is_vertex, strict=True) if not flag],
        is_vertex,
        read_others(text),
    )


def read_others(text: bytes) -> Others:
    r"""Find the statements that are named to people.

    Parameters
    ----------
    text : bytes
        Lines that end in ``\n``; vertices and faces may be among them.

    Returns
    -------
    Others
        What they say.
    """
    bodies: dict[str, list[bytes]] = defaultdict(list)
    for keyword, body in OTHER.findall(text):
        bodies[keyword.decode("ascii").lower()].append(body.strip())
    return Others(dict(bodies), TEXTURE_COORDINATES.search(text) is not None)


def _counted(noun: str, count: int, *, at_least: int = 1) -> str:
    """Count things in words; nothing below ``at_least``."""
    return f"{count:,} {noun}{'s' if count != 1 else ''}" if count >= at_least else ""
