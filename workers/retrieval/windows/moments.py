"""Moments of geodesic windows: what the surface looks like around a point, within a radius.

A window is a weight that falls from 1 at its point to 0 at the radius R along the surface:
w = (1 - d²/R²)². What lies in it is the same on a part of a shape and on the whole, as long as it
does not reach the cut. Moments are integrated over midpoints of edges: sums over vertices depend
more on the mesh (decision 0036).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, lengths
from workers.geometry.edges import face_edge_keys
from workers.geometry.mesh import TriangleMesh

NUMBERS = 7
"""Numbers of a window: see `windows`."""

STEADY = (1, 2, 4, 5)
"""Those that change little where the window reaches a boundary."""

_INNER = 0.6  # of the radius: within it the mean normal is taken
_SIDEWAYS, _STRAIGHT = 0.2, 0.7  # cosines from which a face begins to count, and counts in full
_FAINTEST = 1e-6  # of the mass of a flat disc
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True, eq=False)
class EdgeMasses:
    """Midpoints of edges with the area that each stands for.

    Attributes
    ----------
    ends : (e, 2) int64
        Vertices of each edge.
    normals : (e, 3) float64
        Mean of the adjacent faces' normals, by area, as long as the mass.
    moments : (e, 10) float64
        Mass, mass times position, and mass times products of two coordinates. The mass is a third
        of the adjacent faces' area.
    on_boundary : (e,) bool
        Whether only one face has the edge.
    """

    ends: IntArray
    normals: FloatArray
    moments: FloatArray
    on_boundary: BoolArray

    @classmethod
    def of(cls, mesh: TriangleMesh) -> "EdgeMasses":
        """Take them of a mesh.

        Parameters
        ----------
        mesh : TriangleMesh
            With at least one face.

        Returns
        -------
        EdgeMasses
            In ascending order of the edges.
        """
        keys = face_edge_keys(mesh.faces, mesh.n_vertices)
        found, owners, counts = np.unique(keys, return_inverse=True, return_counts=True)
        ends = np.stack(np.divmod(found, mesh.n_vertices), axis=1)
        mass = np.bincount(owners, np.tile(mesh.face_areas, 3)) / 3.0
        own = mesh.face_normals / 6.0  # a third of the face's area long
        sums = [np.bincount(owners, np.tile(own[:, i], 3)) for i in range(3)]
        normals = np.stack(sums, axis=1).astype(np.float64)
        middle = 0.5 * (mesh.vertices[ends[:, 0]] + mesh.vertices[ends[:, 1]])
        products = np.stack([middle[:, i] * middle[:, j] for i, j in _PAIRS], axis=1)
        moments = mass[:, None] * np.column_stack([np.ones(len(mass)), middle, products])
        return cls(ends, normals, moments, counts == 1)

    @cached_property
    def directions(self) -> FloatArray:
        """The normals, of length 1 but where faces cancel out, (e, 3)."""
        long = np.maximum(lengths(self.normals), np.finfo(np.float64).tiny)
        directions: FloatArray = self.normals / long[:, None]
        return directions


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of several radii around points.

    Attributes
    ----------
    numbers : (s, r, 7) float64
        Of each point and radius: see `windows`.
    truncation : (s, r) float64
        Largest weight on the open boundary: 0 for a window that does not reach it.
    """

    numbers: FloatArray
    truncation: FloatArray


