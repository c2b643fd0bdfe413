"""Which shapes a query is compared with closely: found by a glance at many and a look at some."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import FloatArray, IntArray
from workers.retrieval.windows.comparing import AT_A_GLANCE, NOTHING_COUNTS, Side
from workers.retrieval.windows.rows import PREFIX_BYTES, PREFIX_POINTS, read_prefixes
from workers.retrieval.windows.signature import KINDS, LOST, Signature
from workers.retrieval.windows.whitening import Whitening

MOST_GLANCED_AT = 10_000
"""So many shapes of the least distance are glanced at: their first points, a few windows each."""

LOOKED_AT = 1000
"""So many of the least difference at a glance are looked at: the same points, all windows."""

CANDIDATES = 100
"""So many of the least difference of these are found by windows, beside those of the scan."""

GLANCED_POINTS = 32
"""So many first points of the query are looked for at a glance."""

_EVERY = 2  # scale is looked at
_BLOCK = 128  # rows are read at a time
_LATER = 2 / 3  # of the scales: there, it is seen which of a query's points count

Fetch = Callable[[IntArray, int], NDArray[np.uint8]]
"""From places (m,) and a number of bytes b to the beginnings of their rows, (m, b); 0 for all."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Shapes that are compared closely.

    Attributes
    ----------
    places : (m,) int64
        Ascending.
    scales : (m,) int64
        Of the query: those at which a look differs least.
    """

    places: IntArray
    scales: IntArray


class FirstLooks:
    """The first points of a query, ready to be looked for on many shapes.

    Parameters
    ----------
    signature : Signature
        Of the query, as `counting_first` orders it.
    whitening : Whitening
        Of the model.
    """

    def __init__(self, signature: Signature, whitening: Whitening) -> None:
        """Whiten the windows of these points."""
        self._n_scales = signature.n_scales
        self._glance = Side.of(signature, whitening, AT_A_GLANCE, points=GLANCED_POINTS)
        self._look = Side.of(signature, whitening, range(KINDS), points=PREFIX_POINTS)

    def candidates(self, near: IntArray, glanced_at: IntArray, fetch: Fetch) -> Candidates:
        """Choose the shapes that are compared closely.

        Parameters
        ----------
        near : (m,) int64
            Places of shapes that are candidates in any case.
        glanced_at : (n,) int64
            Places of shapes of which the best at a glance are looked at; the best of these are
            candidates, too, but for those of which nothing is seen.
        fetch : callable
            Reads the beginnings of the rows of places.

        Returns
        -------
        Candidates
            All that are near, and the best of the others.
        """
        scales = np.arange(0, self._n_scales, _EVERY)
        looked_at = glanced_at
        if len(glanced_at) > LOOKED_AT:
            glances = _differences(self._glance, glanced_at, scales, fetch).min(axis=1)
            looked_at = glanced_at[least(glances, LOOKED_AT)]
        seen = np.union1d(near, looked_at).astype(np.int64)
        looks = _differences(self._look, seen, scales, fetch)  # (n, c)
        least_of_each = looks.min(axis=1)[np.searchsorted(seen, looked_at)]
        by_windows = least(least_of_each, CANDIDATES)
        by_windows = by_windows[least_of_each[by_windows] != NOTHING_COUNTS]
        places = np.union1d(near, looked_at[by_windows]).astype(np.int64)
        return Candidates(places, scales[looks.argmin(axis=1)[np.searchsorted(seen, places)]])


def counting_first(query: Signature) -> Signature:
    """Put those points first of which any window counts at a later scale.

    The first points of a sheet lie on its rim, where no window counts. But the first ones are what
    short looks and the verification see.

    Parameters
    ----------
    query : Signature
        Of a query.

    Returns
    -------
    Signature
        Of the same points.
    """
    scale = int(_LATER * query.n_scales)
    counts = (query.reaches[scale] != LOST).any(axis=1)
    order = np.argsort(~counts, kind="stable")
    return replace(
        query,
        numbers=query.numbers[:, order],
        reaches=query.reaches[:, order],
        areas=query.areas[order],
        mutual=query.mutual[np.ix_(order, order)],
    )


def least(values: FloatArray, count: int) -> IntArray:
    """Places of the least values, and of those level with the last: their order is no matter.

    Parameters
    ----------
    values : (n,) float64
        Distances or differences.
    count : int
        At least 1.

    Returns
    -------
    (m,) int64
        Ascending; m is ``count``, or more where values are level.
    """
    if len(values) <= count:
        return np.arange(len(values))
    places: IntArray = np.flatnonzero(values <= np.partition(values, count - 1)[count - 1])
    return places


def blocks_of(places: IntArray, fetch: Fetch, n_bytes: int) -> Iterator[NDArray[np.uint8]]:
    """Rows of some places, a few at a time.

    Parameters
    ----------
    places : (m,) int64
        Of the rows.
    fetch : callable
        Reads them.
    n_bytes : int
        So many of each; 0 for all.

    Yields
    ------
    (b, n_bytes) uint8
    """
    for start in range(0, len(places), _BLOCK):
        yield fetch(places[start : start + _BLOCK], n_bytes)


def _differences(side: Side, places: IntArray, scales: IntArray, fetch: Fetch) -> FloatArray:
    """X (n, c) of the first points of shapes at some scales."""
    found = [np.empty((0, len(scales)))]  # for want of shapes
    chosen = scales.tolist()
    for rows in blocks_of(places, fetch, PREFIX_BYTES):
        right = side.right(read_prefixes(rows, side.windows))
        found.append(side.differences(chosen, side.costs(chosen, right)))
    return np.concatenate(found)
