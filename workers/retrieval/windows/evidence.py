"""What windows say of the candidates of a query: found, compared, verified."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import FloatArray, IntArray
from workers.retrieval.windows.candidates import (
    Fetch,
    FirstLooks,
    blocks_of,
    counting_first,
    least,
)
from workers.retrieval.windows.comparing import (
    ALL_AROUND,
    FACING,
    Side,
)
from workers.retrieval.windows.rows import (
    read_numbers,
    read_row,
)
from workers.retrieval.windows.signature import STEP, Signature
from workers.retrieval.windows.trust import NOT_VERIFIED, Weights
from workers.retrieval.windows.verification import QUERY_POINTS, verify
from workers.retrieval.windows.whitening import Whitening

VERIFIED = 24
"""So many of the least difference are verified."""

_COMPARED_SCALES = 3  # of each candidate: the best of the first look and its neighbours


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known of the shapes that were compared.

    Attributes
    ----------
    places : (m,) int64
        Of the candidates, ascending.
    all_around, facing : (m, c) float64
        X of both groups of windows at the scales that each was compared at.
    log_consistency : (m,) float64
        ln p.
    scales : (m,) float64
        Factor from the query's lengths to the candidate's, both at area 1.
    """

    places: IntArray
    all_around: FloatArray
    facing: FloatArray
    log_consistency: FloatArray
    scales: FloatArray

    def fused(
        self, distances: FloatArray, weights: Weights, *, unknown: IntArray | None = None
    ) -> FloatArray:
        """Distances of all shapes, from all evidence.

        Parameters
        ----------
        distances : (n,) float64
            The bank's.
        weights : Weights
            For the query.
        unknown : (u,) int64, optional
            Places of shapes whose windows nobody took.

        Returns
        -------
        (n,) float64
            Those that were not compared count as if nothing of them were alike; unknown ones as
            if their windows were as much alike as their descriptors.
        """
        if unknown is not None and len(unknown):
            known = self.fused(distances, weights)
            known[unknown] = weights.from_distance(distances[unknown])
            return known
        differences = np.full(len(distances), np.inf)
        shares = (1.0 - weights.facing) * self.all_around + weights.facing * self.facing
        differences[self.places] = shares.min(axis=1)
        consistency = np.full(len(distances), NOT_VERIFIED)
        consistency[self.places] = self.log_consistency
        return weights.fused(distances, differences, consistency)


class WindowQuery:
    """A query, ready to be compared by its windows.

    Parameters
    ----------
    signature : Signature
        Of the query.
    whitening : Whitening
        Of the model.
    """

    def __init__(self, signature: Signature, whitening: Whitening) -> None:
        """Whiten the query's windows."""
        signature = counting_first(signature)
        self._signature = signature
        self._looks = FirstLooks(signature, whitening)
        self._around = Side.of(signature, whitening, ALL_AROUND)
        self._facing = Side.of(signature, whitening, FACING)

    def evidence(self, near: IntArray, glanced_at: IntArray, fetch: Fetch) -> Evidence:
        """Compare the query with candidates.

        Parameters
        ----------
        near : (m,) int64
            Places of shapes that are candidates in any case.
        glanced_at : (n,) int64
            Places of shapes of which the best at a glance are looked at; the best of these are
            candidates, too, but for those of which nothing is seen.
        fetch : callable
            Reads the rows of places.

        Returns
        -------
        Evidence
            Of all candidates; a candidate's is the same whatever others there are.
        """
        chosen = self._looks.candidates(near, glanced_at, fetch)
        places = chosen.places
        found = [
            self._compare(row, scale)
            for scale, row in zip(chosen.scales.tolist(), _rows(places, fetch), strict=True)
        ]
        count = min(_COMPARED_SCALES, self._signature.n_scales)
        around = np.array([one.around for one in found]).reshape(len(places), count)
        facing = np.array([one.facing for one in found]).reshape(len(places), count)
        log_consistency = np.full(len(places), NOT_VERIFIED)
        factors = np.array([STEP**-one.scale for one in found])
        best = least((around + facing).min(axis=1), VERIFIED)
        for number, row in zip(best, _rows(places[best], fetch), strict=True):
            consistency, factor = self._verify(row, found[number].scale)
            log_consistency[number] = max(NOT_VERIFIED, float(np.log(max(consistency, 1e-9))))
            factors[number] *= factor
        return Evidence(places, around, facing, log_consistency, factors)

    def _compare(self, row: NDArray[np.uint8], best: int) -> "_Compared":
        """X of all points at the best scale of a first look and its neighbours."""
        count = min(_COMPARED_SCALES, self._signature.n_scales)
        low = min(max(best - count // 2, 0), self._signature.n_scales - count)
        chosen = list(range(low, low + count))
        numbers = read_numbers(row)
        around, facing = (
            side.differences(chosen, side.costs(chosen, side.right(numbers[:, side.windows])))
            for side in (self._around, self._facing)
        )
        return _Compared(around, facing, chosen[int(np.argmin(around + facing))])

    def _verify(self, row: NDArray[np.uint8], scale: int) -> tuple[float, float]:
        """Consistency of the matches at a scale, and the factor that fits the distances best."""
        candidate, query = read_row(row), self._signature
        numbers = candidate.numbers[0][: len(candidate.mutual)]
        matched = slice(0, QUERY_POINTS)
        sums: NDArray[np.float32] = np.zeros(1, dtype=np.float32)
        dimensions: NDArray[np.float32] = np.zeros(1, dtype=np.float32)
        for side in (self._around, self._facing):
            counted = side.dimensions[scale, matched]  # (q,)
            costs = side.costs([scale], side.right(numbers[:, side.windows]))[0, matched]
            sums = sums + costs * counted[:, None]
            dimensions = dimensions + counted
        means = sums / np.maximum(dimensions, 1.0)[:, None]
        mutual = query.mutual.astype(np.float64)
        nearest = np.argmin(mutual[:, matched], axis=1)
        areas = query.areas.astype(np.float64)
        cells = np.asarray(np.bincount(nearest, areas, minlength=len(dimensions)), np.float64)
        own = mutual[matched, matched] * STEP**-scale
        found = verify(means, dimensions > 0, cells, own, candidate.mutual.astype(np.float64))
        return found.consistency, found.scale


@dataclass(frozen=True, eq=False)
class _Compared:
    """X of one candidate at some scales, and the best of these."""

    around: FloatArray
    facing: FloatArray
    scale: int


def _rows(places: IntArray, fetch: Fetch) -> Iterator[NDArray[np.uint8]]:
    """Whole rows of some places."""
    for rows in blocks_of(places, fetch, 0):
        yield from rows
