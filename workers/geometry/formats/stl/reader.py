"""STL: text or binary, whatever the first word says."""

import re

from workers.errors import InvalidMeshError
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.stl.binary import is_binary_stl, read_binary_stl
from workers.geometry.formats.stl.text import is_text_stl, read_text_stl

NO_TEXT = re.compile(rb"[^\t\n\v\f\r\x1a\x20-\xff]")
LOOKED_AT = 1 << 16


def read_stl(data: bytes, limits: MeshLimits) -> Reading:
    """Read an STL file, text or binary; cleaning merges the vertices.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Three vertices of its own for each triangle, in the order of the file.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    if not is_binary_stl(data):
        starts_solid = re.match(rb"\s*solid\b", data, re.IGNORECASE) is not None
        is_text = NO_TEXT.search(data, 0, LOOKED_AT) is None
        if is_text_stl(data[:LOOKED_AT]) or (starts_solid and is_text):
            return read_text_stl(data, limits)
        if is_text:
            raise InvalidMeshError(
                "the file is text without facets; expected an STL file, text or binary"
            )
    return read_binary_stl(data, limits)
