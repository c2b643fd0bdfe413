"""The working mesh: fewer vertices by quadric error, checked against the mesh it came from.

An unchecked simplification can cut a thin connection: a human of 52,000 vertices had first
eigenvalues off by 540 % at 5,000. So each level is compared with the mesh: by what can be counted,
and by its first eigenfunctions, which must be nearly eigenfunctions of the mesh (decision 0032).
Where a level broke something, the next one takes twice as many vertices.
"""

import threading
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import fast_simplification
import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray, ascending, frozen
from workers.geometry.canonical import canonical_frame, order_by_place, reordered, rounded
from workers.geometry.cleaning import useful_faces, without_useless_faces
from workers.geometry.clustering import clustered
from workers.geometry.diagonals import turn_edges
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.likeness import compare_eigenvalues
from workers.geometry.mesh import TriangleMesh
from workers.geometry.needles import merge_needles
from workers.geometry.topology import (
    boundary_edges,
    boundary_loops,
    count_surface_components,
    euler_characteristic,
    pass_on,
    surface_components,
)

# The limit of area lies between sound levels and broken ones as first measured on real meshes; no
# command here repeats it. All other numbers are chosen, not measured.
FINEST = 400_000  # vertices: finer meshes are clustered before anything else
LARGEST_LOST = 0.03  # of the area at clusters without a face; heavy noise loses 0.017
ENOUGH = 1.1  # times the vertices asked for: no more are not worth a simplification
LARGEST_CHECKED = 60_000  # vertices: finer meshes come down to these by what is counted alone
LEVELS = (1, 2, 4)  # multiples of the vertices asked for
LARGEST_AREA_ERROR = 0.05  # relative; sound levels were within 0.02
SHARD = 1e-3  # of the area: a piece that came off and has less is dropped
JITTER = 0.01  # of an edge, to each side
JITTER_SEED = 20261128
STUCK = 1.15  # times the vertices asked for: the simplifier came to no end
LARGEST_KEPT = 22_000  # vertices of a mesh that stays as it is where no level is sound
AS_GOOD = 1.25  # times the error of a finer level
WAYS = ((7.0, False), (4.0, False), (7.0, True))
"""Growth of the error's threshold, and whether vertices are shaken: tried in this order."""

LARGEST_VALENCE = 20_000  # the simplifier takes the square of it

TAKEN = "taken all the same"
"""Words of a note on a level that is not sound, where there was no better one."""

ONE_AT_A_TIME = threading.Lock()  # fast_simplification keeps its mesh in global variables


@dataclass(frozen=True, eq=False)
class Simplified:
    """A working mesh and how it was found.

    Attributes
    ----------
    mesh : TriangleMesh
        In the unit and place of the original; without degenerate faces.
    checked : tuple of str
        What was wrong at coarser levels, or at this one where it was accepted all the same.
    """

    mesh: TriangleMesh
    checked: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Coarser:
    """A coarser mesh of n vertices of a mesh.

    Attributes
    ----------
    mesh : TriangleMesh
        Without degenerate faces; may have no face at all.
    to : (n,) int64
        The vertex of the coarser mesh that each vertex became part of; -1 where it has no face.
    """

    mesh: TriangleMesh
    to: IntArray


class Decimate(Protocol):
    """Makes a coarser mesh, as `decimate_by_error` does."""

    def __call__(
        self,
        mesh: TriangleMesh,
        target: int,
        aggressiveness: float,
        *,
        keep_border: bool,
        shaken: bool = False,
    ) -> Coarser:
        """Mesh of about ``target`` vertices."""


