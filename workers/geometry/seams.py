"""Seams between parts of one surface are closed: edges split at T-junctions, vertices welded."""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray, ascending
from workers.geometry.hanging import without_hanging
from workers.geometry.junctions import split_at_junctions
from workers.geometry.openings import open_edges, pair_edges
from workers.geometry.welding import LOOSE, weld

STEPS = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  # of the extent
WITHIN_LOOP = 1e-5  # of the extent; a wider slit with two lips was meant
MOST = 1e-3  # of the extent, however coarse the numbers of a file are
FLOAT_STEPS = 4.0  # two corners rounded along three axes are up to 2·√3 apart
GRID_STEPS = 2.0  # the same for numbers of few decimals: one step along three axes
MOST_ON_GRID = 1e7  # steps along the extent; beyond, rounding hides them
MOST_PASSES = 20


@dataclass(frozen=True, eq=False)
class Sewn:
    """Faces after their seams were closed.

    Attributes
    ----------
    faces : (m, 3) int64
        The array given if nothing was done.
    repairs : tuple of str
        What was done, in sentences for people.
    was_open : bool
        Whether there was any open edge.
    """

    faces: IntArray
    repairs: tuple[str, ...]
    was_open: bool


def sew(vertices: FloatArray, faces: IntArray, extent: float) -> Sewn:
    """Close seams in steps of rising distance, until another pass finds nothing to do.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions; none is moved.
    faces : (m, 3) int64
        Without degenerate or repeated ones.
    extent : float
        Diagonal of the bounding box.

    Returns
    -------
    Sewn
        Without the vertices that were welded to others.
    """
    opening = open_edges(vertices, faces)
    if len(opening) == 0:
        return Sewn(faces, (), was_open=False)
    own = min(_own_precision(vertices, extent), MOST * extent)
    steps = sorted({own, *(step * extent for step in STEPS)})
    within_loop = max(own, WITHIN_LOOP * extent)
    seams = _Seams(vertices, faces, within_loop=within_loop, reach=LOOSE * steps[-1])
    for _ in range(MOST_PASSES):
        start = seams.faces
        for distance in steps:
            seams.weld(distance)
        for distance in steps:
            if distance <= within_loop and seams.close_junctions(distance):
                seams.weld(distance)
        if seams.faces is start:
            break
    return Sewn(seams.faces, seams.repairs(extent), was_open=True)


class _Seams:
    """Faces whose seams are being closed, and what was done.

    Attributes
    ----------
    faces : (m, 3) int64
        As they are now.
    """

    def __init__(
        self, vertices: FloatArray, faces: IntArray, *, within_loop: float, reach: float
    ) -> None:
        self._vertices = vertices
        self._within_loop = within_loop
        self._reach = reach
        self._n_welded = self._n_split = self._n_taken = 0
        self._gap = 0.0
        self._set(faces)

    def _set(self, faces: IntArray) -> None:
        """Look at faces anew."""
        self.faces = faces
        self._opening = open_edges(self._vertices, faces)
        self._pairs = pair_edges(self._vertices, self._opening, reach=self._reach)

    def weld(self, distance: float) -> None:
        """Make open edges one that lie on each other."""
        welded, gap = weld(
            *(self._vertices, self.faces, self._opening, self._pairs),
            distance=distance,
            within_loop=self._within_loop,
        )
        if welded is not self.faces:
            self._n_welded += len(ascending(self.faces)) - len(ascending(welded))
            self._gap = max(self._gap, gap)
            self._set(welded)

    def close_junctions(self, distance: float) -> bool:
        """Take out what only divides an edge, and split edges at all others; tell if any was."""
        split = split_at_junctions(self._vertices, self.faces, self._opening, distance=distance)
        if not split.vertices:
            return False
        at = np.unique(np.concatenate(split.vertices))
        rest, n_taken = without_hanging(self._vertices, self.faces, at, distance=distance)
        if n_taken:
            self._n_taken += n_taken
            self._set(rest)
            self.close_junctions(distance)
        else:
            self._n_split += len(split.vertices)
            self._set(split.faces)
        return True

    def repairs(self, extent: float) -> tuple[str, ...]:
        """What was done, in sentences for people."""
        said = []
        if self._n_taken:
            noun = "vertex" if self._n_taken == 1 else "vertices"
            said.append(f"took out {self._n_taken:,} {noun} at T-junctions")
        if self._n_split:
            noun = "edge" if self._n_split == 1 else "edges"
            said.append(f"split {self._n_split:,} {noun} at T-junctions")
        if self._n_welded:
            noun = "vertex" if self._n_welded == 1 else "vertices"
            said.append(
                f"welded {self._n_welded:,} {noun} along open edges, "
                f"at most {self._gap / extent:.1g} of the size apart"
            )
        return tuple(said)


def _own_precision(vertices: FloatArray, extent: float) -> float:
    """Distance within which the file's own numbers do not tell vertices apart.

    It is a step of single precision, in any unit: of the largest coordinate where all numbers have
    that precision, of the extent elsewhere. Numbers written with few decimals lie on a grid. There
    it is the step of the grid, if that is larger.
    """
    with np.errstate(over="ignore"):
        single = bool((vertices.astype(np.float32) == vertices).all())
    largest = float(np.abs(vertices).max()) if single else extent
    step = FLOAT_STEPS * float(np.ldexp(1.0, int(np.frexp(largest)[1]) - 24))
    return max(step, GRID_STEPS * _grid_step(vertices, extent))


def _grid_step(vertices: FloatArray, extent: float) -> float:
    """Step of the grid that all coordinates lie on, or 0 if there is none."""
    step = np.inf
    for axis in range(3):
        values = np.unique(vertices[:, axis])
        apart = np.diff(values)
        apart = apart[apart > extent / MOST_ON_GRID]
        step = min(step, float(apart.min()) if len(apart) else np.inf)
    if not step < MOST * extent:
        return 0.0
    steps = (vertices - vertices.min(axis=0)) / step  # (n, 3)
    if not (np.abs(steps - np.round(steps)) < 1e-2).all():
        return 0.0
    # Numbers that were rounded end in any digit; those of a coarse grid with a fine slit do not.
    return step if float((np.round(steps) % 10 != 0).mean()) >= 0.5 else 0.0
