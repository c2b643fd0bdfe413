"""Content that is no readable mesh, by name, with what to do instead."""

import re

from workers.geometry.formats.refusals.signs import (
    COMPOUND,
    FREECAD,
    GCODE,
    NUMPY,
    OF_COMPOUND,
    OF_UNKNOWN_BYTES,
    OF_UNKNOWN_TEXT,
    OFFICE,
    PATTERNS,
    ROOTS,
    SKETCHUP,
    STARTS,
    USD,
    Refused,
)
from workers.geometry.formats.signs import by_sign, by_sign_of_text
from workers.geometry.formats.text.encodings import readable
from workers.geometry.formats.xml.root import split_prolog, xml_root

LOOKED_AT = 1 << 13  # bytes, from the beginning and from the end
LARGEST_POINTER = 1024  # bytes of a pointer or of an error message
LFS_POINTER = re.compile(rb"version https?://(?:git-lfs|hawser|git-media)[^\n]*\n", re.IGNORECASE)
LFS_SIZE = re.compile(rb"^size (\d{1,18})\s*$", re.MULTILINE)
ANNEX_POINTER = re.compile(rb"\s*[^\r\n]{0,512}annex/objects/")
HTML = re.compile(rb"<!DOCTYPE\s+html\b|<(?:html|head|body|script|meta|title|div|iframe)\b", re.I)
ERROR_TEXT = re.compile(
    rb"\s*(?:HTTP/\d|[45]\d\d[ :-]+[a-z]|[\"']?(?:not found|forbidden|access denied|unauthori[sz]ed"
    rb"|bad gateway|error\b|internal server error|too many requests))",
    re.IGNORECASE,
)
GCODE_LINE = re.compile(
    rb"[ \t]*(?:N\d+[ \t]*)?[GMT]\d{1,3}(?:\.\d)?(?:[ \t;(XYZEFSIJKRPTM]|$)", re.I
)
GCODE_ASIDE = re.compile(rb"[ \t]*(?:[;(%].*|O\d+.*)?$")  # comments, a program's name
WEB_PAGE = (
    "the file is a web page, not the file behind it: the download went wrong, download it again "
    "from the page's own link"
)


def refusal(data: bytes, filename: str = "") -> str | None:
    """Say why a file is refused whose content is known to be no readable mesh.

    Looks at the first and last bytes alone, and at the name only where they say nothing.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Its ending names what the content does not.

    Returns
    -------
    str or None
        What the file is and what to do instead, or None where it may be a mesh.
    """
    return refused_content(data, filename) or refused_ending(data, filename)


def refused_content(data: bytes, filename: str = "") -> str | None:
    """Say why a file is refused by its content, as `refusal` does.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Its ending tells apart what begins alike.

    Returns
    -------
    str or None
        None where the content does not say so.
    """
    head = _head(data)
    ending = filename.rpartition(".")[2].lower()
    if head.startswith(b"PK\x03\x04"):
        packed = _of_zip(head, data[-LOOKED_AT:], ending)
        return packed.sentence if packed else None
    if _is_whole_stl(data):
        return None
    found = _by_signs(head, ending)
    if found:
        return found.sentence
    return _nothing(data, head) or _pointer(head, len(data)) or _page(head) or _message(data, head)


def refused_ending(data: bytes, filename: str) -> str | None:
    """Say what a file is whose content no reader and no sign knows.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Its ending names the format.

    Returns
    -------
    str or None
        None for an ending that may be of a mesh.
    """
    head = _head(data)
    starts_as_mesh = re.match(rb"glTF|ply\s|PK\x03\x04|\s*solid\b|\s*\w*OFF\b", head)
    if starts_as_mesh or _is_whole_stl(data) or by_sign(data) or by_sign_of_text(data, filename):
        return None
    endings = OF_UNKNOWN_BYTES if b"\0" in head else OF_UNKNOWN_TEXT
    found = endings.get(filename.rpartition(".")[2].lower())
    if found is not None and re.search(rb"^[ \t]*v[ \t]+[-+.\d]", head, re.MULTILINE):
        return None  # an OBJ file under a strange name
    return found.sentence if found else None


def _head(data: bytes) -> bytes:
    """First bytes; of text in UTF-16, as UTF-8."""
    head = data[:LOOKED_AT]
    return head if head.startswith(SKETCHUP) else readable(head).data


