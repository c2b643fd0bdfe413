"""Intervals of means over queries: a bootstrap over shapes, not over queries.

Queries made from one shape fail together, so they are no independent draws. Labels are drawn anew,
with replacement, each with all of its queries: the cluster bootstrap (Efron and Tibshirani, An
Introduction to the Bootstrap, 1993, ch. 8 and 13). All models are measured on the same draws, so
that their differences are paired. With 13 to 60 labels, intervals of 95 % held the truth in 92 to
94 % of simulations (tests/retrieval/test_bootstrap.py has them); drawn over queries, in 47 %.
"""

from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray

RESAMPLINGS = 2000
CONFIDENCE = 0.95
CHUNK_ELEMENTS = 1 << 21


@dataclass(frozen=True)
class Interval:
    """A figure and its percentile interval; no bounds where all queries are of one label."""

    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True, eq=False)
class RowMeans:
    """Mean of the rows of a table, of each model.

    Attributes
    ----------
    values : (m,) float64
        As measured.
    samples : (m, b) float64
        In each resampling; b is 0 where there is but one label to draw from.
    """

    values: FloatArray
    samples: FloatArray


def mean_of_rows(
    scores: FloatArray,
    rows: IntArray,
    labels: IntArray,
    *,
    seed: int,
    resamplings: int = RESAMPLINGS,
) -> RowMeans:
    """Mean over rows of the mean score of each row's queries, and its resamplings.

    A row that has no query in a resampling is left out of that resampling's mean.

    Parameters
    ----------
    scores : (m, q) float64
        Of each model and query.
    rows : (q,) int64
        Each query's row; one row only gives the plain mean over queries.
    labels : (q,) int64
        Number of each query's label.
    seed : int
        The same seed and the same queries give the same draws, whatever the scores.
    resamplings : int
        How many; 2,000 leave the ends uncertain by 2 % of the width (binomial standard error).

    Returns
    -------
    RowMeans
        Of each model.

    Raises
    ------
    InvalidRequestError
        There is no query, or sizes differ.
    """
    scores = np.atleast_2d(np.asarray(scores, dtype=np.float64))
    if scores.shape[1] == 0 or rows.shape != labels.shape or rows.shape != scores.shape[1:]:
        raise InvalidRequestError(
            f"scores of shape {scores.shape}, rows of {rows.shape} and labels of {labels.shape} "
            "do not belong together, expected one column, row and label a query, at least one"
        )
    sums, counts = _totals(scores, rows, labels)  # (m, l, r), (l, r)
    n_models, n_labels, n_rows = sums.shape
    values = _means(np.ones((1, n_labels)), sums, counts)[:, 0]
    if n_labels == 1:
        return RowMeans(values, np.empty((n_models, 0)))
    rng = np.random.default_rng(seed)
    samples = np.empty((n_models, resamplings))
    size = max(1, CHUNK_ELEMENTS // (n_labels + n_models * n_rows))
    for start in range(0, resamplings, size):
        n = min(size, resamplings - start)
        drawn = rng.multinomial(n_labels, np.full(n_labels, 1.0 / n_labels), size=n)  # (n, l)
        samples[:, start : start + n] = _means(drawn.astype(np.float64), sums, counts)
    return RowMeans(values, samples)


def interval(value: float, samples: FloatArray) -> Interval:
    """Percentile interval of a figure, of 95 per cent.

    Parameters
    ----------
    value : float
        The figure as measured.
    samples : (b,) float64
        Its resamplings.

    Returns
    -------
    Interval
        Without bounds if there are no resamplings.
    """
    if len(samples) == 0:
        return Interval(float(value), None, None)
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(samples, [tail, 1.0 - tail])
    return Interval(float(value), float(low), float(high))


def difference(means: RowMeans, model: int, reference: int) -> Interval:
    """Difference of a model from the reference, paired: both on the same draws.

    Parameters
    ----------
    means : RowMeans
        Of both.
    model, reference : int
        Their rows.

    Returns
    -------
    Interval
        Above 0 where the model is better.
    """
    return interval(
        float(means.values[model] - means.values[reference]),
        means.samples[model] - means.samples[reference],
    )


def _totals(scores: FloatArray, rows: IntArray, labels: IntArray) -> tuple[FloatArray, FloatArray]:
    """Sums of scores (m, l, r) and numbers of queries (l, r) by label and row."""
    row_names, row = np.unique(rows, return_inverse=True)
    label_names, label = np.unique(labels, return_inverse=True)
    shape = (len(label_names), len(row_names))
    cell = label * shape[1] + row  # (q,)
    size = shape[0] * shape[1]
    sums = [np.bincount(cell, weights=one, minlength=size).reshape(shape) for one in scores]
    return np.stack(sums), np.bincount(cell, minlength=size).reshape(shape).astype(np.float64)


def _means(drawn: FloatArray, sums: FloatArray, counts: FloatArray) -> FloatArray:
    """Means of rows (m, n) when each label is there as often as drawn (n, l)."""
    counted = drawn @ counts  # (n, r)
    there = counted > 0.0
    total = drawn @ sums  # (m, n, r)
    of_rows = np.divide(total, counted, out=np.zeros_like(total), where=there)
    means: FloatArray = of_rows.sum(axis=2) / there.sum(axis=1)
    return means
