"""The ranking loss: its gradient, its minimum, and who counts as an impostor."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import approx_fprime
from scipy.special import log_softmax

from workers.geometry.arrays import FloatArray
from workers.training.ranking_loss import RankingTerms, learn_weights, ranking_loss, ranks


def some_terms(seed: int = 0, *, channels: int = 4, telling: int = 1) -> RankingTerms:
    rng = np.random.default_rng(seed)
    n_queries, n_references = 40, 12
    terms = rng.uniform(0.5, 1.5, size=(channels, n_queries, n_references))
    truth = rng.integers(n_references, size=n_queries)
    terms[:telling, np.arange(n_queries), truth] -= 0.4
    excluded = np.zeros((n_queries, n_references), dtype=np.bool_)
    shares = np.full(n_queries, 1.0 / n_queries)
    return RankingTerms(terms.astype(np.float32), truth, excluded, shares)


def test_the_loss_is_the_cross_entropy_of_a_softmax() -> None:
    terms, weights = some_terms(), np.array([3.0, 1.0, 0.5, 2.0])
    expected = -log_softmax(-terms.distances(weights), axis=1)[np.arange(40), terms.truth].mean()
    assert ranking_loss(terms, weights) == pytest.approx(expected)


def test_the_minimum_has_no_way_down() -> None:
    terms = some_terms(telling=2)
    weights = learn_weights(terms, np.ones(4), ridge=0.0)

    def loss(at: FloatArray) -> float:
        return ranking_loss(terms, at)

    slope = approx_fprime(weights, loss, 1e-4)
    assert np.all(weights >= 0.0)
    assert np.all(slope > -2e-3)  # the ridge, and float32 terms
    assert np.all(np.abs(slope[weights > 1e-6]) < 5e-3)


def test_channels_that_tell_nothing_get_next_to_no_weight() -> None:
    weights = learn_weights(some_terms(telling=1), np.ones(4), ridge=0.0)
    assert weights[0] > 5.0 * weights[1:].max()


def test_a_ridge_evens_the_weights_out() -> None:
    terms = some_terms(telling=1)
    spreads = [np.ptp(learn_weights(terms, np.ones(4), ridge=ridge)) for ridge in (0.0, 0.1, 10.0)]
    assert spreads[0] > 2.0 * spreads[1] > 10.0 * spreads[2]


def test_a_channel_of_another_kind_is_not_evened_out() -> None:
    """Two points among a hundred scanned channels may have half of the weight."""
    terms = some_terms(channels=6, telling=1)
    other = replace(terms, alike=np.array([False] + [True] * 5))
    evened, free = (learn_weights(each, np.ones(6), ridge=10.0) for each in (terms, other))
    assert free[0] / free.sum() > 2.0 * evened[0] / evened.sum()
    assert np.ptp(free[1:]) < 0.1
    assert_array_equal(other.queries(np.arange(3)).channels(np.array([0, 2])).alike, [False, True])


def test_the_start_does_not_matter() -> None:
    terms = some_terms(telling=2)
    found = [learn_weights(terms, start) for start in (np.ones(4), np.array([9.0, 0.0, 4.0, 0.1]))]
    assert_allclose(found[0], found[1], atol=0.05)


def test_a_rank_counts_whoever_is_as_near() -> None:
    terms = np.ones((1, 2, 3), dtype=np.float32)
    terms[0, 0] = [0.5, 0.2, 0.5]  # the query's own is 0: 1 is nearer, 2 level
    excluded = np.zeros((2, 3), dtype=np.bool_)
    made = RankingTerms(terms, np.array([0, 1]), excluded, np.array([0.5, 0.5]))
    assert ranks(made, np.ones(1)).tolist() == [3, 3]


def test_who_is_excluded_counts_neither_in_loss_nor_rank() -> None:
    terms = some_terms()
    worst = terms.distances(np.ones(4)).argmin(axis=1)
    excluded = terms.excluded.copy()
    excluded[np.arange(40), worst] = worst != terms.truth
    lenient = RankingTerms(terms.terms, terms.truth, excluded, terms.importance)
    assert ranking_loss(lenient, np.ones(4)) < ranking_loss(terms, np.ones(4))
    assert np.all(ranks(lenient, np.ones(4)) <= ranks(terms, np.ones(4)))


def test_queries_and_channels_can_be_chosen() -> None:
    terms, weights = some_terms(), np.array([1.0, 2.0, 3.0, 4.0])
    some = terms.queries(np.arange(0, 40, 4))
    assert some.importance.sum() == pytest.approx(1.0)
    assert_allclose(some.distances(weights), terms.distances(weights)[::4], rtol=1e-6)
    only = terms.channels(np.array([1, 3]))
    expected = terms.distances(np.array([0.0, 2.0, 0.0, 4.0]))
    assert_allclose(only.distances(weights[[1, 3]]), expected, rtol=1e-6)
