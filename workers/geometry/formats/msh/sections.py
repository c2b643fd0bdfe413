"""The sections of an MSH file and its header."""

import re
from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError

FORMAT = re.compile(rb"\s*(\d+(?:\.\d+)?)\s+(\d+)\s+(\d+)[ \t]*\r?\n?")
SECTION = re.compile(rb"\$([A-Za-z]\w{0,63})[ \t]*(?:\r?\n|\Z)")
VERSIONS = ("1", "2.0", "2.1", "2.2", "4.0", "4.1")


@dataclass(frozen=True)
class MshFile:
    """An MSH file, cut into its sections.

    Attributes
    ----------
    version : str
        Such as "2.2"; "1" where the file does not say so.
    byte_order : str
        "<" or ">", or "" for text.
    data_size : int
        Bytes of a number in a binary file.
    sections : dict of bytes
        By name in lower case; the first of each name.
    unended : tuple of str
        Names of sections without an end.
    """

    version: str
    byte_order: str
    data_size: int
    sections: dict[str, bytes]
    unended: tuple[str, ...]


def read_sections(data: bytes) -> MshFile:
    """Cut a file into its sections.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    MshFile
        Sections are not looked into, but for the header.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError
        No header that makes sense, or a version that is not read.
    """
    sections: dict[str, bytes] = {}
    unended: list[str] = []
    position = 0
    while found := SECTION.search(data, position):
        name = found[1]
        end = data.find(b"$End" + name, found.end())
        if end < 0:
            end = data.find(b"$END" + name.upper(), found.end())
        if end < 0:
            unended.append(name.decode())
        position = len(data) if end < 0 else end + len(name) + 4
        stop = len(data) if end < 0 else end
        sections.setdefault(name.decode().lower(), data[found.end() : stop])
    header = sections.get("meshformat")
    if header is None:
        if "nod" in sections:
            return MshFile("1", "", 8, sections, tuple(unended))
        raise InvalidMeshError("the MSH file has no $MeshFormat; expected it at the beginning")
    return MshFile(*_header(header), sections, tuple(unended))


def _header(text: bytes) -> tuple[str, str, int]:
    """Version, byte order and size of numbers."""
    found = FORMAT.match(text)
    if found is None:
        raise InvalidMeshError("expected a version, a type and a size in the MSH file's header")
    version = found[1].decode()
    version = {"2": "2.0", "4": "4.0"}.get(version, version)
    if version not in VERSIONS:
        raise UnsupportedFormatError(
            f"MSH version {version[:24]} is not read; save it as version 2.2 or 4.1 from Gmsh"
        )
    if int(found[2][:4]) == 0:
        return version, "", 8
    size = int(found[3][:4])
    one = np.frombuffer(text[found.end() : found.end() + 4].ljust(4, b"\0"), "<i4")[0]
    byte_order = {1: "<", 1 << 24: ">"}.get(int(one))
    if byte_order is None or size not in (4, 8):
        raise InvalidMeshError("the binary MSH file does not give its byte order: it is damaged")
    return version, byte_order, size
