"""STL, binary and text: a soup of triangles, three vertices of its own for each."""

import re

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.polygons import require_faces
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.tokens import floats
from workers.geometry.mesh import TriangleMesh

HEADER = 84  # 80 bytes of anything, then the number of triangles
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
VERTEX = re.compile(rb"\bvertex\b([^\r\n]*)", re.IGNORECASE)


def is_binary_stl(data: bytes) -> bool:
    """Whether the declared number of triangles is just as long as the file.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    bool
        False for a binary STL with something behind its triangles.
    """
    if len(data) < HEADER:
        return False
    return len(data) == HEADER + TRIANGLE.itemsize * int.from_bytes(data[80:HEADER], "little")


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
    starts_solid = re.match(rb"\s*solid\b", data, re.IGNORECASE) is not None
    if starts_solid and b"\0" not in data[:1024] and not is_binary_stl(data):
        return _read_text(data, limits)
    if len(data) < HEADER:
        raise InvalidMeshError(f"binary STL has at least {HEADER} bytes, the file has {len(data)}")
    n_faces = int.from_bytes(data[80:HEADER], "little")
    limits.check(faces=n_faces)
    needed = HEADER + n_faces * TRIANGLE.itemsize
    if needed > len(data):
        raise InvalidMeshError(
            f"the file declares {n_faces:,} triangles, which take {needed:,} bytes, "
            f"but it has {len(data):,}: it is truncated or no STL"
        )
    require_faces(0, n_faces)
    corners = np.frombuffer(data, dtype=TRIANGLE, count=n_faces, offset=HEADER)["corners"]
    return Reading(_soup(corners.astype(np.float64)))


def _read_text(data: bytes, limits: MeshLimits) -> Reading:
    """Mesh of an STL file in text."""
    rows = VERTEX.findall(data)
    limits.check(faces=len(rows) // 3)
    require_faces(0, len(rows))
    if len(rows) % 3:
        raise InvalidMeshError(f"the file ends within facet {len(rows) // 3}: it is truncated")
    coordinates = floats(b"\n".join(rows))
    if len(coordinates) != 3 * len(rows):
        raise InvalidMeshError("a vertex of the STL file has not 3 coordinates")
    if not re.search(rb"\bendsolid\b", data[-4096:], re.IGNORECASE):
        raise InvalidMeshError("the STL file ends without 'endsolid': it is truncated")
    return Reading(_soup(coordinates.reshape(-1, 3, 3)))


def _soup(corners: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> TriangleMesh:
    """Mesh of separate triangles (m, 3, 3)."""
    faces = np.arange(3 * len(corners), dtype=np.int64).reshape(-1, 3)
    return TriangleMesh(corners.reshape(-1, 3), faces)