def decimate_by_error(
    mesh: TriangleMesh,
    target: int,
    aggressiveness: float,
    *,
    keep_border: bool,
    shaken: bool = False,
    rough: bool = False,
) -> Coarser:
    """Mesh of about so many vertices by quadric error (Garland, Heckbert 1997), unchecked.

    A flat piece has no error, so its vertices come to lie anywhere. Needles are merged, and edges
    are turned. Where that does not do, a little noise makes errors grow with what was merged.

    Parameters
    ----------
    mesh : TriangleMesh
        Of area 1.
    target : int
        About how many vertices the result has.
    aggressiveness : float
        How fast the error allowed grows; the smaller, the more strictly small errors go first.
    keep_border : bool
        Whether edges of the boundary stay.
    shaken : bool
        Whether vertices get a little noise first.
    rough : bool
        Whether edges and vertices stay as they come, since another level follows, and nobody asks
        what became of the vertices.

    Returns
    -------
    Coarser
        What became of the mesh and of its vertices.
    """
    n_faces = round(mesh.n_faces * target / mesh.n_vertices)
    corners = mesh.faces.astype(np.int32)
    vertices = mesh.vertices + _jitter(mesh) if shaken else mesh.vertices.copy()
    with ONE_AT_A_TIME:
        points, triangles, collapses = fast_simplification.simplify(
            vertices.copy(),
            corners,
            target_count=n_faces,
            agg=aggressiveness,
            preserve_border=keep_border,
            return_collapses=True,
        )
        to = np.zeros(0, dtype=np.int64) if rough else collapsed(collapses, mesh.n_vertices)
        if not rough and to.max(initial=-1) + 1 != len(points):  # a vertex has lost all its faces
            _, _, to = fast_simplification.replay_simplification(vertices, corners, collapses)
    found = TriangleMesh(points, triangles.astype(np.int64))
    if rough:
        return _without_useless(found.vertices, found.faces, to)
    merged, into = merge_needles(found)
    shaped = turn_edges(merged)
    return _without_useless(shaped.vertices, shaped.faces, into[to])


def _jitter(mesh: TriangleMesh) -> FloatArray:
    """A little noise, (n, 3): in units of the shortest edge that a vertex has."""
    shortest = np.full(mesh.n_vertices, np.inf)
    for corner in range(3):
        edges = mesh.faces[:, [corner, (corner + 1) % 3]]
        along = edge_lengths(mesh.vertices, edges)
        for side in range(2):
            np.minimum.at(shortest, edges[:, side], along)
    rng = np.random.Generator(np.random.PCG64(JITTER_SEED))
    noise: FloatArray = rng.uniform(-JITTER, JITTER, size=mesh.vertices.shape)
    noise *= np.where(np.isfinite(shortest), shortest, 0.0)[:, None]
    return noise


def collapsed(collapses: IntArray, n_vertices: int) -> IntArray:
    """Follow each vertex through the collapses of edges to the vertex that it became part of.

    Parameters
    ----------
    collapses : (c, 2) int
        The vertex that stays and the one that goes, each of which goes once.
    n_vertices : int
        n, before them.

    Returns
    -------
    (n,) int64
        Numbers among the n - c vertices that are left, in their order.
    """
    into = np.arange(n_vertices)
    into[collapses[:, 1]] = collapses[:, 0]
    left = into == np.arange(n_vertices)
    while True:  # what they became part of may itself have become part of another one
        further = into.take(into)
        if np.array_equal(further, into):
            break
        into = further
    numbers: IntArray = (np.cumsum(left) - 1).take(into)
    return numbers


def _without_useless(points: np.ndarray, triangles: IntArray, to: IntArray) -> Coarser:
    """Leave out faces without area, repeated ones, and vertices (p,) that only they had."""
    finite = np.isfinite(points).all(axis=1)
    triangles = triangles[finite[triangles].all(axis=1)]
    if len(triangles) == 0:
        return _nothing(len(to))
    mesh = TriangleMesh(np.where(finite[:, None], points, 0.0), triangles)
    faces = mesh.faces[useful_faces(mesh)]
    if len(faces) == 0:
        return _nothing(len(to))
    return _renumbered(mesh.vertices, faces, to)


def _renumbered(points: np.ndarray, faces: IntArray, to: IntArray) -> Coarser:
    """Leave out vertices (p,) without a face."""
    used = np.zeros(len(points), dtype=np.bool_)
    used[faces] = True
    numbers = np.where(used, np.cumsum(used) - 1, -1)
    return Coarser(TriangleMesh(points[used], numbers[faces]), np.where(to >= 0, numbers[to], -1))


def _nothing(n_vertices: int) -> Coarser:
    """What has no face left of so many vertices."""
    empty = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    return Coarser(empty, np.full(n_vertices, -1))


