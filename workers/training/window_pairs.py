"""Windows of corresponding points of a shape and a copy: what whitening is learned from.

Both are simplified after the copy was changed, so that their meshes differ: otherwise windows of
corresponding points would agree better than those of two scans ever do (decision 0036).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from workers.creatures import Creature
from workers.creatures.individual import FEWEST_VERTICES, MOST_VERTICES
from workers.errors import InvalidMeshError, SpectrumError
from workers.geometry.arrays import FloatArray, IntArray, lengths
from workers.geometry.mesh import TriangleMesh
from workers.geometry.refinement import refine
from workers.geometry.solution import Solver
from workers.geometry.views import View
from workers.retrieval.windows.moments import NUMBERS
from workers.retrieval.windows.signature import KINDS, STORED_POINTS, signature_at, window_surface
from workers.training.request import seed_of
from workers.training.sources import CreatureSource, Source, load_creature
from workers.transformations import transform
from workers.transformations.resampling import decimated

FINER = 2.8
"""Times the vertices of a working mesh that shapes have, so that these have to be simplified."""

COPIES = ((10, 3), (11, 4), (12, 5))
"""Poses of a shape, and how strongly the part is cut from each."""

BENT = 3
"""How strongly a shape without poses is bent: up to 55 degrees, as limbs of creatures are."""

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

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Return every field by its name.

        Returns
        -------
        dict
            `from_arrays` reads it.
        """
        return dict(vars(self))

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> "WindowPairs":
        """Return the pairs that `to_arrays` wrote.

        Parameters
        ----------
        arrays : mapping of str to array
            Others beside them are passed over.

        Returns
        -------
        WindowPairs
        """
        return cls(*(arrays[field.name] for field in fields(cls)))

    @classmethod
    def joined(cls, some: Sequence["WindowPairs"]) -> "WindowPairs":
        """All pairs of several shapes or copies.

        Parameters
        ----------
        some : sequence of WindowPairs
            In any number.

        Returns
        -------
        WindowPairs
            In this order.
        """
        none = np.zeros((0, KINDS), dtype=np.uint8)
        return cls(
            np.concatenate(
                [np.zeros((0, KINDS, NUMBERS), dtype=np.float32), *(a.differences for a in some)]
            ),
            np.concatenate([none, *(a.one for a in some)]),
            np.concatenate([none, *(a.other for a in some)]),
        )


def fine_vertices(view: View) -> int:
    """About how many vertices a shape has whose points are paired.

    Parameters
    ----------
    view : View
        Its last step simplifies.

    Returns
    -------
    int
        Within what a creature can have.
    """
    working = view.steps[-1].parameters["vertices"]
    return min(MOST_VERTICES, max(FEWEST_VERTICES, round(FINER * working)))


def paired_points(source: Source, mesh: TriangleMesh, view: View) -> WindowPairs:
    """Pairs of a shape that is learned from; its source decides all that is drawn.

    Parameters
    ----------
    source : CreatureSource or StoredSource
        A creature has copies in its own poses, and is made anew, finer and of even triangles.
    mesh : TriangleMesh
        The shape itself, clean.
    view : View
        Under which windows are taken.

    Returns
    -------
    WindowPairs
        None where no copy is left.
    """
    rng = np.random.default_rng(seed_of("points", source.identity))
    if not isinstance(source, CreatureSource):
        return mesh_pairs(mesh, view, rng=rng)
    fine = CreatureSource(source.species, source.seed, fine_vertices(view))
    return creature_pairs(load_creature(fine), view, rng=rng)


def creature_pairs(creature: Creature, view: View, *, rng: np.random.Generator) -> WindowPairs:
    """Pairs of a creature at rest and of posed, bumped and cut copies.

    Parameters
    ----------
    creature : Creature
        Of about `fine_vertices`.
    view : View
        Under which windows are taken.
    rng : Generator
        Draws the bumps.

    Returns
    -------
    WindowPairs
        Of all `COPIES` that have any.
    """
    return _pairs_of_copies(creature.rest, creature.posed, view, rng)


def mesh_pairs(mesh: TriangleMesh, view: View, *, rng: np.random.Generator) -> WindowPairs:
    """Pairs of a shape without poses and of bent, bumped and cut copies.

    The shape is given about `fine_vertices` first: finer ones cost more, and say no more.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    view : View
        Under which windows are taken.
    rng : Generator
        Draws the bumps.

    Returns
    -------
    WindowPairs
        Of all `COPIES` that have any.
    """
    vertices = fine_vertices(view)
    mesh = refine(mesh, vertices=vertices)
    if mesh.n_vertices > vertices:
        mesh = decimated(mesh, round(mesh.n_faces * vertices / mesh.n_vertices)).mesh

    def bent(seed: int) -> TriangleMesh:
        return transform(mesh, "isometry", BENT, seed=seed).mesh

    return _pairs_of_copies(mesh, bent, view, rng)


def _pairs_of_copies(
    mesh: TriangleMesh, pose: Callable[[int], TriangleMesh], view: View, rng: np.random.Generator
) -> WindowPairs:
    """Pairs of all copies that leave a mesh with windows."""
    found = []
    for seed, strength in COPIES:
        try:
            bumped = _bumped(pose(seed), rng)
            cut = transform(bumped, "partial", strength, seed=seed)
            found.append(window_pairs(mesh, cut.mesh, cut.origin, view))
        except (InvalidMeshError, SpectrumError):
            continue
    return WindowPairs.joined(found)


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
