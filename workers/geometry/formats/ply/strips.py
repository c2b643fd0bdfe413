"""Triangle strips: runs of vertices in which every three in a row are a triangle."""

import numpy as np

from workers.geometry.arrays import IntArray
from workers.geometry.formats.text.tokens import Polygons

UNSIGNED_ENDS = (0xFF, 0xFFFF, 0xFFFFFFFF)  # -1 where a writer's type has no sign


def cut_strips(strips: Polygons, n_vertices: int) -> Polygons:
    """Cut strips into triangles.

    Parameters
    ----------
    strips : Polygons
        Vertex indices, one row a strip or many strips in a row with -1 between them.
    n_vertices : int
        How many vertices there are: a number of all ones, if no vertex has it, is -1 too.

    Returns
    -------
    Polygons
        Triangles; every second one of a strip is turned, so that all have one winding.
        Those that use a vertex twice only turn the strip and are left out.
    """
    row_ends = np.cumsum(strips.counts)
    run = np.insert(strips.corners, row_ends, -1)  # a strip ends with its row
    for end in UNSIGNED_ENDS:
        if end >= n_vertices:
            run[run == end] = -1
    triangles = _triangles(run)
    return Polygons(np.full(len(triangles), 3), triangles.reshape(-1))


def _triangles(run: IntArray) -> IntArray:
    """Triangles (m, 3) of strips with -1 after each."""
    is_end = run == -1
    places = np.arange(len(run))
    begins = np.maximum.accumulate(np.where(is_end, places + 1, 0))  # of the strip a place is in
    windows = np.stack([run[:-2], run[1:-1], run[2:]], axis=1) if len(run) > 2 else run[:0, None]
    if not len(windows):
        return np.zeros((0, 3), dtype=np.int64)
    odd = ((places - begins)[:-2] & 1).astype(bool)
    windows[odd] = windows[odd][:, [1, 0, 2]]
    whole = ~(is_end[:-2] | is_end[1:-1] | is_end[2:])
    a, b, c = windows.T
    triangles: IntArray = windows[whole & (a != b) & (b != c) & (a != c)]
    return triangles
