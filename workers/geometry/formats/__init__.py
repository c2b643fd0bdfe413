"""Mesh files of many formats, read from hostile bytes, and written in five.

`parse` is the only entrance: whatever the bytes are, it returns a mesh or raises
``InvalidMeshError``, ``UnsupportedFormatError`` or ``UploadTooLargeError``.
"""

from workers.geometry.formats.detect import detect_format
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.parsing import ParsedMesh, parse
from workers.geometry.formats.writing import WRITTEN_FORMATS, write

__all__ = ["WRITTEN_FORMATS", "MeshLimits", "ParsedMesh", "detect_format", "parse", "write"]
