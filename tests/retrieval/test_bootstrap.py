"""Intervals: what they must be where it is known, and how often they cover the truth."""

import tracemalloc
from dataclasses import astuple

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray
from workers.retrieval.bootstrap import RowMeans, difference, interval, mean_of_rows


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20101)


def queries(rng: np.random.Generator, n_labels: int = 12) -> tuple[FloatArray, IntArray, IntArray]:
    """Scores (2, q), rows and labels of a table of three rows, not all of them full."""
    rows = np.repeat(np.arange(3), 4 * n_labels)
    labels = np.tile(np.repeat(np.arange(n_labels), 4), 3)
    kept = rng.random(len(rows)) < 0.8
    return rng.random((2, int(kept.sum()))), rows[kept], labels[kept]


def test_the_mean_of_rows_counts_every_row_alike() -> None:
    scores = np.array([[1.0, 1.0, 1.0, 0.0, 0.5]])
    rows, labels = np.array([4, 4, 4, 4, 7]), np.array([0, 0, 1, 2, 1])
    found = mean_of_rows(scores, rows, labels, seed=1)
    assert_allclose(found.values, [(0.75 + 0.5) / 2])
    together = mean_of_rows(scores, np.zeros(5, dtype=np.int64), labels, seed=1)
    assert_allclose(together.values, [3.5 / 5])


def test_constant_scores_have_no_width(rng: np.random.Generator) -> None:
    _, rows, labels = queries(rng)
    found = mean_of_rows(np.full((1, len(rows)), 0.7), rows, labels, seed=2)
    its = interval(found.values[0], found.samples[0])
    assert_allclose(np.array(astuple(its), dtype=np.float64), 0.7, rtol=1e-12)


def test_equal_models_do_not_differ_and_a_shift_is_found_exactly(rng: np.random.Generator) -> None:
    scores, rows, labels = queries(rng)
    three = np.vstack([scores[0], scores[0], scores[0] + 0.125])
    found = mean_of_rows(three, rows, labels, seed=3)
    same = difference(found, 1, 0)
    assert (same.value, same.low, same.high) == (0.0, 0.0, 0.0)
    shifted = difference(found, 2, 0)
    assert_allclose(np.array(astuple(shifted), dtype=np.float64), 0.125, rtol=1e-12)


def test_the_same_seed_gives_the_same_interval_whatever_else_is_measured(
    rng: np.random.Generator,
) -> None:
    scores, rows, labels = queries(rng)
    both = mean_of_rows(scores, rows, labels, seed=4)
    alone = mean_of_rows(scores[1:], rows, labels, seed=4)
    assert_allclose(alone.samples[0], both.samples[1], rtol=1e-12)
    again = mean_of_rows(scores, rows, labels, seed=4)
    assert_array_equal(again.samples, both.samples)
    assert np.any(mean_of_rows(scores, rows, labels, seed=5).samples != both.samples)


def test_a_resampling_is_the_table_of_the_drawn_labels(rng: np.random.Generator) -> None:
    """Second implementation: repeat the queries of the drawn labels, and take means of rows."""
    scores, rows, labels = queries(rng, n_labels=4)
    found = mean_of_rows(scores, rows, labels, seed=6, resamplings=50)
    draws = np.random.default_rng(6).multinomial(4, np.full(4, 0.25), size=50)
    for column, drawn in enumerate(draws):
        of_rows = []
        for row in np.unique(rows):
            chosen = [i for i in np.flatnonzero(rows == row) for _ in range(drawn[labels[i]])]
            if chosen:
                of_rows.append(scores[:, chosen].mean(axis=1))
        assert_allclose(found.samples[:, column], np.mean(of_rows, axis=0), rtol=1e-12)


def test_one_label_tells_nothing_of_others() -> None:
    found = mean_of_rows(np.array([[0.0, 1.0]]), np.array([0, 1]), np.array([3, 3]), seed=7)
    its = interval(found.values[0], found.samples[0])
    assert (its.value, its.low, its.high) == (0.5, None, None)
    two = RowMeans(np.array([0.2, 0.7]), np.empty((2, 0)))
    assert difference(two, 1, 0).low is None


def test_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    """Labels have means drawn around 0.6, and their queries scatter little about those.

    From 25 labels, percentile intervals of 95 % hold the truth 92 times in a hundred (measured over
    1,000 simulations; a standard error of 1.4 over these 400); drawn over queries, 47 times.
    """
    rng = np.random.default_rng(8)
    labels = np.repeat(np.arange(25), 8)
    rows = np.tile(np.arange(4), 50)
    held = held_over_queries = 0
    for seed in range(400):
        means = 0.6 + 0.15 * rng.standard_normal(25)
        scores = means[labels] + 0.02 * rng.standard_normal(200)
        held += covers(0.6, scores, rows, labels, seed)
        held_over_queries += covers(0.6, scores, rows, np.arange(200), seed)
    assert 0.88 < held / 400 < 0.97
    assert held_over_queries / 400 < 0.6


def covers(truth: float, scores: FloatArray, rows: IntArray, labels: IntArray, seed: int) -> bool:
    found = mean_of_rows(scores[None], rows, labels, seed=seed, resamplings=200)
    its = interval(found.values[0], found.samples[0])
    assert its.low is not None
    assert its.high is not None
    return its.low <= truth <= its.high


def test_width_falls_with_the_root_of_the_number_of_labels(rng: np.random.Generator) -> None:
    widths = []
    for n in (20, 320):
        scores = rng.random((1, n))
        labels = np.arange(n)
        found = mean_of_rows(scores, np.zeros(n, dtype=np.int64), labels, seed=9)
        widths.append(found.samples.std() / scores.std())
    assert_allclose(widths, [20**-0.5, 320**-0.5], rtol=0.1)  # of 2,000 resamplings


def test_many_labels_do_not_fill_the_memory() -> None:
    rng = np.random.default_rng(10)
    labels = np.arange(5000)
    rows = labels % 7
    tracemalloc.start()
    mean_of_rows(rng.random((6, 5000)), rows, labels, seed=11)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 60e6  # all draws at once would be 80e6, twice


@pytest.mark.parametrize(("n_scores", "n_rows", "n_labels"), [(0, 0, 0), (3, 2, 3), (3, 3, 2)])
def test_sizes_that_do_not_belong_together_are_refused(
    n_scores: int, n_rows: int, n_labels: int
) -> None:
    rows, labels = np.zeros(n_rows, dtype=np.int64), np.zeros(n_labels, dtype=np.int64)
    with pytest.raises(InvalidRequestError):
        mean_of_rows(np.zeros((1, n_scores)), rows, labels, seed=0)
