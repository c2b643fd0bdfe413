"""Seams between parts of one surface are closed: edges split at T-junctions, vertices welded."""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
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
    before, n_split, gap = faces, 0, 0.0
    for _ in range(MOST_PASSES):
        start = faces
        pairs = pair_edges(vertices, opening, reach=LOOSE * steps[-1])
        for distance in steps:
            if distance <= within_loop:
                split, count = split_at_junctions(vertices, faces, opening, distance=distance)
                if count:
                    faces, n_split, opening = split, n_split + count, open_edges(vertices, split)
                    pairs = pair_edges(vertices, opening, reach=LOOSE * steps[-1])
            welded, closed = weld(
                *(vertices, faces, opening, pairs), distance=distance, within_loop=within_loop
            )
            if welded is not faces:
                faces, gap, opening = welded, max(gap, closed), open_edges(vertices, welded)
                pairs = pair_edges(vertices, opening, reach=LOOSE * steps[-1])
        if faces is start:
            break
    n_welded = _count(before) - _count(faces) if faces is not before else 0
    return Sewn(faces, _sentences(n_welded, gap / extent, n_split), was_open=True)


def _count(faces: IntArray) -> int:
    """Count the vertices that have a face."""
    return int((np.bincount(faces.ravel()) > 0).sum())


def _sentences(n_welded: int, gap: float, n_split: int) -> tuple[str, ...]:
    """What was done."""
    said = []
    if n_split:
        said.append(f"split {n_split:,} {'edge' if n_split == 1 else 'edges'} at T-junctions")
    if n_welded:
        noun = "vertex" if n_welded == 1 else "vertices"
        said.append(
            f"welded {n_welded:,} {noun} along open edges, at most {gap:.1g} of the size apart"
        )
    return tuple(said)


def _own_precision(vertices: FloatArray, extent: float) -> float:
    """Distance within which the file's own numbers do not tell vertices apart.

    In whatever unit: a step of single precision, of the largest coordinate where all numbers are
    of that precision, or the step of a grid that all coordinates lie on, as they do where they are
    written with few decimals.
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
