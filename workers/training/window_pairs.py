"""Windows of corresponding points of a shape and a copy: what whitening is learned from.

Both are simplified after the copy was changed, so that their meshes differ: otherwise windows of
corresponding points would agree better than those of two scans ever do (decision 0036).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from workers.creatures import Creature
from workers.geometry.arrays import FloatArray, IntArray, lengths
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solver
from workers.geometry.views import View
from workers.retrieval.windows.signature import STORED_POINTS, signature_at, window_surface
from workers.transformations import transform

FINE_VERTICES = 14_000
"""Of the creatures: enough for their working meshes to be simplified."""

COPIES = ((10, 3), (11, 4), (12, 5))
"""Poses of a creature, and how strongly the part is cut from each."""

MOST_BUMPED = 0.003  # of √A: waves that change which edges a simplification takes
_WAVES, _LENGTHS = 12, 25.0  # how many are added up, and radians over the size of the shape
_TOLERANCE = 0.02  # of √A: what lies farther off corresponds to nothing


@dataclass(frozen=True, eq=False)
class WindowPairs:
    """Pairs of corresponding points.

    Attributes
    ----------
    differences : (p, 7, 7) float32
        Numbers of the shape's point less those of the copy's.
    one, other : (p, 7) uint8
        ``reaches`` of the shape's and of the copy's windows.
    """

    differences: NDArray[np.float32]
    one: NDArray[np.uint8]
    other: NDArray[np.uint8]


def creature_pairs(creature: Creature, view: View, *, rng: np.random.Generator) -> WindowPairs:
    """Pairs of a creature at rest and of posed, bumped and cut copies.

    Parameters
    ----------
    creature : Creature
        Of about `FINE_VERTICES` vertices.
    view : View
        Under which windows are taken.
    rng : Generator
        Draws the bumps.

    Returns
    -------
    WindowPairs
        Of all `COPIES`.
    """
    found = []
    for pose, strength in COPIES:
        bumped = _bumped(creature.posed(pose), rng)
        cut = transform(bumped, "partial", strength, seed=pose)
        found.append(window_pairs(creature.rest, cut.mesh, cut.origin, view))
    return WindowPairs(
        np.concatenate([one.differences for one in found]),
        np.concatenate([one.one for one in found]),
        np.concatenate([one.other for one in found]),
    )


def window_pairs(
    shape: TriangleMesh, copy: TriangleMesh, origin: IntArray, view: View
) -> WindowPairs:
    """Windows of a shape's farthest points, and of the same points of a copy.

    Parameters
    ----------
    shape, copy : TriangleMesh
        In the same unit.
    origin : (n,) int64
        Vertex of the shape that each vertex of the copy comes from.
    view : View
        Under which windows are taken.

    Returns
    -------
    WindowPairs
        Of those points that the copy still has.
    """
    own, other = (Solver(mesh).prepared(view) for mesh in (shape, copy))
    unit = 1.0 / np.sqrt(own.area)
    surface = window_surface(own, n_vertices=shape.n_vertices, for_query=False)
    points = surface.points[:STORED_POINTS]
    _, rest = cKDTree(shape.vertices).query(own.vertices[points])
    place = np.full(shape.n_vertices, -1)
    place[origin] = np.arange(len(origin))
    there = place[rest]
    is_left = there >= 0
    gaps, vertices = cKDTree(other.vertices).query(copy.vertices[there[is_left]])
    near = gaps * unit < _TOLERANCE
    kept = np.flatnonzero(is_left)[near]
    one = signature_at(_scaled(own, unit), points[kept])
    two = signature_at(_scaled(other, unit), np.asarray(vertices)[near])
    return WindowPairs(one.numbers[0] - two.numbers[0], one.reaches[0], two.reaches[0])


def _scaled(mesh: TriangleMesh, factor: float) -> TriangleMesh:
    return TriangleMesh(factor * mesh.vertices, mesh.faces)


def _bumped(mesh: TriangleMesh, rng: np.random.Generator) -> TriangleMesh:
    """The mesh with waves along its normals, of a height that is drawn."""
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    waves = rng.normal(size=(_WAVES, 3)) * (_LENGTHS / extent)
    phases = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    height = rng.uniform(0.0, MOST_BUMPED) * np.sqrt(mesh.area)
    heights = height * np.sqrt(2.0 / _WAVES) * np.sin(mesh.vertices @ waves.T + phases).sum(axis=1)
    return TriangleMesh(mesh.vertices + heights[:, None] * _vertex_normals(mesh), mesh.faces)


def _vertex_normals(mesh: TriangleMesh) -> FloatArray:
    """Normals of vertices, (n, 3), of length 1 or 0."""
    sums = np.zeros((mesh.n_vertices, 3))
    for corner in range(3):
        np.add.at(sums, mesh.faces[:, corner], mesh.face_normals)
    normals: FloatArray = sums / np.maximum(lengths(sums), np.finfo(np.float64).tiny)[:, None]
    return normals