def _by_signs(head: bytes, ending: str) -> Refused | None:
    """Find what begins like this."""
    for start, refused in STARTS:
        if head.startswith(start):
            return refused
    for pattern, refused in PATTERNS:
        if pattern.match(head):
            return OF_COMPOUND.get(ending, COMPOUND) if refused is COMPOUND else refused
    return GCODE if _is_gcode(head) else None


def _is_gcode(head: bytes) -> bool:
    """Whether the first line that is no comment is a command to a machine, and so the next."""
    if b"\0" in head:
        return False
    lines = [line for line in head.splitlines() if not GCODE_ASIDE.match(line)][:2]
    return bool(lines) and all(GCODE_LINE.match(line) for line in lines)


def _is_whole_stl(data: bytes) -> bool:
    """Whether the declared number of triangles is just as long as the file."""
    count = int.from_bytes(data[80:84], "little")
    return count > 0 and len(data) == 84 + 50 * count


def _of_zip(head: bytes, tail: bytes, ending: str) -> Refused | None:
    """Find documents that are zip archives; a zip archive of meshes is none."""
    length = int.from_bytes(head[26:28], "little")
    first = head[30 : 30 + length].lower()
    begins = 30 + length + int.from_bytes(head[28:30], "little")
    if first.endswith((b".usd", b".usda", b".usdc")) and (ending == "usdz" or begins % 64 == 0):
        return USD
    if b"GuiDocument.xml" in tail or (ending == "fcstd" and b"Document.xml" in tail):
        return FREECAD
    if any(name in tail for name in (b"word/document.xml", b"xl/workbook.xml", b"ppt/presentat")):
        return OFFICE
    if first.endswith(b".npy") and ending in ("npz", ""):
        return NUMPY
    return OF_UNKNOWN_BYTES.get(ending)


def _nothing(data: bytes, head: bytes) -> str | None:
    """Name a file without content."""
    if not data:
        return "the file is empty (0 bytes): the upload or download went wrong, send it again"
    if not head.strip(b"\0") and data.count(0) == len(data):
        return (
            f"the file has {len(data):,} bytes, all of them zero: the copy or download went "
            "wrong, send it again"
        )
    if not head.strip() and not data.strip():
        return f"the file is empty ({len(data):,} bytes of blanks): send it again"
    return None


def _pointer(head: bytes, length: int) -> str | None:
    """Name a short text that stands in place of a mesh."""
    if length > LARGEST_POINTER:
        return None
    if LFS_POINTER.match(head):
        size = LFS_SIZE.search(head)
        of = f"of {int(size[1]):,} bytes " if size else ""
        return f"the file is a Git LFS pointer {of}in place of the mesh: run git lfs pull"
    if ANNEX_POINTER.match(head):
        return "the file is a git-annex pointer in place of the mesh: run git annex get"
    if ERROR_TEXT.match(head):
        return (
            f"the file is a server's message in place of the mesh ({_quoted(head)}): the download "
            "went wrong, download it again"
        )
    return None


def _page(head: bytes) -> str | None:
    """Name a web page, or XML that is known to be no mesh."""
    if head.lstrip()[:1] != b"<":
        return None
    if HTML.match(head.lstrip()):
        return WEB_PAGE
    prolog, rest = split_prolog(head)
    if HTML.match(rest) or re.search(rb"<!DOCTYPE\s+html", prolog, re.IGNORECASE):
        return WEB_PAGE
    name = xml_root(head)
    if name in ROOTS:
        return ROOTS[name].sentence
    if name == "error":
        return (
            "the file is a server's error message in XML in place of the mesh: the download went "
            "wrong, download it again"
        )
    return None


def _message(data: bytes, head: bytes) -> str | None:
    """Name JSON that is no glTF."""
    if not re.match(rb"\s*(?:\{\s*[\"}]|\[\s*[\[{\"\d])", head) or b"\0" in head:
        return None
    if b'"asset"' in data:
        return None
    if re.search(rb'"(?:error|message|detail|status|code)"\s*:', head) and len(data) < LOOKED_AT:
        return (
            f"the file is a server's message in JSON in place of the mesh ({_quoted(head)}): the "
            "download went wrong, download it again"
        )
    return "the file is JSON, but no glTF: export the mesh as GLB, OBJ or STL"


def _quoted(head: bytes) -> str:
    """First line in quotes, printable and short."""
    line = head.strip().splitlines()[0][:60].decode("utf-8", "replace")
    return repr("".join(c if c.isprintable() else "?" for c in line))
