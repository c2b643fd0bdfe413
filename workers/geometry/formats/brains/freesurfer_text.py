"""FreeSurfer's surfaces in text (.asc, .srf), and its other texts, refused by name."""

import re

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.polygons import require_faces, require_indices
from workers.geometry.formats.text.tokens import floats, integral, quoted
from workers.geometry.mesh import TriangleMesh

COMMENTS = re.compile(rb"\s*(?:#[^\r\n]*[\r\n]+\s*)*")
COUNTS = re.compile(rb"\s*(\d{1,15})[ \t]+(\d{1,15})[ \t]*[\r\n]")
ASCII = re.compile(rb"\s*#!ascii\b", re.IGNORECASE)
LOOKED_AT = 4096  # bytes
SHORTEST_ROW = len(b"0 0 0 0\n")


def is_freesurfer_text(data: bytes) -> bool:
    """Whether the text begins with FreeSurfer's ``#!ascii``.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        True also for labels and patches, which reading refuses by name.
    """
    return ASCII.match(data[:LOOKED_AT]) is not None


def looks_like_freesurfer_text(data: bytes) -> bool:
    """Whether a text named .asc or .srf begins with two counts and a row of four numbers.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        True where rows of points alone are unlikely.
    """
    head = data[:LOOKED_AT]
    comments = COMMENTS.match(head)
    counts = COUNTS.match(head, comments.end() if comments else 0)
    if counts is None:
        return False
    row = head[counts.end() :].lstrip().splitlines()[:1]
    return bool(row) and len(row[0].split()) == 4


def read_freesurfer_text(data: bytes, limits: MeshLimits) -> Reading:
    """Read a surface: two counts, rows ``x y z 0``, rows ``a b c 0``.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        In the order of the file.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    first = data[:LOOKED_AT].lstrip().splitlines()[0].lower()
    for word in (b"label", b"patch"):
        if word in first and is_freesurfer_text(data) and b" surf" not in first:
            raise UnsupportedFormatError(
                f"the file is a FreeSurfer {word.decode()}, which has no triangles; "
                "upload the surface it belongs to, such as lh.pial or lh.white"
            )
    comments = COMMENTS.match(data)
    body = data[comments.end() if comments else 0 :]
    counts = COUNTS.match(body)
    if counts is None:
        found = quoted(body.splitlines()[0] if body else b"")
        raise InvalidMeshError(f"expected the counts of vertices and triangles, found {found}")
    n_vertices, n_faces = int(counts[1]), int(counts[2])
    limits.check(vertices=n_vertices, faces=n_faces)
    require_faces(n_vertices, n_faces)
    n_rows = n_vertices + n_faces
    needed = n_rows * SHORTEST_ROW - 1
    check_length(needed, len(body) - counts.end(), vertices=n_vertices, faces=n_faces)
    values = floats(body[counts.end() :])
    if len(values) < 4 * n_rows:
        raise InvalidMeshError(
            f"the file declares {n_rows:,} rows of 4 numbers, but has {len(values):,} numbers: "
            "it is truncated"
        )
    table = values[: 4 * n_rows].reshape(-1, 4)
    corners = integral(table[n_vertices:, :3].ravel())
    require_indices(corners, np.arange(len(corners)) // 3, n_vertices)
    more = len(values) - 4 * n_rows
    repairs = (f"{more:,} numbers follow the last triangle; left out",) if more else ()
    return Reading(TriangleMesh(table[:n_vertices, :3], corners), repairs)
