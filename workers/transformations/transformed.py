"""A deformed mesh that knows which vertex each of its vertices was."""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from workers.geometry.mesh import TriangleMesh

# Chosen, not measured.
FEWEST_FACES = 50  # that a cut leaves, where there were as many


@dataclass(frozen=True, eq=False)
class TransformedMesh:
    """A deformed mesh and where its vertices come from; the array is read-only.

    Attributes
    ----------
    mesh : TriangleMesh
        n' vertices, each of which has a face.
    origin : (n',) int64
        Index of the vertex of the given mesh that each vertex corresponds to. Only a scan, which
        may be finer than the mesh, has one index at several vertices.
    """

    mesh: TriangleMesh
    origin: IntArray

    def __post_init__(self) -> None:
        """Freeze the origin."""
        object.__setattr__(self, "origin", read_only(self.origin, np.int64))

    def then(self, later: "TransformedMesh") -> "TransformedMesh":
        """What a later transformation made of this mesh, with origins in the first one.

        Parameters
        ----------
        later : TransformedMesh
            Made of this mesh.

        Returns
        -------
        TransformedMesh
            The later mesh.
        """
        return TransformedMesh(later.mesh, self.origin[later.origin])


def moved(mesh: TriangleMesh, vertices: FloatArray) -> TransformedMesh:
    """The mesh with its vertices elsewhere.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    vertices : (n, 3) float64
        Where they are.

    Returns
    -------
    TransformedMesh
        Without the vertices that have no face.
    """
    return part(TriangleMesh(vertices, mesh.faces), np.ones(mesh.n_faces, dtype=np.bool_))


def part(mesh: TriangleMesh, kept: BoolArray) -> TransformedMesh:
    """The faces that are kept, and the vertices they use.

    Parameters
    ----------
    mesh : TriangleMesh
        Of m faces.
    kept : (m,) bool
        Which faces stay.

    Returns
    -------
    TransformedMesh
        Vertices and faces in their order.
    """
    used, faces = np.unique(mesh.faces[kept], return_inverse=True)
    return TransformedMesh(TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3)), used)
