"""From the distances of a scan to distances from all evidence."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.retrieval.windows.candidates import MOST_GLANCED_AT, Fetch, least
from workers.retrieval.windows.evidence import WindowQuery
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.signature import Signature

AUTO, WHOLE, PART = "auto", "whole", "part"
"""What a query is taken for: by what its mesh shows, or as its asker says."""

NEAREST = 100
"""So many of the least distance are candidates in any case."""

PART_BOUNDARY = 3.0
"""Length of the boundary, in √A, that a part is taken to have at least: where it was cut off."""


def compare_closely(
    query: Signature,
    matching: WindowMatching,
    distances: FloatArray,
    rows_of: Callable[[IntArray], IntArray],
    fetch: Fetch,
    *,
    match: str = AUTO,
    nearer: Callable[[IntArray], FloatArray] | None = None,
) -> tuple[FloatArray, int]:
    """Distances from all evidence.

    Parameters
    ----------
    query : Signature
        Of the query.
    matching : WindowMatching
        Of the model.
    distances : (n,) float64
        By descriptors alone.
    rows_of : callable
        From places (m,) to the rows (m,) of their signatures, -1 where there is none.
    fetch : callable
        From rows to their bytes, see `FirstLooks`.
    match : "auto", "whole" or "part"
        What the query is taken for.
    nearer : callable, optional
        From places (m,), ascending, to their distances by all channels. A scan knows these of the
        nearest alone and takes the others for farther than they are.

    Returns
    -------
    (n,) float64, and how many were compared closely
    """
    if len(distances) == 0:
        return distances, 0
    if match == WHOLE:
        query = replace(query, numbers=query.numbers[:1], reaches=query.reaches[:1])
    if match == PART:
        query = replace(query, boundary=max(query.boundary, PART_BOUNDARY))
    glanced_at = least(distances, MOST_GLANCED_AT)
    found_rows = rows_of(glanced_at)
    places, rows = glanced_at[found_rows >= 0], found_rows[found_rows >= 0]
    near = np.isin(places, least(distances, NEAREST))
    found = WindowQuery(query, matching.whitening).evidence(rows[near], rows, fetch)
    order = np.argsort(rows)
    there = places[order][np.searchsorted(rows[order], found.places)]
    if nearer is not None:
        chosen = np.sort(there)
        distances = distances.copy()
        distances[chosen] = nearer(chosen)
    weights, unknown = matching.trust.weights(query), glanced_at[found_rows < 0]
    fused = replace(found, places=there).fused(distances, weights, unknown=unknown)
    # Rounding of windows must not set equal shapes apart: a descriptor is equal for them alone.
    fused[distances == 0.0] = 0.0
    return fused, len(there)
