"""GIFTI surfaces (.surf.gii): one pointset and its triangles."""

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.surfaces.polygons import require_faces, require_indices
from workers.geometry.formats.text.tokens import floats, integral, quoted
from workers.geometry.formats.unpacking.encoded import Allowance, decode_base64, unpack_zlib
from workers.geometry.formats.xml.stream import read_xml
from workers.geometry.mesh import TriangleMesh

ROOT = re.compile(rb"<(?:\w+:)?GIFTI\b")
LOOKED_AT = 4096  # bytes
TYPES = {
    **{"UINT8": "u1", "INT8": "i1", "INT16": "i2", "UINT16": "u2", "INT32": "i4"},
    **{"UINT32": "u4", "INT64": "i8", "UINT64": "u8", "FLOAT32": "f4", "FLOAT64": "f8"},
}
POINTSET, TRIANGLE = "POINTSET", "TRIANGLE"


@dataclass
class _Arrays:
    """Takes up the data arrays of a file."""

    first: dict[str, tuple[dict[str, str], list[str]]] = field(default_factory=dict)
    intents: list[str] = field(default_factory=list)
    attributes: dict[str, str] = field(default_factory=dict)
    collected: list[str] | None = None

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up the beginning of an element."""
        if tag == "DataArray":
            self.attributes = attributes
            self.intents.append(attributes.get("Intent", "").upper().removeprefix("NIFTI_INTENT_"))
        elif tag == "Data" and self.intents:
            intent = self.intents[-1]
            if intent in (POINTSET, TRIANGLE) and intent not in self.first:
                self.collected = []
                self.first[intent] = self.attributes, self.collected

    def end(self, tag: str) -> None:
        """Take up the end of an element."""
        if tag == "Data":
            self.collected = None

    def text(self, piece: str) -> None:
        """Take up a piece of text."""
        if self.collected is not None:
            self.collected.append(piece)


OLD_ENCODINGS = {
    "B64BIN": "BASE64BINARY",
    "B64GZ": "GZIPBASE64BINARY",
    "EXTBIN": "EXTERNALFILEBINARY",
}
"""As the first GIFTI library wrote them, behind GIFTI_ENCODING_."""


def is_gifti(data: bytes) -> bool:
    """Whether the root element is GIFTI's.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        True also for files of values alone, which reading refuses by name.
    """
    head = data[:LOOKED_AT].lstrip()
    return head.startswith(b"<") and ROOT.search(head) is not None


def read_gifti(data: bytes, limits: MeshLimits) -> Reading:
    """Read the first surface of a GIFTI file; coordinates stay as they are in the file.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces, and most bytes that are unpacked.

    Returns
    -------
    Reading
        Vertices and triangles in the order of the file.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    arrays = _Arrays()
    read_xml(data, arrays, "GIFTI", plain_doctype=True)
    _require_surface(arrays)
    allowance = Allowance(limits.unpacked)
    points = _table(*arrays.first[POINTSET], allowance)
    vertices = as_floats(points).reshape(-1, 3)
    limits.check(vertices=len(vertices))
    corners = _indices(_table(*arrays.first[TRIANGLE], allowance))
    limits.check(faces=len(corners) // 3)
    require_faces(len(vertices), len(corners) // 3)
    require_indices(corners, np.arange(len(corners)) // 3, len(vertices))
    return Reading(TriangleMesh(vertices, corners), found=_found(arrays))


def _require_surface(arrays: _Arrays) -> None:
    """Raise where there are no points or no triangles."""
    if TRIANGLE in arrays.first and POINTSET in arrays.first:
        return
    if POINTSET in arrays.first:
        what = "points without triangles"
    elif TRIANGLE in arrays.first:
        what = "triangles without points"
    else:
        what = f"values ({quoted(arrays.intents[0].encode())})" if arrays.intents else "no array"
    raise UnsupportedFormatError(
        f"the GIFTI file has {what}, no surface; upload the surface (.surf.gii) it belongs to"
    )


def _found(arrays: _Arrays) -> tuple[str, ...]:
    """Say what else there is."""
    found = []
    for intent, noun in ((POINTSET, "pointsets"), (TRIANGLE, "lists of triangles")):
        times = arrays.intents.count(intent)
        if times > 1:
            found.append(f"{times} {noun}, of which the first is read")
    values = len(arrays.intents) - arrays.intents.count(POINTSET) - arrays.intents.count(TRIANGLE)
    if values:
        found.append(f"{values} arrays of values" if values > 1 else "1 array of values")
    return tuple(found)


def _table(attributes: dict[str, str], text: list[str], allowance: Allowance) -> NDArray[Any]:
    """Numbers of an array of three columns, row after row."""
    shape = _shape(attributes)
    encoding = attributes.get("Encoding", "ASCII").upper().removeprefix("GIFTI_ENCODING_")
    encoding = OLD_ENCODINGS.get(encoding, encoding)
    if "EXTERNAL" in encoding:
        raise UnsupportedFormatError(
            "the numbers of the GIFTI file are in another file (ExternalFileBinary); "
            "convert it to one file, for example by wb_command or mris_convert"
        )
    content = "".join(text).encode()
    if encoding == "ASCII":
        values: NDArray[Any] = floats(content)
    else:
        values = _decoded(content, encoding, attributes, shape, allowance)
    if len(values) != shape[0] * shape[1]:
        raise InvalidMeshError(
            f"an array of the GIFTI file declares {shape[0]:,} × {shape[1]} numbers, "
            f"but has {len(values):,}: it is truncated or damaged"
        )
    order = attributes.get("ArrayIndexingOrder", "RowMajorOrder").lower()
    if order.startswith("column"):
        return values.reshape(shape, order="F").ravel()
    return values


def _shape(attributes: dict[str, str]) -> tuple[int, int]:
    """Rows and columns that an array declares; there must be three columns."""
    sizes = [attributes.get(f"Dim{axis}", "").strip() for axis in (0, 1)]
    if not (sizes[0].isascii() and sizes[0].isdigit() and len(sizes[0]) <= 15):
        raise InvalidMeshError(f"expected an array's Dim0, found {quoted(sizes[0].encode())}")
    if sizes[1] == "" and int(sizes[0]) % 3 == 0:  # one dimension
        return int(sizes[0]) // 3, 3
    if sizes[1] != "3":
        raise InvalidMeshError(f"expected 3 columns, found {quoted(sizes[1].encode())}")
    return int(sizes[0]), 3


def _decoded(
    content: bytes,
    encoding: str,
    attributes: dict[str, str],
    shape: tuple[int, int],
    allowance: Allowance,
) -> NDArray[Any]:
    """Numbers of base64, packed or not."""
    name = attributes.get("DataType", "").upper().removeprefix("NIFTI_TYPE_")
    if name not in TYPES:
        raise InvalidMeshError(f"expected a type such as FLOAT32, found {quoted(name.encode())}")
    endian = attributes.get("Endian", "").lower().removeprefix("gifti_endian_")
    big = endian.startswith("big")
    type = (">" if big else "<") + TYPES[name]
    data = decode_base64(content)
    if encoding.startswith("GZIP"):
        data = unpack_zlib(data, shape[0] * shape[1] * int(type[2]), allowance)
    elif not encoding.startswith("BASE64"):
        found = quoted(encoding.encode())
        raise InvalidMeshError(f"expected an encoding such as Base64Binary, found {found}")
    return np.frombuffer(data, type, len(data) // int(type[2]))


def _indices(values: NDArray[Any]) -> IntArray:
    """Vertex indices of numbers of any type."""
    whole: FloatArray = as_floats(values) if values.dtype.kind == "f" else np.zeros(0)
    return integral(whole) if values.dtype.kind == "f" else values.astype(np.int64)
