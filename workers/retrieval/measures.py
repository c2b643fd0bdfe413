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


def retrieval_measures(relevant: BoolArray) -> RetrievalMeasures:
    """Measure one ranked list.

    Parameters
    ----------
    relevant : (n,) bool
        Whether each match is relevant, the nearest first, the query itself left out. The whole
        list: R of them are relevant.

    Returns
    -------
    RetrievalMeasures
        All in [0, 1], 1 being perfect.

    Raises
    ------
    InvalidRequestError
        No shape is relevant.
    """
    ranks = np.flatnonzero(relevant) + 1  # (R,)
    count = len(ranks)
    if count == 0:
        raise InvalidRequestError("no shape in the list is relevant, expected at least 1")
    on_page = np.count_nonzero(ranks <= E_MEASURE_LENGTH)
    gains = 1.0 / np.log2(np.maximum(np.arange(count) + 1, 2))  # of ranks 1, 2, ..., R
    return RetrievalMeasures(
        nearest_neighbour=float(ranks[0] == 1),
        first_tier=float(np.count_nonzero(ranks <= count) / count),
        second_tier=float(np.count_nonzero(ranks <= 2 * count) / count),
        e_measure=float(2.0 * on_page / (E_MEASURE_LENGTH + count)),
        dcg=float((1.0 / np.log2(np.maximum(ranks, 2))).sum() / gains.sum()),
        average_precision=float((np.arange(1, count + 1) / ranks).sum() / count),
    )


def mean_measures(measures: Sequence[RetrievalMeasures]) -> RetrievalMeasures:
    """Mean of each measure over queries.

    Parameters
    ----------
    measures : sequence of RetrievalMeasures
        One a query.

    Returns
    -------
    RetrievalMeasures
        The means.

    Raises
    ------
    InvalidRequestError
        There are no queries.
    """
    if not measures:
        raise InvalidRequestError("there are no queries to take a mean of, expected at least 1")
    return RetrievalMeasures(*np.mean([astuple(one) for one in measures], axis=0).tolist())


def precision_at_recall(relevant: BoolArray, *, recalls: FloatArray) -> FloatArray:
    """Interpolated precision: the best precision at any recall at least as large.

    Parameters
    ----------
    relevant : (n,) bool
        As for `retrieval_measures`, the whole list; at least one relevant.
    recalls : (r,) float64
        In [0, 1].

    Returns
    -------
    (r,) float64, in [0, 1]

    Raises
    ------
    InvalidRequestError
        No shape is relevant.
    """
    ranks = np.flatnonzero(relevant) + 1  # (R,)
    if len(ranks) == 0:
        raise InvalidRequestError("no shape in the list is relevant, expected at least 1")
    precisions = np.arange(1, len(ranks) + 1) / ranks
    best = np.maximum.accumulate(precisions[::-1])[::-1]  # (R,)
    needed = np.ceil(np.asarray(recalls) * len(ranks) - 1e-9).astype(np.int64)  # relevant shapes
    interpolated: FloatArray = best[np.clip(needed - 1, 0, len(ranks) - 1)]
    return interpolated
