"""Ranks and measures of queries against a second implementation, in small memory."""

import json
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.retrieval.leave_one_out import leave_one_out
from workers.geometry.arrays import FloatArray
from workers.retrieval.protocol import EvaluatedShape, Protocol, make_protocol
from workers.retrieval.ranking import RECALLS, Ranking, join_rankings, rank_queries
from workers.retrieval.scan import nearest


def random_protocol(rng: np.random.Generator, n: int, *, transformed: bool) -> Protocol:
    """Shapes of five labels and of none; their ids say nothing of their order."""
    labels = ["a", "b", "c", "d", "e", None]
    kinds = ["holes", "noise", "null", None, "null"] if transformed else ["null", None]
    ids = rng.permutation(n)
    return make_protocol(
        EvaluatedShape(
            f"id-{i:04}", "", labels[rng.integers(6)], kinds[rng.integers(len(kinds))], None
        )
        for i in ids
    )


@pytest.mark.parametrize("transformed", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_ranks_are_those_of_a_plain_sort(seed: int, transformed: bool) -> None:
    rng = np.random.default_rng(seed)
    protocol = random_protocol(rng, 60, transformed=transformed)
    gaps = rng.integers(0, 9, (len(protocol.queries), len(protocol.targets))) / 7.0  # many ties
    found = rank_queries(protocol, gaps.__getitem__)
    precisions = []
    for place, query in enumerate(protocol.queries.tolist()):
        own = protocol.shapes[query]
        listed = sorted(
            (gaps[place, j], protocol.shapes[t].id, protocol.shapes[t].label)
            for j, t in enumerate(protocol.targets.tolist())
            if t != query
        )
        ranks = [r for r, (_, _, label) in enumerate(listed, 1) if label == own.label]
        outcome = found.outcomes[place]
        assert outcome.rank == ranks[0]
        assert outcome.top == tuple(name for _, name, _ in listed[:10])
        average = np.mean([hits / r for hits, r in enumerate(ranks, 1)])
        assert outcome.measures.average_precision == pytest.approx(average)
        curve = [(hits / len(ranks), hits / r) for hits, r in enumerate(ranks, 1)]
        precisions.append([max(p for recall, p in curve if recall >= at - 1e-9) for at in RECALLS])
    assert_allclose(found.precision, np.mean(precisions, axis=0), rtol=1e-12)


def test_one_relevant_target_scores_one_over_its_rank_ties_by_id() -> None:
    protocol = make_protocol(
        [EvaluatedShape(f"t{i}", "", label, "null") for i, label in enumerate("cat")]
        + [EvaluatedShape("q0", "", "t", "holes", 1), EvaluatedShape("q1", "", "c", "holes", 1)]
    )
    found = rank_queries(protocol, np.array([[0.2, 0.1, 0.2], [0.3, 0.3, 0.3]]).__getitem__)
    assert [one.rank for one in found.outcomes] == [3, 1]
    assert [one.measures.average_precision for one in found.outcomes] == [1 / 3, 1.0]
    assert found.outcomes[0].top == ("t1", "t0", "t2")
    assert_allclose(found.precision, np.full(21, (1 / 3 + 1.0) / 2))


def test_the_order_is_that_of_the_search() -> None:
    rng = np.random.default_rng(8)
    protocol = random_protocol(rng, 80, transformed=True)
    gaps = rng.integers(0, 4, (len(protocol.queries), len(protocol.targets))) / 3.0
    ids = [protocol.shapes[t].id for t in protocol.targets.tolist()]
    for place, outcome in enumerate(rank_queries(protocol, gaps.__getitem__).outcomes):
        assert outcome.top == tuple(ids[i] for i in nearest(gaps[place], ids, 10))


def test_leave_one_out_is_that_of_the_measures() -> None:
    rng = np.random.default_rng(4)
    protocol = random_protocol(rng, 50, transformed=False)
    gaps = rng.integers(0, 12, (50, 50)) / 11.0
    expected = leave_one_out(gaps, [shape.label for shape in protocol.shapes])
    assert protocol.queries.tolist() == sorted(expected)
    found = rank_queries(protocol, gaps[protocol.queries].__getitem__)
    for query, outcome in zip(protocol.queries.tolist(), found.outcomes, strict=True):
        assert outcome.measures == expected[query]


def test_a_ranking_survives_being_stored_bit_for_bit() -> None:
    rng = np.random.default_rng(5)
    protocol = random_protocol(rng, 40, transformed=True)
    gaps = rng.random((len(protocol.queries), len(protocol.targets)))
    found = rank_queries(protocol, gaps.__getitem__)
    again = Ranking.from_json(json.loads(json.dumps(found.to_json())))
    assert again.outcomes == found.outcomes
    assert again.precision.tolist() == found.precision.tolist()


def test_some_at_a_time_are_all() -> None:
    rng = np.random.default_rng(6)
    protocol = random_protocol(rng, 70, transformed=True)
    gaps = rng.random((len(protocol.queries), len(protocol.targets)))
    n = len(protocol.queries)
    whole = rank_queries(protocol, gaps.__getitem__)
    ranges = [range(start, min(start + 9, n)) for start in range(0, n, 9)]
    parts = [rank_queries(protocol, gaps.__getitem__, places=places) for places in ranges]
    joined = join_rankings(parts)
    assert joined.outcomes == whole.outcomes
    assert_allclose(joined.precision, whole.precision, rtol=1e-12)
    assert join_rankings([whole]) is whole


def test_many_queries_need_the_memory_of_one_row() -> None:
    """1540 queries on 254 targets: a matrix alone would be 3 MB, its ranks as much again."""
    shapes = [EvaluatedShape(f"t{i:04}", "", f"{i}", "null") for i in range(254)]
    shapes += [EvaluatedShape(f"q{i:04}", "", f"{i % 20}", "holes", 1) for i in range(1540)]
    protocol = make_protocol(shapes)

    def gaps(place: int) -> FloatArray:
        return np.random.default_rng(place).random(254)

    rank_queries(make_protocol(shapes[:300]), gaps)
    tracemalloc.start()
    found = rank_queries(protocol, gaps)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(found.outcomes) == 1540
    assert peak < 2.5e6
