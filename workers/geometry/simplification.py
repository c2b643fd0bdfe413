"""The working mesh: fewer vertices by quadric error, checked against the mesh it came from.

An unchecked simplification can cut a thin connection: a human of 52,000 vertices had first
eigenvalues off by 540 % at 5,000. So each level is compared with the mesh: by what can be counted,
and by its first eigenfunctions, which must be nearly eigenfunctions of the mesh (decision 0032).
Where a level broke something, the next one takes twice as many vertices.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import IntArray, ascending, frozen
from workers.geometry.canonical import canonical_frame, order_by_place, reordered, rounded
from workers.geometry.cleaning import without_useless_faces
from workers.geometry.clustering import clustered
from workers.geometry.decimation import (
    Coarser,
    Decimate,
    decimate_by_error,
    nothing,
    renumbered,
)
from workers.geometry.edges import undirected_edges
from workers.geometry.likeness import compare_eigenvalues
from workers.geometry.mesh import TriangleMesh
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
STUCK = 1.15  # times the vertices asked for: the simplifier came to no end
LARGEST_KEPT = 22_000  # vertices of a mesh that stays as it is where no level is sound
AS_GOOD = 1.25  # times the error of a finer level
WAYS = ((7.0, False), (4.0, False), (7.0, True))
"""Growth of the error's threshold, and whether vertices are shaken: tried in this order."""

LARGEST_VALENCE = 20_000  # the simplifier takes the square of it

TAKEN = "taken all the same"
"""Words of a note on a level that is not sound, where there was no better one."""


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
            faults = [found.fault] if found.fault else []
            attempt = replace(attempt, hard=faults, error=found.error)
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

    Where it is lenient, the first way without hard faults that is not stuck.
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
            stuck = coarse.mesh.n_vertices > STUCK * target
            soft = invariants.soft_faults(found) + stuck * [f"asked for {target:,}"]
            attempt = _Attempt(coarse, invariants.hard_faults(found), soft)
            if not attempt.hard and not stuck and (lenient or not attempt.soft):
                return attempt
            tried.append(attempt)
    if not tried:
        return _Attempt(nothing(mesh.n_vertices), ["nothing left"], [])
    return min(tried, key=lambda attempt: (len(attempt.hard), len(attempt.soft)))


def _without_shards(coarse: Coarser) -> Coarser:
    """Leave out pieces that have next to no area."""
    mesh = coarse.mesh
    labels = surface_components(mesh)
    if labels.max(initial=0) == 0:
        return coarse
    areas = np.bincount(labels, weights=mesh.face_areas)
    kept = (areas >= SHARD * areas.sum())[labels]
    return coarse if kept.all() else renumbered(mesh.vertices, mesh.faces[kept], coarse.to)
