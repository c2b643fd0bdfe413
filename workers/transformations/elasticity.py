"""Deforms a surface by a field of linear maps: positions that fit the maps best.

This is the global step of as-rigid-as-possible deformation for any field of maps, and its local
step (Sorkine, Alexa: As-rigid-as-possible surface modeling, SGP 2007).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.edges import directed_edges, edge_keys, length_graph
from workers.geometry.elements import LAST, corner_cotangents
from workers.geometry.factorisation import SymmetricFactor
from workers.geometry.mesh import TriangleMesh
from workers.geometry.transfer import closest_points
from workers.transformations.metric import tethered_edges
from workers.transformations.resampling import decimated

# Chosen, not measured.
LARGEST_SOLVED = 30_000  # vertices; a larger mesh follows a coarse one
COARSE = 10_000  # vertices of that
_WEIGHTS = (0.02, 5.0)  # cotangent weights are held within: all positive, none dominates


@dataclass(frozen=True, eq=False)
class Deformation:
    """Where a surface went.

    Attributes
    ----------
    positions : (n, 3) float64
        Of the vertices.
    maps : (n, 3, 3) float64
        Linear map of the surroundings of each vertex.
    """

    positions: FloatArray
    maps: FloatArray


class ElasticSurface:
    """A mesh, its edges with cotangent weights, and the solver of the global step."""

    def __init__(self, mesh: TriangleMesh) -> None:
        """Weigh the edges and factorise."""
        edges, tethers = tethered_edges(mesh)
        self.mesh = mesh
        self.edges = np.concatenate([edges, tethers])  # (e, 2)
        weights = np.concatenate([_edge_weights(mesh, edges), np.ones(len(tethers))])
        n, e = mesh.n_vertices, len(self.edges)
        rows = np.arange(e)
        ends = self.edges.T.ravel()
        signs = np.repeat([1.0, -1.0], e)
        self._difference = sparse.csr_array((signs, (np.tile(rows, 2), ends)), shape=(e, n))
        self._weighted = sparse.csr_array(self._difference.T * weights)  # (n, e)
        self._around = sparse.csr_array(abs(self._weighted))  # (n, e)
        self.laplacian = sparse.csc_array(self._weighted @ self._difference)
        self._vectors = self._difference @ mesh.vertices  # (e, 3)
        self._global = SymmetricFactor(self.laplacian[1:, 1:])

    @property
    def graph(self) -> sparse.csr_array:
        """Lengths of edges and tethers, (n, n)."""
        return length_graph(self.mesh, self.edges)

    def positions(self, maps: FloatArray) -> FloatArray:
        """Positions whose edges are nearest to the mapped edges of the mesh.

        Each edge is mapped by the mean of its ends' maps.

        Parameters
        ----------
        maps : (n, 3, 3) float64
            Linear map of the surroundings of each vertex.

        Returns
        -------
        (n, 3) float64
            In the mesh's unit; the mean of all vertices stays.
        """
        means = 0.5 * (maps[self.edges[:, 0]] + maps[self.edges[:, 1]])  # (e, 3, 3)
        wanted = np.einsum("eij,ej->ei", means, self._vectors)
        right = self._weighted @ wanted  # (n, 3)
        found = np.zeros((self.mesh.n_vertices, 3))  # the first vertex is held at the origin
        found[1:] = self._global.solve(right[1:])
        found += (self.mesh.vertices - found).mean(axis=0)
        return found

    def rotations(self, positions: FloatArray) -> FloatArray:
        """Rotations that fit the edges around each vertex best: the local step.

        Parameters
        ----------
        positions : (n, 3) float64
            Where the vertices went.

        Returns
        -------
        (n, 3, 3) float64
            Orthogonal, of determinant 1.
        """
        now: FloatArray = self._difference @ positions  # (e, 3)
        products = (now[:, :, None] * self._vectors[:, None, :]).reshape(-1, 9)  # (e, 9)
        covariances = (self._around @ products).reshape(-1, 3, 3)
        left, _, right = np.linalg.svd(covariances)
        mirrored = np.linalg.det(left @ right) < 0  # (n,)
        left[mirrored, :, 2] *= -1.0
        rotations: FloatArray = left @ right
        return rotations

    def interpolate(self, held: BoolArray, values: FloatArray) -> FloatArray:
        """Smoothest function that has given values where it is held.

        Parameters
        ----------
        held : (n,) bool
            Vertices whose values are given.
        values : (n, d) float64
            Values at the held vertices; others are ignored.

        Returns
        -------
        (n, d) float64
            Harmonic for the edges' weights where it is not held.
        """
        free = np.flatnonzero(~held)
        result = values.copy()
        if len(free) and held.any():
            rows = self.laplacian[free]
            right = -(rows[:, np.flatnonzero(held)] @ values[held])
            result[free] = SymmetricFactor(rows[:, free]).solve(right)
        return result


def deformed(mesh: TriangleMesh, deform: Callable[[TriangleMesh], Deformation]) -> FloatArray:
    """Positions of a mesh after a deformation that is found on at most 30,000 vertices.

    A larger mesh follows a coarse copy: the maps at the closest point of it move each vertex.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    deform : function
        Finds the `Deformation` of a mesh.

    Returns
    -------
    (n, 3) float64
        In the mesh's unit.
    """
    if mesh.n_vertices <= LARGEST_SOLVED:
        return deform(mesh).positions
    coarse = decimated(mesh, 2 * COARSE).mesh
    found = deform(coarse)
    closest = closest_points(coarse, mesh.vertices)
    offsets = mesh.vertices[:, None] - coarse.vertices[closest.corners]  # (n, 3, 3)
    carried = np.einsum("ncij,ncj->nci", found.maps[closest.corners], offsets)
    carried += found.positions[closest.corners]
    return np.asarray(np.einsum("nc,nci->ni", closest.weights, carried), dtype=np.float64)


def _edge_weights(mesh: TriangleMesh, edges: IntArray) -> FloatArray:
    """Half the sum of the cotangents opposite to each edge, held within limits, (e,)."""
    doubled = np.linalg.norm(mesh.face_normals, axis=1)  # (m,)
    doubled = np.maximum(doubled, np.finfo(np.float64).tiny ** 0.5)
    cotangents = corner_cotangents(mesh.vertices[mesh.faces], doubled)[:, LAST]  # at c, a, b
    halves = np.clip(0.5 * cotangents, -5.0, 5.0).T.ravel()  # (3m,): opposite to ab, bc, ca
    keys = edge_keys(directed_edges(mesh.faces), mesh.n_vertices)  # (3m,)
    which = np.searchsorted(edge_keys(edges, mesh.n_vertices), keys)
    sums = np.bincount(which, halves, len(edges))
    return np.clip(sums, *_WEIGHTS)
