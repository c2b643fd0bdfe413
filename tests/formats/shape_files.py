"""Kinds of files whose bytes are right and whose shape is not: strays, seams, T-junctions."""

import numpy as np

from tests.formats.kinds import BODY, kind
from tests.meshes import triangle_soup
from workers.geometry.arrays import FloatArray
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh

FORMAT = "Any format"
FAR = "Faces are left out that lie 10,000 times as far away as everything else."
NOT_FINITE = "Faces at such vertices are left out, up to a tenth of all."


def with_stray(place: float, size: float) -> TriangleMesh:
    """The body and one triangle somewhere."""
    corners = place + size * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    face = BODY.n_vertices + np.arange(3)
    return TriangleMesh(
        np.concatenate([BODY.vertices, corners]), np.concatenate([BODY.faces, [face]])
    )


def stl(mesh: TriangleMesh) -> bytes:
    """Binary STL of any coordinates."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(mesh.n_faces, dtype=record)
    records["corners"] = mesh.vertices[mesh.faces]
    return bytes(80) + np.uint32(mesh.n_faces).tobytes() + records.tobytes()


@kind(FORMAT, "a small stray triangle far away", FAR, repairs=("left out 1 face",))
def small_stray() -> bytes:
    return write(with_stray(1e9, 1.0), "off")


@kind(FORMAT, "a huge stray triangle far away", FAR, repairs=("left out 1 face",))
def huge_stray() -> bytes:
    return write(with_stray(3.4e37, 1e37), "ply")


@kind(FORMAT, "a triangle of NaN", NOT_FINITE, repairs=("1 face (0.078 % of all)",))
def nan_triangle() -> bytes:
    return stl(with_stray(np.nan, 1.0))


@kind(FORMAT, "infinite coordinates", NOT_FINITE, repairs=("1 face (0.078 % of all)",))
def infinite_triangle() -> bytes:
    return write(with_stray(np.inf, 1.0), "ply")


@kind(FORMAT, "NaN at vertices without faces", "Such vertices are dropped.")
def nan_without_faces() -> bytes:
    strange: FloatArray = np.full((7, 3), np.nan)
    return write(TriangleMesh(np.concatenate([BODY.vertices, strange]), BODY.faces), "ply")


@kind(FORMAT, "triangles that share no vertices", "Vertices in the same place are one.")
def soup() -> bytes:
    return write(triangle_soup(BODY), "obj")
