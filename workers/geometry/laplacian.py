"""The cotangent Laplace-Beltrami operator: stiffness W and lumped areas A of eq. (8)."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.edges import symmetric_graph
from workers.geometry.elements import LAST, NEXT, corner_cotangents, double_areas, lumped_areas
from workers.geometry.mesh import TriangleMesh


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
        doubled = double_areas(corners)  # (m,)
        cotangents = corner_cotangents(corners, doubled)  # (m, 3)
    if not np.all(np.isfinite(cotangents)):
        bad = int(np.argmin(np.isfinite(cotangents).all(axis=1)))
        raise InvalidMeshError(f"face {bad} has no area or is not finite; expected a clean mesh")
    areas = lumped_areas(faces, 0.5 * doubled, n_vertices)  # (n,)
    if not np.all(areas > 0.0):
        alone = int(np.argmin(areas > 0.0))
        raise InvalidMeshError(f"vertex {alone} belongs to no face; expected a clean mesh")
    opposite: IntArray = np.stack([faces[:, NEXT], faces[:, LAST]], axis=2)  # (m, 3, 2)
    opposite = np.sort(opposite, axis=2)  # one direction: the sums are symmetric to the last bit
    weights = -0.5 * cotangents.ravel()  # (3m,)
    off_diagonal = symmetric_graph(opposite.reshape(-1, 2), weights, n_vertices)
    degrees = -np.asarray(off_diagonal.sum(axis=1), dtype=np.float64)  # (n,)
    stiffness = sparse.csc_array(off_diagonal + sparse.diags_array(degrees))
    stiffness.sort_indices()
    return Laplacian(stiffness=stiffness, areas=areas)


def mesh_laplacian(mesh: TriangleMesh) -> Laplacian:
    """`cotangent_laplacian` of a clean mesh in space.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean: no zero-area face, no unreferenced vertex.

    Returns
    -------
    Laplacian
        W and A of eq. (8).

    Raises
    ------
    InvalidMeshError
        A face has no area, a number is not finite, or a vertex belongs to no face.
    """
    return cotangent_laplacian(mesh.vertices[mesh.faces], mesh.faces, mesh.n_vertices)
