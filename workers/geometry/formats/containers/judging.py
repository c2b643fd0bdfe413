"""Whether a file among others is tried as a mesh, or skipped."""

import io
import re

from workers.errors import ProteusError
from workers.geometry.formats.containers.clutter import (
    SYSTEM,
    ending_of,
    kind_by_name,
    kind_if_no_mesh,
    system_file,
)
from workers.geometry.formats.containers.compression import HEAD, compression_of, unpacked_head
from workers.geometry.formats.detect import detect_format
from workers.geometry.formats.naming import MESH_ENDINGS, inner_name
from workers.geometry.formats.refusals.refusal import refusal
from workers.geometry.formats.text.encodings import readable

ARCHIVE_ENDINGS = frozenset({"zip", "tar", "tgz", "tbz", "tbz2", "txz", "tlz"})
UNPACKED_TO_JUDGE = 1 << 20  # bytes of a compressed file whose ending says nothing
OBJ_VERTEX = re.compile(rb"^[ \t]*v(?:[ \t]+[-+]?[\d.]+(?:e[-+]?\d+)?){3,}", re.MULTILINE | re.I)
OBJ_FACE = re.compile(rb"^[ \t]*f(?:[ \t]+-?\d+(?:/-?\d*){0,2}){3,}", re.MULTILINE)
OFF_BEGINS = re.compile(
    rb"\s*(?:#[^\r\n]*[\r\n]\s*)*(?:ST)?C?N?4?n?OFF\s+"
    rb"(?:BINARY\s|(?:#[^\r\n]*[\r\n]\s*)*\d+\s+\d+)",
    re.IGNORECASE,
)


def has_mesh_ending(path: str) -> bool:
    """Whether a file's name ends as those of meshes do, compressed or not.

    Such a file is tried, and fails with its reason.

    Parameters
    ----------
    path : str
        With ``/`` between names.

    Returns
    -------
    bool
        True for ``cat.ply`` and ``cat.ply.gz``.
    """
    return ending_of(inner_name(path)) in MESH_ENDINGS


def has_archive_ending(path: str) -> bool:
    """Whether a file's name ends as those of archives do.

    Parameters
    ----------
    path : str
        With ``/`` between names.

    Returns
    -------
    bool
        True also for a compressed file of no known ending, which may be an archive.
    """
    inner = inner_name(path)
    ending = ending_of(inner)
    return ending in ARCHIVE_ENDINGS or (inner != path and ending not in MESH_ENDINGS)


def why_skipped_by_name(path: str) -> str | None:
    """Say what a file is that is skipped whatever it holds.

    Parameters
    ----------
    path : str
        With ``/`` between names.

    Returns
    -------
    str or None
        "system file", "picture", "text" and so on; None where the content decides.
    """
    return SYSTEM if system_file(path) else kind_by_name(path)


def why_skipped(path: str, data: bytes) -> str | None:
    """Say what a file is that is no mesh, by its name and its content.

    Parameters
    ----------
    path : str
        With ``/`` between names.
    data : bytes
        The whole file.

    Returns
    -------
    str or None
        In short, or as a sentence that says what to do; None for what is tried as a mesh.
    """
    if known := why_skipped_by_name(path):
        return known
    if has_mesh_ending(path) or is_mesh_by_content(data, path):
        return None
    return refusal(data, path) or kind_if_no_mesh(path)


def is_mesh_by_content(data: bytes, path: str = "") -> bool:
    """Whether the content is that of a mesh, beyond what a text may be by accident.

    Parameters
    ----------
    data : bytes
        The whole file.
    path : str
        Its name.

    Returns
    -------
    bool
        False also for a mesh that nothing but its ending tells.
    """
    compression = compression_of(data[:HEAD], path)
    if compression:
        data = unpacked_head(io.BytesIO(data), compression, UNPACKED_TO_JUDGE)
        path = inner_name(path)
    data = readable(data).data
    try:
        found = detect_format(data, path)
    except ProteusError:
        return False
    if found == "obj":
        text = data.replace(b"\r", b"\n")
        return len(OBJ_VERTEX.findall(text[: 1 << 16])) >= 3 and OBJ_FACE.search(text) is not None
    return found != "off" or OFF_BEGINS.match(data) is not None
