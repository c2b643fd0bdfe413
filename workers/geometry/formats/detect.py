"""Which format bytes are in: the content decides, the file's ending only breaks ties."""

import re

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats.amf.package import is_amf
from workers.geometry.formats.gltf import is_glb, is_gltf
from workers.geometry.formats.obj import is_obj
from workers.geometry.formats.off import begins_with_counts, is_off
from workers.geometry.formats.ply import is_ply
from workers.geometry.formats.refusals.refusal import refused_content, refused_ending
from workers.geometry.formats.signs import by_sign, by_sign_of_text
from workers.geometry.formats.stl import is_binary_stl, is_text_stl
from workers.geometry.formats.text.encodings import readable
from workers.geometry.formats.threemf import is_3mf

SOMETHING = re.compile(rb"[^\0 \t\r\n]")
LOOKED_AT = 1 << 16  # bytes of text from the beginning
EXPECTED = "expected OFF, OBJ, PLY, STL, GLB, glTF, 3MF, AMF, DAE, VTK or MSH"


def detect_format(data: bytes, filename: str = "") -> str:
    """Find the format of the bytes.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Its ending is believed only where the content says nothing.

    Returns
    -------
    str
        One of the names of `workers.geometry.formats.parsing.READERS`.

    Raises
    ------
    InvalidMeshError
        Nothing there.
    UnsupportedFormatError
        Content of no known format.
    """
    refused = refused_content(data, filename)
    if not SOMETHING.search(data):
        raise InvalidMeshError(refused or f"the file is empty ({len(data)} bytes); {EXPECTED}")
    if refused:
        raise UnsupportedFormatError(refused)
    content = readable(data).data
    found = _by_magic(content) or _by_text(content) or _by_ending(content, filename)
    if found is None:
        raise UnsupportedFormatError(
            refused_ending(data, filename) or f"the content is of no known mesh format; {EXPECTED}"
        )
    return found


def _by_magic(data: bytes) -> str | None:
    """Format by the first bytes or the exact length."""
    if is_glb(data):
        return "glb"
    if is_gltf(data):
        return "gltf"
    if data.startswith(b"PK\x03\x04"):
        if is_3mf(data):
            return "3mf"
        if is_amf(data):
            return "amf"
        raise UnsupportedFormatError("the content is a zip archive without a 3MF model part")
    if is_off(data):
        return "off"
    if is_ply(data):
        return "ply"
    if signed := by_sign(data):
        return signed
    return "stl" if is_binary_stl(data) else None


def _by_text(data: bytes) -> str | None:
    """Format by what the beginning reads like."""
    head = data[:LOOKED_AT].rstrip(b"\0\x1a")
    if is_text_stl(head):
        return "stl"
    if b"\0" in head:
        return None
    return "obj" if is_obj(head) else None


def _by_ending(data: bytes, filename: str) -> str | None:
    """Format by the ending, if the content could be of it."""
    if signed := by_sign_of_text(data, filename):
        return signed
    ending = filename.rpartition(".")[2].lower()
    text = b"\0" not in data[:LOOKED_AT]
    if ending == "stl":
        is_stl = not text or len(data) >= 84 or re.match(rb"\s*solid\b", data) is not None
        return ending if is_stl else None
    if ending == "off":
        return ending if begins_with_counts(data) else None
    if ending == "obj":
        return ending if text and re.search(rb"^[ \t]*[vf][ \t]", data, re.MULTILINE) else None
    return None
