"""Triangles of lists, strips and fans of corners."""

import numpy as np

from workers.geometry.arrays import IntArray

TRIANGLES, STRIP, FAN = 4, 5, 6
MODES = (TRIANGLES, STRIP, FAN)


def count_triangles(n_corners: int, mode: int) -> int:
    """How many triangles some corners make at most.

    Parameters
    ----------
    n_corners : int
        From 0.
    mode : int
        One of ``MODES``.

    Returns
    -------
    int
        From 0.
    """
    return n_corners // 3 if mode == TRIANGLES else max(n_corners - 2, 0)


def triangles(corners: IntArray, mode: int, restart: int | None) -> IntArray:
    """Triangles of corners in the order of the file.

    Parameters
    ----------
    corners : (c,) int64
        Vertex indices.
    mode : int
        One of ``MODES``.
    restart : int or None
        An index that ends a strip or fan and begins another; none where None.

    Returns
    -------
    (m, 3) int64
        Every second triangle of a strip is turned over, as strips do.
    """
    if restart is None or not (corners == restart).any():
        if mode == TRIANGLES:
            return corners[: len(corners) // 3 * 3].reshape(-1, 3)
        starts = np.zeros(len(corners), dtype=np.int64)
        ends = np.full(len(corners), len(corners))
    else:
        # Each run of corners between restarts is a list, strip or fan of its own.
        breaks = np.flatnonzero(corners == restart)
        lengths = np.diff(np.concatenate([[-1], breaks, [len(corners)]]))  # each with its break
        ends = np.repeat(np.append(breaks, len(corners)), lengths)[: len(corners)]
        starts = np.repeat(np.concatenate([[0], breaks + 1]), lengths)[: len(corners)]
    places = np.arange(len(corners))
    step = places - starts
    whole = places + 2 < ends
    if mode == TRIANGLES:
        at = places[whole & (step % 3 == 0)]
        return np.stack([corners[at], corners[at + 1], corners[at + 2]], axis=1)
    at = places[whole]
    if mode == FAN:
        return np.stack([corners[starts[at]], corners[at + 1], corners[at + 2]], axis=1)
    odd = step[at] % 2
    return np.stack([corners[at + odd], corners[at + 1 - odd], corners[at + 2]], axis=1)