def windows(
    mesh: TriangleMesh,
    masses: EdgeMasses,
    points: IntArray,
    distances: FloatArray,
    radii: FloatArray,
    *,
    facing: bool,
) -> Windows:
    """Describe windows around points by seven numbers each.

    They are ln of the mass over that of a flat disc; how far the centre of mass lies above the
    point along the mean normal, over R; the square roots of the three eigenvalues of the
    covariance, over R, descending; the length of the mean normal; how far the centre of mass lies
    aside, over R.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices; of area 1, as the radii have it.
    masses : EdgeMasses
        Of this mesh.
    points : (s,) int64
        Vertices.
    distances : (s, n) float64
        Along the surface, from each point to all vertices within the largest radius.
    radii : (r,) float64
        Ascending.
    facing : bool
        Whether only what faces the same way as the middle of the window counts: then a thin limb's
        other side, which one side of a scan lacks, does not.

    Returns
    -------
    Windows
        Of every point and radius.
    """
    places, edges, gaps = _near(masses, distances, float(radii[-1]))
    numbers = np.zeros((len(points), len(radii), NUMBERS))
    truncation = np.zeros((len(points), len(radii)))
    positions = mesh.vertices[points]
    shape = len(points), len(masses.ends)
    for number in range(len(radii) - 1, -1, -1):  # the largest first: smaller ones lie within
        radius = float(radii[number])
        inside = gaps < radius
        places, edges, gaps = places[inside], edges[inside], gaps[inside]
        weights = np.square(1.0 - np.square(gaps / radius))
        rim = masses.on_boundary[edges]
        np.maximum.at(truncation[:, number], places[rim], weights[rim])
        inner = gaps < _INNER * radius
        ones = np.ones(np.count_nonzero(inner))
        normals = _sums(ones, places[inner], edges[inner], shape) @ masses.normals
        normals /= np.maximum(lengths(normals), np.finfo(np.float64).tiny)[:, None]  # (s, 3)
        if facing:
            cosines = np.einsum("pi,pi->p", masses.directions[edges], normals[places])
            share = np.clip((cosines - _SIDEWAYS) / (_STRAIGHT - _SIDEWAYS), 0.0, 1.0)
            weights *= share**2 * (3.0 - 2.0 * share)
        chosen = _sums(weights, places, edges, shape)
        found = chosen @ masses.moments, chosen @ masses.normals
        numbers[:, number] = _numbers(*found, positions, normals, radius)
    return Windows(numbers, truncation)


def _near(
    masses: EdgeMasses, distances: FloatArray, radius: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """Pairs of a point and an edge whose middle is near, and how far it is: (p,) each."""
    found = []
    for place, row in enumerate(distances):
        gaps = 0.5 * (row[masses.ends[:, 0]] + row[masses.ends[:, 1]])
        edges = np.flatnonzero(gaps < radius)
        found.append((np.full(len(edges), place), edges, gaps[edges]))
    places, edges, gaps = (np.concatenate(column) for column in zip(*found, strict=True))
    return places, edges, gaps


def _sums(
    weights: FloatArray, places: IntArray, edges: IntArray, shape: tuple[int, int]
) -> sparse.csr_array:
    """The matrix (s, e) that sums over the windows' edges; places ascend."""
    starts = np.zeros(shape[0] + 1, dtype=np.int64)
    np.cumsum(np.bincount(places, minlength=shape[0]), out=starts[1:])
    return sparse.csr_array((weights, edges, starts), shape=shape)


def _numbers(
    moments: FloatArray,
    normal_sums: FloatArray,
    positions: FloatArray,
    normals: FloatArray,
    radius: float,
) -> FloatArray:
    """The seven numbers (s, 7) of windows from their sums."""
    flat = np.pi * radius**2 / 3.0  # of the weight over a flat disc
    mass = np.maximum(moments[:, 0], _FAINTEST * flat)
    middle = moments[:, 1:4] / mass[:, None]
    covariance = np.empty((len(mass), 3, 3))
    for (i, j), column in zip(_PAIRS, moments[:, 4:].T, strict=True):
        covariance[:, i, j] = covariance[:, j, i] = column / mass - middle[:, i] * middle[:, j]
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance)[:, ::-1], 0.0))
    offset = middle - positions
    above = np.einsum("si,si->s", offset, normals)
    aside = lengths(offset - above[:, None] * normals)
    return np.column_stack(
        [
            np.log(mass / flat),
            above / radius,
            spread / radius,
            lengths(normal_sums) / mass,
            aside / radius,
        ]
    )
