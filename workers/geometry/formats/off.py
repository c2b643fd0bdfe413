"""OFF: text, with every prefix whose vertices begin with x y z."""

import re

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.polygons import polygon_mesh
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.tokens import Polygons, floats, integers, polygon_lines, quoted

KEYWORD = re.compile(rb"\s*((?:ST)?C?N?4?n?OFF)")
COMMENT = re.compile(rb"#[^\r\n]*")
SHORTEST_VERTEX, SHORTEST_FACE = len(b"0 0 0\n"), len(b"0\n")


def read_off(data: bytes, limits: MeshLimits) -> Reading:
    """Read an OFF file: comments, colours, normals, polygons, any line ends, no keyword needed.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Vertices in the order of the file, polygons cut into triangles.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    text = COMMENT.sub(b"", data) if b"#" in data else data
    keyword = KEYWORD.match(text)
    if keyword and (b"4" in keyword[1] or b"n" in keyword[1]):
        name = keyword[1].decode("ascii")
        raise InvalidMeshError(f"{name} has more coordinates a vertex; expected 3, as in OFF")
    body = text[keyword.end() :] if keyword else text
    lines = [line for line in body.splitlines() if line and not line.isspace()]
    n_vertices, n_faces = _counts(lines[0] if lines else b"")
    limits.check(vertices=n_vertices, faces=n_faces)
    needed = n_vertices * SHORTEST_VERTEX + n_faces * SHORTEST_FACE - 1
    check_length(needed, len(body) - len(lines[0]), vertices=n_vertices, faces=n_faces)
    rows = lines[1:]
    if len(rows) >= n_vertices + n_faces:
        vertices = _vertex_lines(rows[:n_vertices])
        polygons = polygon_lines(rows[n_vertices : n_vertices + n_faces])
    else:
        vertices, polygons = _stream(b"\n".join(rows), n_vertices, n_faces)
    return Reading(polygon_mesh(vertices, polygons, limits))


def _counts(line: bytes) -> tuple[int, int]:
    """Numbers of vertices and faces of the line ``vertices faces [edges]``."""
    tokens = line.split()
    if not (2 <= len(tokens) <= 3 and all(token.isdigit() for token in tokens)):
        found = quoted(line.strip()) if tokens else "nothing"
        raise InvalidMeshError(
            f"expected OFF's numbers of vertices, faces and edges, found {found}"
        )
    if max(len(token) for token in tokens) > 15:
        raise InvalidMeshError(f"OFF's counts {quoted(line.strip())} are no sensible numbers")
    return int(tokens[0]), int(tokens[1])


def _vertex_lines(lines: list[bytes]) -> FloatArray:
    """Positions (n, 3) of lines ``x y z [anything]``."""
    if not lines:
        return np.zeros((0, 3))
    width = len(lines[0].split())
    values = floats(b"\n".join(lines))
    if width >= 3 and len(values) == width * len(lines):
        return values.reshape(-1, width)[:, :3]
    first_three = [line.split(None, 3)[:3] for line in lines]
    for vertex, tokens in enumerate(first_three):
        if len(tokens) < 3:
            raise InvalidMeshError(f"vertex {vertex} has {len(tokens)} coordinates; expected 3")
    return floats(b"\n".join(b" ".join(tokens) for tokens in first_three)).reshape(-1, 3)


def _stream(text: bytes, n_vertices: int, n_faces: int) -> tuple[FloatArray, Polygons]:
    """Vertices and polygons of a file that does not put each on its own line (no colours)."""
    values = floats(text)
    if len(values) < 3 * n_vertices + n_faces:
        raise InvalidMeshError(
            f"the file declares {n_vertices:,} vertices and {n_faces:,} faces, "
            f"but ends after {len(values):,} numbers: it is truncated"
        )
    tail = integers(b" ".join(text.split()[3 * n_vertices :])).tolist()
    counts: list[int] = []
    corners: list[int] = []
    position = 0
    for face in range(n_faces):
        count = tail[position] if position < len(tail) else 0
        if position >= len(tail) or count < 0 or position + 1 + count > len(tail):
            raise InvalidMeshError(
                f"the file ends within face {face} of {n_faces}: it is truncated"
            )
        counts.append(count)
        corners.extend(tail[position + 1 : position + 1 + count])
        position += 1 + count
    polygons = Polygons(np.array(counts, dtype=np.int64), np.array(corners, dtype=np.int64))
    return values[: 3 * n_vertices].reshape(-1, 3), polygons
