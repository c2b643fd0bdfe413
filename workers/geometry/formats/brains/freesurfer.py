"""FreeSurfer's binary surfaces (lh.pial, rh.white): triangles, and quads of old versions."""

import struct
from collections.abc import Iterator

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.surfaces.polygons import require_faces, require_indices
from workers.geometry.mesh import TriangleMesh

TRIANGLES, QUADS, FLOAT_QUADS = b"\xff\xff\xfe", b"\xff\xff\xff", b"\xff\xff\xfd"
PATCH = b"\xff\xff\xff\xff"
LONGEST_COMMENT = 1 << 13  # bytes before the counts
MOST_LINES = 16
HUNDREDTHS = 100.0  # of the coordinates of the oldest files
NO_SURFACE = "upload the surface it belongs to, such as lh.pial or lh.white"


def is_freesurfer(data: bytes) -> bool:
    """Whether the bytes begin as FreeSurfer's surfaces and curvature files do.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    bool
        True also for files of values alone, which reading refuses by name.
    """
    if data.startswith(TRIANGLES):
        return len(data) >= 11
    if data.startswith(PATCH):
        return _is_patch(data)
    return data[:3] in (QUADS, FLOAT_QUADS) and (_is_curvature(data) or _has_quads(data))


def read_freesurfer(data: bytes, limits: MeshLimits) -> Reading:
    """Read a surface of FreeSurfer; coordinates stay as they are in the file.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Quads are cut as FreeSurfer cuts them.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    if _is_patch(data):
        raise UnsupportedFormatError(
            f"the file is a FreeSurfer patch, which has no triangles; {NO_SURFACE}"
        )
    if data.startswith(TRIANGLES):
        return _read_triangles(data, limits)
    if _is_curvature(data):
        raise UnsupportedFormatError(
            "the file holds FreeSurfer values on vertices (such as curv, sulc or thickness), "
            f"no surface; {NO_SURFACE}"
        )
    return _read_quads(data, limits)


def _is_curvature(data: bytes) -> bool:
    """Whether this is a file of values, which begins like one of quads."""
    if not data.startswith(QUADS) or len(data) < 15:
        return False
    n_vertices, _, n_values = struct.unpack_from(">iii", data, 3)
    return bool(n_values >= 1 and len(data) == 15 + 4 * n_vertices * n_values)


def _is_patch(data: bytes) -> bool:
    """Whether this is a flattened piece: indices and points alone."""
    n_points = int.from_bytes(data[4:8], "big")
    return data.startswith(PATCH) and len(data) >= 8 and len(data) == 8 + 16 * n_points


def _has_quads(data: bytes) -> bool:
    """Whether the counts of a file of quads fit its length."""
    n_vertices, n_quads = (int.from_bytes(data[i : i + 3], "big") for i in (3, 6))
    width = 12 if data.startswith(FLOAT_QUADS) else 6
    return n_vertices > 0 and n_quads > 0 and 9 + width * n_vertices + 12 * n_quads <= len(data)


def _read_triangles(data: bytes, limits: MeshLimits) -> Reading:
    """Read vertices of three floats and triangles, behind lines of text."""
    begin = _counts_of_triangles(data)
    n_vertices, n_faces = struct.unpack_from(">ii", data, begin)
    limits.check(vertices=n_vertices, faces=n_faces)
    require_faces(n_vertices, n_faces)
    position, end = begin + 8, begin + 8 + 12 * (n_vertices + n_faces)
    check_length(end - position, len(data) - position, vertices=n_vertices, faces=n_faces)
    vertices = as_floats(np.frombuffer(data, ">f4", 3 * n_vertices, position))
    faces = np.frombuffer(data, ">i4", 3 * n_faces, position + 12 * n_vertices).astype(np.int64)
    found = ("the geometry of the scan",) if b"valid = " in data[end : end + 4096] else ()
    return Reading(_mesh(vertices, faces), found=found)


def _counts_of_triangles(data: bytes) -> int:
    """Find the two counts: behind an empty line, as a rule, or behind another line of text."""
    places = list(_places(data))
    for place in places:
        n_vertices, n_faces = struct.unpack_from(">ii", data, place)
        if min(n_vertices, n_faces) > 0 and place + 8 + 12 * (n_vertices + n_faces) <= len(data):
            return place
    if not places:
        raise InvalidMeshError("the FreeSurfer surface ends before its counts: it is truncated")
    return places[0]


def _places(data: bytes) -> Iterator[int]:
    """Where the counts may begin, the likeliest first."""
    position = 3
    for _ in range(MOST_LINES):
        line_end = data.find(b"\n", position, 3 + LONGEST_COMMENT)
        if line_end < 0:
            break
        position = line_end + 1
        empty = data.startswith(b"\n", position)
        for place in (position + 1, position) if empty else (position,):
            if place + 8 <= len(data):
                yield place
    if len(data) >= 11:
        yield 3  # without any line of text


def _read_quads(data: bytes, limits: MeshLimits) -> Reading:
    """Read vertices of hundredths or floats, and quads of three bytes an index."""
    if len(data) < 9:
        raise InvalidMeshError("the FreeSurfer surface ends before its counts: it is truncated")
    n_vertices, n_quads = (int.from_bytes(data[i : i + 3], "big") for i in (3, 6))
    limits.check(vertices=n_vertices, faces=2 * n_quads)
    require_faces(n_vertices, n_quads)
    type, divisor = (">f4", 1.0) if data.startswith(FLOAT_QUADS) else (">i2", HUNDREDTHS)
    width = 3 * int(type[2])
    needed = width * n_vertices + 12 * n_quads
    check_length(needed, len(data) - 9, vertices=n_vertices, faces=2 * n_quads)
    vertices = as_floats(np.frombuffer(data, type, 3 * n_vertices, 9)) / divisor
    index_bytes = np.frombuffer(data, np.uint8, 12 * n_quads, 9 + width * n_vertices)
    quads = index_bytes.reshape(-1, 4, 3).astype(np.int64) @ [65536, 256, 1]  # (q, 4)
    odd = quads[:, :1] % 2 == 1
    first = np.where(odd, quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
    second = np.where(odd, quads[:, [0, 2, 3]], quads[:, [2, 3, 1]])
    faces = np.stack([first, second], axis=1)  # (q, 2, 3)
    return Reading(_mesh(vertices, faces.ravel()), found=(f"{n_quads:,} quads, cut in two",))


def _mesh(vertices: FloatArray, corners: IntArray) -> TriangleMesh:
    """Mesh of flat arrays, its indices checked."""
    require_indices(corners, np.arange(len(corners)) // 3, len(vertices) // 3)
    return TriangleMesh(vertices, corners)
