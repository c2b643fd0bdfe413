"""Meshes put side by side in one space, counted before anything is allocated."""

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.surfaces.polygons import require_indices
from workers.geometry.mesh import TriangleMesh


class Placing:
    """Collects placed meshes.

    Parameters
    ----------
    limits : MeshLimits
        Most vertices and faces, all together.

    Attributes
    ----------
    n_vertices, n_faces : int
        How many there are.
    """

    def __init__(self, limits: MeshLimits) -> None:
        self._limits = limits
        self._vertices: list[FloatArray] = []
        self._faces: list[IntArray] = []
        self.n_vertices = self.n_faces = 0

    def add(self, vertices: FloatArray, faces: IntArray, transform: FloatArray) -> None:
        """Add one mesh.

        Parameters
        ----------
        vertices : (n, 3) float64
            Positions.
        faces : (m, 3) int64
            Indices of vertices, not checked before.
        transform : (4, 4) float64
            Multiplies columns; where it mirrors, faces are turned round.

        Raises
        ------
        InvalidMeshError
            A face that refers to a vertex that there is not.
        UploadTooLargeError
            More vertices or faces than the limits allow.
        """
        n_vertices, n_faces = self.n_vertices + len(vertices), self.n_faces + len(faces)
        self._limits.check(vertices=n_vertices, faces=n_faces)
        require_indices(faces.ravel(), np.repeat(np.arange(len(faces)), 3), len(vertices))
        with np.errstate(all="ignore"):  # infinite coordinates are cleaning's to report
            self._vertices.append(vertices @ transform[:3, :3].T + transform[:3, 3])
            mirrors = np.linalg.det(transform[:3, :3]) < 0
        self._faces.append((faces[:, ::-1] if mirrors else faces) + self.n_vertices)
        self.n_vertices, self.n_faces = n_vertices, n_faces

    def mesh(self) -> TriangleMesh:
        """Put all together.

        Returns
        -------
        TriangleMesh
            Vertices and faces in the order in which they were added; at least one was.
        """
        return TriangleMesh(np.concatenate(self._vertices), np.concatenate(self._faces))
