"""The nearest shapes, and those with like windows, compared closely."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from service.search.index import Snapshot
from workers.geometry.arrays import FloatArray, IntArray
from workers.retrieval.windows.closely import compare_closely
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.signature import Signature


def closely(
    query: Signature,
    matching: WindowMatching,
    found: FloatArray,
    ids: Sequence[str],
    signatures: Snapshot,
    match: str,
    nearer: Callable[[IntArray], FloatArray],
) -> tuple[FloatArray, int]:
    """Distances of candidates from all evidence.

    Parameters
    ----------
    query : Signature
        Of the query.
    matching : WindowMatching
        Of the model.
    found : (m,) float64
        Distances of the candidates by their descriptors.
    ids : sequence of m str
        Their shapes.
    signatures : Snapshot
        Signatures of the collection, as far as there are any.
    match : "auto", "whole" or "part"
        What the query is taken for.
    nearer : callable
        From places of candidates, ascending, to their distances by all channels.

    Returns
    -------
    (m,) float64, and how many were compared closely
    """
    matrix = signatures.matrix.view(np.uint8)  # (n, bytes)
    below = len(signatures.matrix)

    def row_of(place: int) -> int:
        row = signatures.shape_rows.newest(ids[place], below=below)
        alive = row is not None and (signatures.alive is None or signatures.alive[row])
        return row if row is not None and alive else -1

    def rows_of(places: IntArray) -> IntArray:
        return np.array([row_of(place) for place in places.tolist()], dtype=np.int64)

    def fetch(rows: IntArray, n_bytes: int) -> NDArray[np.uint8]:
        fetched: NDArray[np.uint8] = matrix[rows, : n_bytes or None]
        return fetched

    return compare_closely(query, matching, found, rows_of, fetch, match=match, nearer=nearer)
