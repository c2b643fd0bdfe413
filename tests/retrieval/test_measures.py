"""Measures of retrieval against loops written out, and hand-made lists."""

from dataclasses import astuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.retrieval.leave_one_out import leave_one_out
from workers.errors import InvalidRequestError
from workers.retrieval.measures import (
    RetrievalMeasures,
    mean_measures,
    precision_at_recall,
    retrieval_measures,
)

PERFECT_OF_THREE = RetrievalMeasures(1.0, 1.0, 1.0, 2 * 3 / 35, 1.0, 1.0)


def written_out(relevant: list[bool]) -> list[float]:
    """Every measure as its definition reads."""
    count = sum(relevant)
    precision = sum(relevant[:32]) / 32
    recall = sum(relevant[:32]) / count
    gain = sum(1 / max(1.0, np.log2(i)) for i, hit in enumerate(relevant, 1) if hit)
    best = sum(1 / max(1.0, np.log2(i)) for i in range(1, count + 1))
    precisions = [sum(relevant[:i]) / i for i, hit in enumerate(relevant, 1) if hit]
    return [
        float(relevant[0]),
        sum(relevant[:count]) / count,
        sum(relevant[: 2 * count]) / count,
        2 / (1 / precision + 1 / recall) if recall else 0.0,
        gain / best,
        sum(precisions) / count,
    ]


@pytest.mark.parametrize("seed", range(8))
def test_measures_are_their_definitions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    relevant = rng.random(60) < 0.2
    relevant[5] = True
    found = retrieval_measures(relevant)
    assert_allclose(astuple(found), written_out(relevant.tolist()), rtol=1e-12)


def test_a_perfect_list_has_measures_of_one() -> None:
    assert retrieval_measures(np.array([True] * 3 + [False] * 9)) == PERFECT_OF_THREE


@pytest.mark.parametrize("rank", [1, 2, 7])
def test_average_precision_of_one_relevant_shape_is_one_over_its_rank(rank: int) -> None:
    relevant = np.arange(1, 11) == rank
    assert retrieval_measures(relevant).average_precision == pytest.approx(1 / rank)


def test_a_swap_towards_the_front_never_makes_anything_worse() -> None:
    rng = np.random.default_rng(9)
    relevant = rng.random(50) < 0.3
    for i in np.flatnonzero(np.diff(relevant.astype(int)) == 1):
        better = relevant.copy()
        better[[i, i + 1]] = better[[i + 1, i]]
        before, after = retrieval_measures(relevant), retrieval_measures(better)
        assert after.average_precision > before.average_precision
        for name in ("nearest_neighbour", "first_tier", "second_tier", "e_measure", "dcg"):
            assert getattr(after, name) >= getattr(before, name)


@pytest.mark.parametrize("n", [0, 4])
def test_a_list_without_a_relevant_shape_is_refused(n: int) -> None:
    nothing = np.zeros(n, dtype=bool)
    with pytest.raises(InvalidRequestError, match="expected at least 1"):
        retrieval_measures(nothing)
    with pytest.raises(InvalidRequestError, match="expected at least 1"):
        precision_at_recall(nothing, recalls=np.array([0.5]))


def test_leave_one_out_leaves_the_query_out() -> None:
    places = np.array([0.0, 1.0, 5.0, 6.0, 2.9, 100.0])
    labels = ["a", "a", "b", "b", None, "alone"]
    distances = np.abs(places[:, None] - places)
    np.fill_diagonal(distances, 55.0)  # whatever stands there is not looked at
    found = leave_one_out(distances, labels)
    assert sorted(found) == [0, 1, 2, 3]
    assert [found[i].nearest_neighbour for i in range(4)] == [1.0, 1.0, 1.0, 1.0]
    places[4] = 5.4
    closer = leave_one_out(np.abs(places[:, None] - places), labels)
    assert [closer[i].nearest_neighbour for i in range(4)] == [1.0, 1.0, 0.0, 0.0]
    assert closer[2].average_precision == pytest.approx(0.5)


def test_a_mean_of_nothing_is_refused() -> None:
    with pytest.raises(InvalidRequestError):
        mean_measures([])


def test_precision_is_the_best_at_that_recall_or_beyond() -> None:
    relevant = np.array([True, False, False, True, True, False, True])
    found = precision_at_recall(relevant, recalls=np.array([0.0, 0.25, 0.3, 0.5, 0.75, 1.0]))
    assert_allclose(found, [1.0, 1.0, 3 / 5, 3 / 5, 3 / 5, 4 / 7])
