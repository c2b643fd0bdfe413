"""The cotangent Laplace-Beltrami operator: stiffness W and lumped areas A of eq. (8)."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.mesh import TriangleMesh

# Corner c of a face lies opposite the edge from corner c + 1 to corner c + 2.
_NEXT = [1, 2, 0]
_LAST = [2, 0, 1]


@dataclass(frozen=True, eq=False)
class Laplacian:
    """The operator of W φ = λ A φ, with natural (Neumann) boundary conditions.

    Attributes
    ----------
    stiffness : (n, n) sparse
        W: symmetric, positive semidefinite, rows sum to 0; free of units.
    areas : (n,) float64
        Diagonal of A: a third of the area of the faces around each vertex, in the mesh's unit
        squared; the sum is the surface area.
    """

    stiffness: sparse.csc_array
    areas: FloatArray

    def __post_init__(self) -> None:
        """Freeze the areas."""
        object.__setattr__(self, "areas", read_only(self.areas, np.float64))


def cotangent_laplacian(corners: FloatArray, faces: IntArray, n_vertices: int) -> Laplacian:
    """Cotangent stiffness and lumped areas of triangles in any dimension, eq. (8).

    The corners are given face by face, so that a surface which does not fit into space (a flat
    torus, unwrapped) can be measured too.

    Parameters
    ----------
    corners : (m, 3, d) float64
        Positions of each face's corners, d >= 2.
    faces : (m, 3) int64
        Vertex of each corner.
    n_vertices : int
        Number of vertices.

    Returns
    -------
    Laplacian

    Raises
    ------
    InvalidMeshError
        A face has no area, a number is not finite, or a vertex belongs to no face.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        cotangents, face_areas = _cotangents(corners)  # (m, 3), (m,)
    if not np.all(np.isfinite(cotangents)):
        bad = int(np.argmin(np.isfinite(cotangents).all(axis=1)))
        raise InvalidMeshError(f"face {bad} has no area or is not finite; expected a clean mesh")
    areas = np.zeros(n_vertices)
    np.add.at(areas, faces, (face_areas / 3.0)[:, None])
    if not np.all(areas > 0.0):
        bad = int(np.argmin(areas > 0.0))
        raise InvalidMeshError(f"vertex {bad} belongs to no face; expected a clean mesh")
    ends = np.sort(np.stack([faces[:, _NEXT], faces[:, _LAST]], axis=2), axis=2)  # (m, 3, 2)
    rows, columns = ends.reshape(-1, 2).T
    upper = sparse.coo_array(
        (-0.5 * cotangents.ravel(), (rows, columns)), shape=(n_vertices, n_vertices)
    ).tocsr()
    off_diagonal = upper + upper.T  # one sum for (i, j) and (j, i): exactly symmetric
    degrees: FloatArray = -np.asarray(off_diagonal.sum(axis=1)).ravel()  # (n,)
    stiffness = sparse.csc_array(off_diagonal + sparse.diags_array(degrees))
    stiffness.sort_indices()
    return Laplacian(stiffness=stiffness, areas=areas)


def mesh_laplacian(mesh: TriangleMesh) -> Laplacian:
    """`cotangent_laplacian` of a clean mesh in space."""
    return cotangent_laplacian(mesh.vertices[mesh.faces], mesh.faces, mesh.n_vertices)


def _cotangents(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cotangent at each corner (m, 3) and area of each face (m,), as dot / |cross|.

    |cross| is the root of the sum of squared 2x2 minors, in any dimension. It is taken at the
    corner between the two shorter edges, where a needle or a flat triangle loses least to rounding.
    """
    to_next = corners[:, _NEXT] - corners  # (m, 3, d): from corner c to corner c + 1
    to_last = -to_next[:, _LAST]  # (m, 3, d): from corner c to corner c + 2
    dots = np.einsum("fcd,fcd->fc", to_next, to_last)  # (m, 3)
    opposite = np.einsum("fcd,fcd->fc", to_next, to_next)[:, _NEXT]  # (m, 3): squared lengths
    faces = np.arange(len(corners))
    apex = np.argmax(opposite, axis=1)  # (m,)
    u, v = to_next[faces, apex], to_last[faces, apex]  # (m, d)
    squared = np.zeros(len(corners))
    for i in range(corners.shape[2]):
        for j in range(i + 1, corners.shape[2]):
            squared += (u[:, i] * v[:, j] - u[:, j] * v[:, i]) ** 2
    double_areas = np.sqrt(squared)  # (m,)
    return dots / double_areas[:, None], 0.5 * double_areas
