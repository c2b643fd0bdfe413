"""MNI's polygons (the .obj of CIVET and BrainSuite tools), in text."""

import re

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.rows.records import polygons_by_offsets
from workers.geometry.formats.surfaces.polygons import polygon_mesh
from workers.geometry.formats.text.tokens import floats, integral

NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
START = re.compile(rb"\s*P(?:\s+" + NUMBER + rb"){5}\s+\d+\s", re.IGNORECASE)
N_MATERIAL = 5  # ambient, diffuse and specular light, the exponent, and opacity
SHORTEST_VERTEX = len(b"0 0 0 0 0 0\n")  # with its normal


def is_mni(data: bytes) -> bool:
    """Whether the text begins with MNI's ``P``, five numbers and a count.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        False for Wavefront's OBJ, where ``p`` is followed by indices and comes after vertices.
    """
    return data[:64].lstrip()[:1] == b"P" and START.match(data[:4096]) is not None


def read_mni(data: bytes, limits: MeshLimits) -> Reading:
    """Read polygons: points, normals, a colour or more, ends of polygons, indices.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Polygons cut into triangles.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    values = floats(data.lstrip()[1:])
    n_points = _count(values[N_MATERIAL:], "points")
    limits.check(vertices=n_points)
    length = len(data)
    check_length(n_points * SHORTEST_VERTEX, length, vertices=n_points, faces=0)
    begin = N_MATERIAL + 1
    if len(values) < begin + 6 * n_points:
        raise InvalidMeshError(
            f"the MNI file declares {n_points:,} points, but ends before the last of them: "
            "it is truncated"
        )
    vertices = values[begin : begin + 3 * n_points].reshape(-1, 3)
    begin += 6 * n_points
    n_polygons = _count(values[begin:], "polygons")
    limits.check(faces=n_polygons)
    n_colours = {0: 1, 1: n_polygons, 2: n_points}.get(_count(values[begin + 1 :], "colours"))
    if n_colours is None:
        raise InvalidMeshError("expected 0, 1 or 2 before the colours of the MNI file")
    begin += 2 + 4 * n_colours
    ends = integral(values[begin : begin + n_polygons])
    begin += n_polygons
    n_corners = int(ends[-1]) if len(ends) else 0
    corners = integral(values[begin : begin + max(n_corners, 0)])
    if len(ends) < n_polygons or len(corners) < n_corners:
        raise InvalidMeshError(
            f"the MNI file declares {n_polygons:,} polygons, but ends before the last of them: "
            "it is truncated"
        )
    found = ("colours",) if n_colours > 1 else ()
    mesh = polygon_mesh(vertices, polygons_by_offsets(ends, corners), limits)
    return Reading(mesh, found=found)


def _count(values: np.ndarray[tuple[int], np.dtype[np.float64]], noun: str) -> int:
    """First of the numbers, as a count."""
    if len(values) == 0:
        raise InvalidMeshError(f"the MNI file ends before its count of {noun}: it is truncated")
    count = int(integral(values[:1])[0])
    if count < 0:
        raise InvalidMeshError(f"the MNI file declares {count} {noun}")
    return count
