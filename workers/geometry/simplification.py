"""The working mesh: fewer vertices by quadric error, checked against the mesh it came from.

An unchecked simplification can cut a thin connection: a human of 52,000 vertices had first
eigenvalues off by 540 % at 5,000. So each level is compared with the mesh. Where it broke
something, the next level takes twice as many vertices.
"""

import threading
from dataclasses import dataclass
from typing import Protocol

import fast_simplification
import numpy as np

from workers.geometry.arrays import FloatArray
from workers.geometry.canonical import canonical_frame, canonical_order, reordered, rounded
from workers.geometry.cleaning import without_useless_faces
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import first_eigenvalues
from workers.geometry.topology import (
    boundary_edges,
    boundary_loops,
    count_components,
    euler_characteristic,
)

# The two limits of error lie between sound levels and broken ones as first measured on real meshes;
# no command here repeats it. All other numbers are chosen, not measured.
LARGEST_SOLVED = 60_000  # vertices of the mesh whose eigenvalues are the truth
LEVELS = (1, 2, 4, 8)  # multiples of the vertices asked for
CHECKED_EIGENVALUES = 10
LARGEST_EIGENVALUE_ERROR = 0.1  # relative; sound levels were within 0.04, broken ones at 5
LARGEST_AREA_ERROR = 0.05  # relative; sound levels were within 0.02
AGGRESSIVENESS = (7.0, 4.0)  # of the error threshold's growth: tried in this order
LARGEST_VALENCE = 20_000  # the simplifier takes the square of it

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


class Decimate(Protocol):
    """Makes a coarser mesh, as `decimate_by_error` does."""

    def __call__(
        self, mesh: TriangleMesh, target: int, aggressiveness: float, *, keep_border: bool
    ) -> TriangleMesh:
        """Mesh of about ``target`` vertices."""


def decimate_by_error(
    mesh: TriangleMesh, target: int, aggressiveness: float, *, keep_border: bool
) -> TriangleMesh:
    """Mesh of about so many vertices by quadric error (Garland, Heckbert 1997), unchecked.

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

    Returns
    -------
    TriangleMesh
        Without degenerate faces; may have no face at all.
    """
    n_faces = round(mesh.n_faces * target / mesh.n_vertices)
    with ONE_AT_A_TIME:
        points, triangles = fast_simplification.simplify(
            mesh.vertices.copy(),
            mesh.faces.astype(np.int32),
            target_count=n_faces,
            agg=aggressiveness,
            preserve_border=keep_border,
        )
    used = np.isfinite(points).all(axis=1)
    triangles = triangles[used[triangles].all(axis=1)]
    if len(triangles) == 0:
        return TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    points = np.where(used[:, None], points, 0.0)
    return without_useless_faces(TriangleMesh(points, triangles))


def simplify(
    mesh: TriangleMesh, *, vertices: int, decimate: Decimate = decimate_by_error
) -> Simplified:
    """Mesh of about so many vertices that keeps the components, area, loops and eigenvalues.

    Everything happens in canonical coordinates and order. So a rotated, scaled and renumbered copy
    gets the same working mesh. A level that changes components, area or first eigenvalues is never
    taken. One that changes the number of boundary loops or the Euler characteristic is made again
    finer. At 8 times the vertices it is taken, since noise has a thousand handles and costs must
    stay bounded. Where nothing passes, the original is returned.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    vertices : int
        A mesh with no more is returned as it is.
    decimate : function
        Makes one level; what it returns is checked.

    Returns
    -------
    Simplified
        The working mesh, and what was wrong at coarser levels.

    Raises
    ------
    SpectrumError
        The eigenvalues of the original could not be certified.
    """
    if mesh.n_vertices <= vertices:
        return Simplified(mesh, ())
    if np.bincount(mesh.faces.ravel()).max() > LARGEST_VALENCE:
        return Simplified(mesh, ("not simplified: a vertex has too many faces",))
    frame = canonical_frame(mesh)
    canonical = TriangleMesh(rounded(frame.enter(mesh.vertices)), mesh.faces)
    canonical = reordered(canonical, canonical_order(mesh, frame), mirrored=frame.mirrored)
    canonical = without_useless_faces(canonical)  # rounding can flatten the thinnest
    found, notes = _first_sound(canonical, vertices, decimate)
    if found is canonical:
        return Simplified(mesh, notes)
    faces = found.faces[:, ::-1] if frame.mirrored else found.faces
    return Simplified(TriangleMesh(frame.leave(found.vertices), faces), notes)


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
            components=count_components(mesh),
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
        """Differences that lead to a finer level as long as there is one."""
        faults = []
        if coarse.loops != self.loops:
            faults.append(f"{coarse.loops} boundary loops instead of {self.loops}")
        if coarse.euler != self.euler:
            faults.append(f"Euler characteristic {coarse.euler} instead of {self.euler}")
        return faults