def simplify(
    mesh: TriangleMesh, *, vertices: int, decimate: Decimate = decimate_by_error
) -> Simplified:
    """Mesh of about so many vertices that keeps the components, area, loops and eigenvalues.

    Everything happens in canonical coordinates and order. So a rotated, scaled and renumbered copy
    gets the same working mesh. A level that changes components, area or first eigenvalues is made
    again finer. So is one that changes the number of boundary loops or the Euler characteristic,
    once: noise has a thousand handles. Where nothing passes at four times the vertices, a mesh that
    has not many more is kept. Of a larger one the level whose eigenvalues are nearest is taken, and
    that is said: what a shape costs must stay bounded.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    vertices : int
        A mesh with hardly more is returned as it is.
    decimate : function
        Makes one level; what it returns is checked.

    Returns
    -------
    Simplified
        The working mesh, and what was wrong at coarser levels.

    Raises
    ------
    InvalidMeshError
        Thousands of faces meet in one vertex of a mesh that is too large to be kept.
    """
    if mesh.n_vertices <= ENOUGH * vertices:
        return Simplified(mesh, ())
    valence = int(np.bincount(mesh.faces.ravel()).max())
    if valence > LARGEST_VALENCE:
        if mesh.n_vertices <= LARGEST_CHECKED:
            return Simplified(mesh, ("not simplified: a vertex has too many faces",))
        raise InvalidMeshError(
            f"{valence:,} faces meet in one vertex of {mesh.n_vertices:,}, expected at most "
            f"{LARGEST_VALENCE:,}: the mesh cannot be simplified"
        )
    edges = undirected_edges(mesh)
    frame = canonical_frame(mesh, edges)
    canonical = TriangleMesh(frozen(rounded(frame.enter(mesh.vertices))), mesh.faces)
    pass_on(mesh, canonical)
    clusters = None
    if mesh.n_vertices > FINEST and vertices < LARGEST_CHECKED:
        clusters = _sound_clusters(canonical, edges)
    if clusters is None:
        canonical = reordered(canonical, order_by_place(canonical, edges), mirrored=frame.mirrored)
    else:
        canonical = reordered(clusters, order_by_place(clusters), mirrored=frame.mirrored)
    del edges
    canonical = without_useless_faces(canonical)  # rounding can flatten the thinnest
    found, notes = _first_sound(canonical, vertices, decimate)
    if found is canonical and clusters is None:
        return Simplified(mesh, notes)
    faces = found.faces[:, ::-1] if frame.mirrored else found.faces
    return Simplified(TriangleMesh(frame.leave(found.vertices), faces), notes)


def _sound_clusters(mesh: TriangleMesh, edges: IntArray) -> TriangleMesh | None:
    """Clusters of a very fine mesh; None where its parts are thinner than the grid can show.

    Area is no measure here: a noisy scan loses as much of it when edges are collapsed one by one.
    """
    clusters = clustered(mesh, edges)
    if clusters is None or clusters.lost_area > LARGEST_LOST:
        return None
    coarse = _without_shards(Coarser(clusters.mesh, edges[:0, 0])).mesh
    if count_surface_components(coarse) != count_surface_components(mesh):
        return None
    return coarse


@dataclass(frozen=True)
class _Invariants:
    """What a simplification must not change; hard facts and soft ones."""

    components: int
    area: float
    loops: int
    euler: int

    @classmethod
    def of(cls, mesh: TriangleMesh) -> "_Invariants":
        """Measure a mesh."""
        return cls(
            components=int(surface_components(mesh).max(initial=-1)) + 1,
            area=mesh.area,
            loops=len(boundary_loops(mesh)),
            euler=euler_characteristic(mesh),
        )

    def hard_faults(self, coarse: "_Invariants") -> list[str]:
        """Differences that no level may have."""
        faults = []
        if coarse.components != self.components:
            faults.append(f"{coarse.components} components instead of {self.components}")
        if not abs(coarse.area / self.area - 1.0) <= LARGEST_AREA_ERROR:
            faults.append(f"{abs(coarse.area / self.area - 1.0):.1%} of area lost or gained")
        return faults

    def soft_faults(self, coarse: "_Invariants") -> list[str]:
        """Differences that lead to a finer level once."""
        faults = []
        if coarse.loops != self.loops:
            faults.append(f"{coarse.loops} boundary loops instead of {self.loops}")
        if coarse.euler != self.euler:
            faults.append(f"Euler characteristic {coarse.euler} instead of {self.euler}")
        return faults


@dataclass(frozen=True, eq=False)
class _Attempt:
    """One level, and what is wrong with it; the error is that of its eigenvalues, if known."""

    coarse: Coarser
    hard: list[str]
    soft: list[str]
    error: float = np.inf

    def notes(self, *, taken: bool = False) -> list[str]:
        """What was wrong, in sentences."""
        end = f", {TAKEN}" if taken else ""
        at = f"at {self.coarse.mesh.n_vertices:,} vertices"
        return [f"{at}: {fault}{end}" for fault in self.hard + self.soft]


