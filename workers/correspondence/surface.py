"""A surface as the correspondence uses it: area 1, distances from points, a basis of functions."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.geodesics import farthest_points, surface_graph
from workers.geometry.mesh import TriangleMesh
from workers.geometry.normals import vertex_normals
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum
from workers.geometry.topology import is_closed

APART = 4.0
"""Distance between components, in √A: farther than any two points of most surfaces."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A working mesh of area 1 with points spread over it.

    Attributes
    ----------
    mesh : TriangleMesh
        Of n vertices, scaled to area 1.
    spectrum : Spectrum
        Of this mesh.
    unit : float
        √A of the mesh as it was given, in its own unit.
    components : (n,) int64
        Label of each vertex, from 0.
    points : (s,) int64
        Vertices, each farthest along the surface from those before it.
    distances : (s, n) float64
        From each point to every vertex; `APART` between components.
    cells : (n,) int64
        The point that is nearest to each vertex, by its place in ``points``.
    """

    mesh: TriangleMesh
    spectrum: Spectrum
    unit: float
    components: IntArray
    points: IntArray
    distances: FloatArray
    cells: IntArray

    @classmethod
    def of(cls, solution: Solution, n_points: int) -> "Surface":
        """Take it of a solution.

        Parameters
        ----------
        solution : Solution
            Working mesh and spectrum, in any unit.
        n_points : int
            s; all n vertices where there are fewer.

        Returns
        -------
        Surface
            Of area 1.
        """
        unit = float(np.sqrt(solution.spectrum.area))
        mesh = TriangleMesh(solution.mesh.vertices / unit, solution.mesh.faces)
        graph = surface_graph(mesh)
        has_functions = solution.spectrum.n_eigenpairs > 0
        start = int(solution.farthest_points(1)[0]) if has_functions else 0
        found = farthest_points(graph, n_points, start=start, reach=np.inf)
        components = connected_components(graph, directed=False)[1].astype(np.int64)
        return cls(
            mesh=mesh,
            spectrum=solution.spectrum.rescaled(1.0 / unit),
            unit=unit,
            components=components,
            points=found.vertices,
            distances=np.minimum(found.distances, APART),
            cells=found.cells,
        )

    def with_points(self, count: int) -> "Surface":
        """Keep the first points alone.

        Parameters
        ----------
        count : int
            How many, at least 1.

        Returns
        -------
        Surface
            The same mesh.
        """
        distances = self.distances[:count]
        cells = distances.argmin(axis=0)
        return replace(self, points=self.points[:count], distances=distances, cells=cells)

    @cached_property
    def graph(self) -> sparse.csr_array:
        """Lengths of edges and of straight lines across them, (n, n)."""
        return surface_graph(self.mesh)

    @cached_property
    def mutual(self) -> FloatArray:
        """Distances between the points, (s, s)."""
        between: FloatArray = self.distances[:, self.points]
        return between

    @cached_property
    def weights(self) -> FloatArray:
        """Area of the cell of each point, (s,); the sum is 1."""
        return summed(self.cells, self.spectrum.areas, len(self.points))

    @cached_property
    def is_closed(self) -> bool:
        """Whether it has no boundary."""
        return is_closed(self.mesh)

    @cached_property
    def normals(self) -> FloatArray:
        """Of the vertices, (n, 3)."""
        return vertex_normals(self.mesh)

    @cached_property
    def spacing(self) -> float:
        """Mean length of an edge."""
        return float(edge_lengths(self.mesh.vertices, undirected_edges(self.mesh)).mean())

    @cached_property
    def basis(self) -> FloatArray:
        """Orthonormal functions (n, c + k): a constant for each component, then eigenfunctions."""
        count = int(self.components.max()) + 1
        sizes = np.bincount(self.components, weights=self.spectrum.areas, minlength=count)
        constants = np.zeros((self.mesh.n_vertices, count))
        here = np.arange(self.mesh.n_vertices), self.components
        constants[here] = 1.0 / np.sqrt(sizes[self.components])
        return np.concatenate([constants, self.spectrum.eigenvectors], axis=1)

    @cached_property
    def frequencies(self) -> FloatArray:
        """Eigenvalues of the functions of the basis, (c + k,): 0 of constants."""
        count = self.basis.shape[1] - self.spectrum.n_eigenpairs
        return np.concatenate([np.zeros(count), self.spectrum.eigenvalues])

    def averaged(self, amounts: FloatArray, time: float) -> FloatArray:
        """Spread what lies at the vertices over the surface, as heat spreads.

        Parameters
        ----------
        amounts : (n,) or (n, c) float64
            Integrals over the areas of the vertices.
        time : float
            t; the amounts spread about √(4t) wide.

        Returns
        -------
        (n,) or (n, c) float64
            Densities.
        """
        parts = self.basis.T @ amounts
        decay = np.exp(-time * self.frequencies)
        decayed = decay * parts if parts.ndim == 1 else decay[:, None] * parts
        densities: FloatArray = self.basis @ decayed
        return densities

    def spread(self, count: int) -> IntArray:
        """Vertices of all cells alike: for sums over the surface.

        Parameters
        ----------
        count : int
            How many; all n vertices where there are fewer.

        Returns
        -------
        (count,) int64
            Vertex indices.
        """
        n = self.mesh.n_vertices
        places = np.unique(np.linspace(0, n - 1, min(count, n)).round().astype(np.int64))
        order: IntArray = np.argsort(self.cells, kind="stable")
        return order[places]


def summed(owners: IntArray, amounts: FloatArray, count: int) -> FloatArray:
    """Sums of the amounts of each owner.

    Parameters
    ----------
    owners : (q,) int64
        From 0 to ``count`` - 1.
    amounts : (q,) float64
        In any unit.
    count : int
        How many owners there are.

    Returns
    -------
    (count,) float64
        In the unit of the amounts; 0 where there are none.
    """
    sums: FloatArray = np.bincount(owners, amounts, minlength=count).astype(np.float64)
    return sums