def _first_sound(
    mesh: TriangleMesh, vertices: int, decimate: Decimate
) -> tuple[TriangleMesh, tuple[str, ...]]:
    """Coarsest level that passes, and what was wrong with those before."""
    invariants = _Invariants.of(mesh)
    truth: FloatArray | None = None
    notes: list[str] = []
    targets = [vertices * level for level in LEVELS if vertices * level < mesh.n_vertices]
    for target in targets:
        coarse, hard, soft = _best_attempt(mesh, invariants, target, decimate)
        if not hard and (not soft or target == vertices * LEVELS[-1]):
            truth = _true_eigenvalues(mesh, invariants, decimate) if truth is None else truth
            hard = _eigenvalue_faults(truth, coarse)
        faults = hard + soft
        notes += [f"at {coarse.n_vertices:,} vertices: {fault}" for fault in faults]
        if not hard and (not soft or target == vertices * LEVELS[-1]):
            return coarse, tuple(notes)
    return mesh, (*notes, f"kept all {mesh.n_vertices:,} vertices")


def _best_attempt(
    mesh: TriangleMesh, invariants: _Invariants, target: int, decimate: Decimate
) -> tuple[TriangleMesh, list[str], list[str]]:
    """One level with its hard and soft faults: the first way without, or the first way."""
    tried = []
    n_rim = len(np.unique(boundary_edges(mesh)))
    borders = (False, True) if 0 < n_rim <= target // 2 else (False,)
    for keep_border in borders:
        for aggressiveness in AGGRESSIVENESS:
            coarse = decimate(mesh, target, aggressiveness, keep_border=keep_border)
            if coarse.n_faces == 0:
                continue
            found = _Invariants.of(coarse)
            hard, soft = invariants.hard_faults(found), invariants.soft_faults(found)
            if not hard and not soft:
                return coarse, hard, soft
            tried.append((coarse, hard, soft))
    if not tried:
        return mesh, ["nothing left"], []
    return min(tried, key=lambda attempt: (len(attempt[1]), len(attempt[2])))


def _true_eigenvalues(
    mesh: TriangleMesh, invariants: _Invariants, decimate: Decimate
) -> FloatArray:
    """First eigenvalues for unit area, of the mesh or of a fine simplification that is sound."""
    if mesh.n_vertices > LARGEST_SOLVED:
        fine, hard, _ = _best_attempt(mesh, invariants, LARGEST_SOLVED, decimate)
        if not hard:
            return first_eigenvalues(fine, CHECKED_EIGENVALUES) * fine.area
    return first_eigenvalues(mesh, CHECKED_EIGENVALUES) * mesh.area


def _eigenvalue_faults(truth: FloatArray, coarse: TriangleMesh) -> list[str]:
    """Whether the first eigenvalues for unit area are elsewhere."""
    eigenvalues = first_eigenvalues(coarse, CHECKED_EIGENVALUES) * coarse.area
    if len(eigenvalues) != len(truth):
        return [f"{len(eigenvalues)} eigenvalues instead of {len(truth)}"]
    errors = np.abs(eigenvalues / truth - 1.0)  # (k,)
    if errors.max() <= LARGEST_EIGENVALUE_ERROR:
        return []
    worst = int(errors.argmax())
    return [f"eigenvalue {worst + 1} is {errors[worst]:.0%} off"]
