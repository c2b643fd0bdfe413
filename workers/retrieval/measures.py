"""Measures of retrieval: how early the relevant shapes come in a ranked list.

Definitions are those of the Princeton Shape Benchmark (Shilane and others, 2004) with the query
left out of the list; all are fractions, 1 being perfect.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import BoolArray, FloatArray

E_MEASURE_LENGTH = 32  # matches that fit a page of results


@dataclass(frozen=True)
class RetrievalMeasures:
    """Measures of one ranked list, or means over several.

    Attributes
    ----------
    nearest_neighbour : float
        1 if the first match is relevant.
    first_tier, second_tier : float
        Share of the R relevant shapes among the first R, and 2R, matches.
    e_measure : float
        Harmonic mean of precision and recall of the first 32 matches.
    dcg : float
        Discounted cumulative gain, as a share of the best there is.
    average_precision : float
        Mean of the precision at each relevant match; 1/rank where only one is relevant.
    """

    nearest_neighbour: float
    first_tier: float
    second_tier: float
    e_measure: float
    dcg: float
    average_precision: float


def retrieval_measures(relevant: BoolArray, *, n_relevant: int | None = None) -> RetrievalMeasures:
    """Measure one ranked list.

    Parameters
    ----------
    relevant : (n,) bool
        Whether each match is relevant, the nearest first, the query itself left out.
    n_relevant : int, optional
        R, the relevant shapes there are; more than in the list if that was cut.

    Returns
    -------
    RetrievalMeasures

    Raises
    ------
    InvalidRequestError
        No shape is relevant, or more are in the list than there are.
    """
    relevant = np.asarray(relevant, dtype=bool)
    hits = int(np.count_nonzero(relevant))
    count = hits if n_relevant is None else n_relevant
    if count < max(hits, 1):
        raise InvalidRequestError(
            f"{count} shapes are relevant and {hits} relevant ones in the list, "
            "expected at least 1 and no more in the list than there are"
        )
    ranks = np.flatnonzero(relevant) + 1  # (hits,)
    on_page = np.count_nonzero(ranks <= E_MEASURE_LENGTH)
    gains = 1.0 / np.log2(np.maximum(np.arange(count) + 1, 2))  # of ranks 1, 2, ..., R
    return RetrievalMeasures(
        nearest_neighbour=float(bool(relevant[:1].any())),
        first_tier=float(np.count_nonzero(ranks <= count) / count),
        second_tier=float(np.count_nonzero(ranks <= 2 * count) / count),
        e_measure=float(2.0 * on_page / (E_MEASURE_LENGTH + count)),
        dcg=float((1.0 / np.log2(np.maximum(ranks, 2))).sum() / gains.sum()),
        average_precision=float((np.arange(1, hits + 1) / ranks).sum() / count),
    )


def mean_measures(measures: Sequence[RetrievalMeasures]) -> RetrievalMeasures:
    """Mean of each measure over queries; InvalidRequestError if there are none."""
    if not measures:
        raise InvalidRequestError("there are no queries to take a mean of, expected at least 1")
    return RetrievalMeasures(*np.mean([astuple(one) for one in measures], axis=0).tolist())


def leave_one_out(
    distances: FloatArray, labels: Sequence[str | None]
) -> dict[int, RetrievalMeasures]:
    """Measures of every shape as a query against all others.

    Parameters
    ----------
    distances : (n, n) float64
        From row (query) to column; the diagonal is not looked at. Ties go to the lower index.
    labels : sequence of n str or None
        None: stands among the others, but is never relevant and never a query.

    Returns
    -------
    dict
        By the index of the query; a shape that is alone in its class is none.
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


def leave_one_out_by_class(
    distances: FloatArray, labels: Sequence[str | None]
) -> dict[str, RetrievalMeasures]:
    """Mean measures of `leave_one_out` over the queries of each class, by label, sorted."""
    by_label: dict[str, list[RetrievalMeasures]] = {}
    for i, measures in leave_one_out(distances, labels).items():
        by_label.setdefault(str(labels[i]), []).append(measures)
    return {label: mean_measures(rows) for label, rows in sorted(by_label.items())}


def precision_at_recall(relevant: BoolArray, *, recalls: FloatArray) -> FloatArray:
    """Interpolated precision, (r,): the best precision at any recall at least as large.

    Parameters
    ----------
    relevant : (n,) bool
        As for `retrieval_measures`, the whole list; at least one relevant.
    recalls : (r,) float64
        In [0, 1].
    """
    ranks = np.flatnonzero(relevant) + 1  # (R,)
    if len(ranks) == 0:
        raise InvalidRequestError("no shape in the list is relevant, expected at least 1")
    precisions = np.arange(1, len(ranks) + 1) / ranks
    best = np.maximum.accumulate(precisions[::-1])[::-1]  # (R,)
    needed = np.ceil(np.asarray(recalls) * len(ranks) - 1e-9).astype(np.int64)  # relevant shapes
    interpolated: FloatArray = best[np.clip(needed - 1, 0, len(ranks) - 1)]
    return interpolated
