"""Every shape as a query against all others, written out: what evaluations are compared with."""

from collections.abc import Sequence

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.retrieval.measures import RetrievalMeasures, retrieval_measures


def leave_one_out(
    distances: FloatArray, labels: Sequence[str | None]
) -> dict[int, RetrievalMeasures]:
    """Measures by the index of the query, of distances (n, n); the diagonal is not looked at.

    A shape without a label stands among the others, but is never relevant and never a query. Nor
    is one that is alone in its class.
    """
    classes = np.array(["" if label is None else f"={label}" for label in labels])
    found = {}
    for i in range(len(classes)):
        order = np.argsort(distances[i], kind="stable")
        others = order[order != i]
        relevant = (classes[others] == classes[i]) & (classes[i] != "")  # (n - 1,)
        if relevant.any():
            found[i] = retrieval_measures(relevant)
    return found