def _first_sound(
    mesh: TriangleMesh, vertices: int, decimate: Decimate
) -> tuple[TriangleMesh, tuple[str, ...]]:
    """Coarsest level that passes, and what was wrong with those before."""
    notes: list[str] = []
    original = mesh
    if mesh.n_vertices > ENOUGH * LARGEST_CHECKED > vertices:
        fine = _best_attempt(mesh, LARGEST_CHECKED, _rough(decimate), lenient=True)
        if fine.coarse.mesh.n_faces:
            notes += fine.notes(taken=True)
            mesh = fine.coarse.mesh
    attempts = []
    for level in LEVELS:
        if mesh.n_vertices <= ENOUGH * level * vertices:
            break
        attempt = _best_attempt(mesh, level * vertices, decimate, lenient=level > 1)
        sound = not attempt.hard and (level > 1 or not attempt.soft)
        if sound:
            found = compare_eigenvalues(mesh, attempt.coarse.mesh, attempt.coarse.to)
            sound = not found.fault
            attempt = replace(attempt, error=found.error)
            attempt.hard.extend([found.fault] if found.fault else [])
        notes += attempt.notes()
        if sound:
            return attempt.coarse.mesh, tuple(notes)
        attempts.append(attempt)
    few = mesh.n_vertices <= min(ENOUGH * LEVELS[-1] * vertices, LARGEST_KEPT)
    taken = _least_bad(attempts)
    if few or taken is None:
        kept = [f"kept all {mesh.n_vertices:,} vertices"] if mesh is original else []
        return mesh, (*notes, *kept)
    return taken.mesh, (
        *notes,
        f"{taken.mesh.n_vertices:,} vertices {TAKEN}: the mesh itself is too large",
    )


def _least_bad(attempts: list[_Attempt]) -> Coarser | None:
    """Of levels that all have faults the coarsest with about the smallest error, or the finest.

    What is as far off with twice the vertices is no fault of the simplification.
    """
    usable = [attempt for attempt in attempts if attempt.coarse.mesh.n_faces]
    least = min((attempt.error for attempt in usable), default=np.inf)
    if not usable or not np.isfinite(least):
        return usable[-1].coarse if usable else None
    return next(attempt.coarse for attempt in usable if attempt.error <= AS_GOOD * least)


def _rough(decimate: Decimate) -> Decimate:
    """The same for a level that another one follows, in half the time and memory."""
    return partial(decimate_by_error, rough=True) if decimate is decimate_by_error else decimate


def _best_attempt(
    mesh: TriangleMesh, target: int, decimate: Decimate, *, lenient: bool
) -> _Attempt:
    """One level: the first way without faults, or the one with the fewest.

    Where it is lenient, the first way without hard faults.
    """
    invariants = _Invariants.of(mesh)
    tried = []
    n_rim = len(ascending(boundary_edges(mesh)))
    borders = (False, True) if 0 < n_rim <= target // 2 else (False,)
    for keep_border in borders:
        for aggressiveness, shaken in WAYS:
            coarse = _without_shards(
                decimate(mesh, target, aggressiveness, keep_border=keep_border, shaken=shaken)
            )
            if coarse.mesh.n_faces == 0:
                continue
            found = _Invariants.of(coarse.mesh)
            soft = invariants.soft_faults(found)
            if coarse.mesh.n_vertices > STUCK * target:
                soft.append(f"asked for {target:,}")
            attempt = _Attempt(coarse, invariants.hard_faults(found), soft)
            stuck = coarse.mesh.n_vertices > STUCK * target
            if not attempt.hard and not stuck and (lenient or not attempt.soft):
                return attempt
            tried.append(attempt)
    if not tried:
        return _Attempt(_nothing(mesh.n_vertices), ["nothing left"], [])
    return min(tried, key=lambda attempt: (len(attempt.hard), len(attempt.soft)))


def _without_shards(coarse: Coarser) -> Coarser:
    """Leave out pieces that have next to no area."""
    mesh = coarse.mesh
    labels = surface_components(mesh)
    if labels.max(initial=0) == 0:
        return coarse
    areas = np.bincount(labels, weights=mesh.face_areas)
    kept = (areas >= SHARD * areas.sum())[labels]
    return coarse if kept.all() else _renumbered(mesh.vertices, mesh.faces[kept], coarse.to)
