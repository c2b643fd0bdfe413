"""The triangle mesh, as it travels through all layers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray, cross, lengths, read_only

AT_A_TIME = 1 << 14  # faces


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A triangle mesh; its arrays are read-only.

    Attributes
    ----------
    vertices : (n, 3) float64
        Positions, in the unit of the file.
    faces : (m, 3) int64
        Vertex indices; not checked here, see ``formats`` and ``cleaning``.
    """

    vertices: FloatArray
    faces: IntArray

    def __post_init__(self) -> None:
        """Freeze the arrays and give them their shapes."""
        vertices = read_only(np.reshape(self.vertices, (-1, 3)), np.float64)
        faces = read_only(np.reshape(self.faces, (-1, 3)), np.int64)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return len(self.faces)

    @property
    def face_normals(self) -> FloatArray:
        """Cross products of two edges a face, (m, 3): twice the area long."""
        normals = np.empty((self.n_faces, 3))
        for start in range(0, self.n_faces, AT_A_TIME):
            normals[start : start + AT_A_TIME] = self._normals_from(start)
        return normals

    @property
    def face_areas(self) -> FloatArray:
        """Area a face, (m,), in the square of the mesh's unit."""
        areas = np.empty(self.n_faces)
        for start in range(0, self.n_faces, AT_A_TIME):
            areas[start : start + AT_A_TIME] = lengths(self._normals_from(start))
        areas *= 0.5
        return areas

    def _normals_from(self, start: int) -> FloatArray:
        """Normals of some faces: what is computed of them stays in the processor's cache."""
        faces = self.faces[start : start + AT_A_TIME]
        first, *others = (self.vertices.take(faces[:, i], axis=0) for i in range(3))
        for corners in others:
            corners -= first
        return cross(*others)

    @cached_property
    def area(self) -> float:
        """Surface area, in the square of the mesh's unit."""
        return float(self.face_areas.sum())
