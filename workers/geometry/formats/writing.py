"""Meshes to bytes: OFF, OBJ, PLY, STL and GLB."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import cast

import numpy as np
import trimesh

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.mesh import TriangleMesh

PLY_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write(mesh: TriangleMesh, format: str) -> bytes:
    """Write a mesh as a file, vertices and faces in their order (STL stores loose triangles).

    OFF, OBJ and PLY keep every bit of the coordinates; STL and GLB store float32.

    Parameters
    ----------
    mesh : TriangleMesh
        What to write.
    format : str
        One of ``WRITTEN_FORMATS``.

    Returns
    -------
    bytes
        The whole file.

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
    stl = cast(bytes, _single(mesh).export(file_type="stl"))
    return stl


def _write_glb(mesh: TriangleMesh) -> bytes:
    """GLB of one node and one mesh: positions and indices, nothing else."""
    glb = cast(bytes, _single(mesh).export(file_type="glb", include_normals=False))
    return glb


def _single(mesh: TriangleMesh) -> trimesh.Trimesh:
    """Mesh for formats of single precision, or ``InvalidMeshError`` where that overflows."""
    if mesh.n_vertices == 0 or not (np.abs(mesh.vertices) < np.finfo(np.float32).max).all():
        raise InvalidMeshError("the mesh has no vertices, or coordinates too large for float32")
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


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
