"""Meshes to bytes: OFF, OBJ, PLY, STL and GLB."""

import json
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats.gltf import BINARY_CHUNK, JSON_CHUNK
from workers.geometry.formats.stl import HEADER
from workers.geometry.formats.stl import TRIANGLE as STL_TRIANGLE
from workers.geometry.mesh import TriangleMesh

PLY_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
FLOAT, UNSIGNED_INT, ARRAY_BUFFER, ELEMENT_BUFFER = 5126, 5125, 34962, 34963


def write(mesh: TriangleMesh, format: str) -> bytes:
    """File of this mesh, vertices and faces in their order (STL stores a soup).

    OFF, OBJ and PLY keep every bit of the coordinates; STL and GLB store float32.

    Raises
    ------
    UnsupportedFormatError
        A format that is not one of ``WRITTEN_FORMATS``.
    InvalidMeshError
        Coordinates that a float32 cannot hold, for STL and GLB.
    """
    if format not in _WRITERS:
        raise UnsupportedFormatError(
            f"meshes are written as {', '.join(WRITTEN_FORMATS)}, not as {format[:20]!r}"
        )
    return _WRITERS[format](mesh)


def _write_off(mesh: TriangleMesh) -> bytes:
    """OFF with the shortest decimals that read back the same."""
    rows = [f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0"]
    rows += [f"{x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.faces.tolist()]
    return ("\n".join(rows) + "\n").encode("ascii")


def _write_obj(mesh: TriangleMesh) -> bytes:
    """OBJ, counting from 1."""
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    rows += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
    return ("\n".join(rows) + "\n").encode("ascii")


def _write_ply(mesh: TriangleMesh) -> bytes:
    """Write binary little-endian PLY with doubles."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {mesh.n_vertices}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {mesh.n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(mesh.n_faces, dtype=PLY_FACE)
    faces["count"], faces["corners"] = 3, mesh.faces
    return header.encode("ascii") + mesh.vertices.astype("<f8").tobytes() + faces.tobytes()


def _write_stl(mesh: TriangleMesh) -> bytes:
    """Write binary STL with unit normals."""
    normals = mesh.face_normals
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    triangles = np.zeros(mesh.n_faces, dtype=STL_TRIANGLE)
    triangles["normal"] = normals / np.where(lengths > 0, lengths, 1.0)
    triangles["corners"] = _single(mesh)[mesh.faces]
    head = b"binary STL".ljust(HEADER - 4, b"\0") + mesh.n_faces.to_bytes(4, "little")
    return head + triangles.tobytes()


def _write_glb(mesh: TriangleMesh) -> bytes:
    """GLB of one node and one mesh; two buffer views, positions then indices."""
    positions = _single(mesh)
    points, corners = positions.tobytes(), mesh.faces.astype("<u4").tobytes()
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "Proteus"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {
                **{"bufferView": 0, "componentType": FLOAT, "type": "VEC3"},
                "count": mesh.n_vertices,
                "min": positions.min(axis=0).tolist(),
                "max": positions.max(axis=0).tolist(),
            },
            {
                **{"bufferView": 1, "componentType": UNSIGNED_INT, "type": "SCALAR"},
                "count": 3 * mesh.n_faces,
            },
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(points), "target": ARRAY_BUFFER},
            {
                **{"buffer": 0, "byteOffset": len(points), "byteLength": len(corners)},
                "target": ELEMENT_BUFFER,
            },
        ],
        "buffers": [{"byteLength": len(points) + len(corners)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode("ascii")
    body = _chunk(JSON_CHUNK, text, b" ") + _chunk(BINARY_CHUNK, points + corners, b"\0")
    return b"glTF" + _unsigned(2) + _unsigned(12 + len(body)) + body


def _chunk(kind: int, content: bytes, padding: bytes) -> bytes:
    """Chunk of a GLB file, padded to four bytes."""
    content += padding * (-len(content) % 4)
    return _unsigned(len(content)) + _unsigned(kind) + content


def _unsigned(value: int) -> bytes:
    """Little-endian unsigned 32-bit integer."""
    return value.to_bytes(4, "little")


def _single(mesh: TriangleMesh) -> "np.ndarray[Any, np.dtype[np.float32]]":
    """Positions (n, 3) as float32, or ``InvalidMeshError`` where that overflows."""
    if mesh.n_vertices == 0 or not (np.abs(mesh.vertices) < np.finfo(np.float32).max).all():
        raise InvalidMeshError("the mesh has no vertices, or coordinates too large for float32")
    return mesh.vertices.astype("<f4")


_WRITERS: Mapping[str, Callable[[TriangleMesh], bytes]] = MappingProxyType(
    {
        "off": _write_off,
        "obj": _write_obj,
        "ply": _write_ply,
        "stl": _write_stl,
        "glb": _write_glb,
    }
)
WRITTEN_FORMATS: tuple[str, ...] = tuple(_WRITERS)
