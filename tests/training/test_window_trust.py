"""Trust is learned: useless evidence loses its weight, and what helps keeps it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.retrieval.windows.shapes import EVEN, asked_bumpy
from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import FloatArray, IntArray
from workers.retrieval.windows.evidence import Evidence
from workers.retrieval.windows.trust import NOT_VERIFIED, Trust, saturated
from workers.training.window_trust import WindowQueries, learn_trust, window_impostors

QUERIES, TARGETS, SCALES = 60, 12, 3


def synthetic(rng: np.random.Generator, *, useful: str) -> WindowQueries:
    """Queries of which one kind of evidence is 0.2 for the true target and 0.8 for others."""
    truth = rng.integers(0, TARGETS, QUERIES)
    own = np.arange(TARGETS) == truth[:, None]  # (q, n)

    def drawn(name: str) -> FloatArray:
        noise = rng.uniform(0.0, 1.0, (QUERIES, TARGETS))
        good = np.where(own, 0.2, 0.8) + 0.1 * noise
        return good if name == useful else noise

    windows = np.repeat(drawn("windows")[:, :, None], SCALES, axis=2)
    return WindowQueries(
        features=np.column_stack([np.ones(QUERIES), np.zeros((QUERIES, 3))]),
        distances=drawn("distance"),
        around=windows,
        facing=windows,
        log_consistency=-2.0 * drawn("consistency"),
        truth=truth,
        transformations=("isometry",) * (QUERIES // 2) + ("partial",) * (QUERIES // 2),
    )


def picked(queries: WindowQueries, rows: IntArray) -> WindowQueries:
    """Some of the queries; one may come again."""
    return WindowQueries(
        queries.features[rows],
        queries.distances[rows],
        queries.around[rows],
        queries.facing[rows],
        queries.log_consistency[rows],
        queries.truth[rows],
        tuple(queries.transformations[row] for row in rows),
    )


def joined(one: WindowQueries, other: WindowQueries) -> WindowQueries:
    """The queries of both; their transformations are other ones."""
    return WindowQueries(
        np.concatenate([one.features, other.features]),
        np.concatenate([one.distances, other.distances]),
        np.concatenate([one.around, other.around]),
        np.concatenate([one.facing, other.facing]),
        np.concatenate([one.log_consistency, other.log_consistency]),
        np.concatenate([one.truth, other.truth]),
        tuple(f"{name} of one" for name in one.transformations) + other.transformations,
    )


def hits(queries: WindowQueries, trust: Trust) -> float:
    """Share of the queries whose true target is first."""
    distances, _ = queries.fused(trust)
    return float((distances.argmin(axis=1) == queries.truth).mean())


@pytest.mark.parametrize("useful", ["distance", "windows", "consistency"])
def test_what_says_nothing_is_not_trusted(useful: str) -> None:
    queries = synthetic(np.random.default_rng(1), useful=useful)
    trust = learn_trust(queries)
    weights = trust.weights(asked_bumpy(1))
    moved = {  # by how much it moves scores
        "distance": weights.distance * saturated(queries.distances, trust.most_distance),
        "windows": weights.windows * saturated(queries.around[:, :, 0], trust.most_windows),
        "consistency": weights.consistency * queries.log_consistency,
    }
    said = float(moved.pop(useful).std())
    assert all(said > 2.0 * float(noise.std()) for noise in moved.values())
    assert hits(queries, trust) > 0.95 > hits(queries, EVEN)
    fresh = synthetic(np.random.default_rng(2), useful=useful)
    assert hits(fresh, trust) > 0.9


def test_whom_to_trust_depends_on_what_a_query_shows() -> None:
    """Windows are useless of rough queries, distances of those with a boundary."""
    rng = np.random.default_rng(3)
    parts, rough = (synthetic(rng, useful=name) for name in ("windows", "distance"))
    parts.features[:, 1], rough.features[:, 2] = 1.0, 1.0
    both = joined(parts, rough)
    trust = learn_trust(both)
    query = asked_bumpy(1)
    of_part = trust.weights(replace(query, boundary=7.0, roughness=0.0, n_vertices=5000))
    of_rough = trust.weights(replace(query, boundary=0.0, roughness=40.0, n_vertices=5000))
    assert of_part.windows > 2.0 * of_part.distance
    assert of_rough.distance > 2.0 * of_rough.windows
    assert hits(both, trust) > 0.9


def test_the_same_queries_teach_the_same() -> None:
    one, other = (
        learn_trust(synthetic(np.random.default_rng(4), useful="windows")) for _ in range(2)
    )
    assert one == other
    assert Trust.from_json(one.to_json()) == one


def test_few_queries_leave_what_was_known_of_others() -> None:
    """Starting from what many taught, three that say nothing of noise do not take it back."""
    many = learn_trust(synthetic(np.random.default_rng(6), useful="windows"))
    few = picked(synthetic(np.random.default_rng(7), useful="windows"), np.arange(3))
    again = synthetic(np.random.default_rng(8), useful="windows")
    assert hits(again, learn_trust(few, many)) >= hits(again, learn_trust(few))
    assert hits(again, learn_trust(few, many)) > 0.9
    assert learn_trust(few, many) != learn_trust(few)


def test_all_transformations_have_the_same_share() -> None:
    """Of two kinds that say the opposite, the one with more queries does not outvote the other."""
    rng = np.random.default_rng(5)
    both = joined(synthetic(rng, useful="windows"), synthetic(rng, useful="distance"))
    rows = np.arange(2 * QUERIES)
    later = rows[rows >= QUERIES]  # of which distances are useful
    more = picked(both, np.concatenate([rows, later, later]))
    one, other = (learn_trust(queries).weights(asked_bumpy(1)) for queries in (both, more))
    assert_allclose(other.windows / other.distance, one.windows / one.distance, rtol=0.02)
    named = replace(more, transformations=("all",) * len(more.truth))
    outvoted = learn_trust(named).weights(asked_bumpy(1))
    assert outvoted.windows / outvoted.distance < 0.9 * one.windows / one.distance


@pytest.mark.parametrize("facing", [(-1.0, 0.3), (800.0, 0.0), (-800.0, 0.0)])
def test_it_learns_on_the_distances_that_searches_have(facing: tuple[float, float]) -> None:
    rng = np.random.default_rng(6)
    trust = replace(EVEN, facing=facing, windows=(1.0, 0.5, 0.2, 0.1))
    known = []
    for number, (places, scales) in enumerate([([0, 2, 5], 3), ([1, 2], 1), ([], 3)]):
        shape = len(places), scales
        found = Evidence(
            np.array(places, dtype=np.int64),
            rng.uniform(0.1, 1.0, shape),
            rng.uniform(0.1, 1.0, shape),
            rng.uniform(NOT_VERIFIED, 0.0, len(places)),
            np.ones(len(places)),
        )
        query = replace(asked_bumpy(1), boundary=2.0 * number, roughness=10.0 * number)
        known.append((query, rng.uniform(0.0, 1.0, 6), found))
    queries = WindowQueries.of(known, [0, 1, 2], ["all", "noise", "view"])
    distances, totals = queries.fused(trust)
    for row, (query, own, found) in enumerate(known):
        weights = trust.weights(query)
        assert_allclose(distances[row], found.fused(own, weights), rtol=1e-12)
        assert totals[row] == pytest.approx(weights.distance + weights.windows)
    assert (queries.truth.tolist(), queries.transformations) == (
        [0, 1, 2],
        ("all", "noise", "view"),
    )


def test_impostors_are_the_distances_of_wrong_targets() -> None:
    queries = synthetic(np.random.default_rng(7), useful="windows")
    trust = learn_trust(queries)
    distances, _ = queries.fused(trust)
    quantiles = window_impostors(queries, trust)
    right = distances[np.arange(QUERIES), queries.truth]
    assert list(quantiles) == sorted(quantiles)
    assert np.median(right) < quantiles[0]


def test_nothing_to_learn_from_is_refused() -> None:
    queries = synthetic(np.random.default_rng(8), useful="windows")
    none = picked(queries, np.arange(0))
    with pytest.raises(InsufficientTrainingDataError, match="0 queries among 12"):
        learn_trust(none)
    single = replace(
        queries,
        distances=queries.distances[:, :1],
        around=queries.around[:, :1],
        facing=queries.facing[:, :1],
        log_consistency=queries.log_consistency[:, :1],
        truth=np.zeros(QUERIES, dtype=np.int64),
    )
    with pytest.raises(InsufficientTrainingDataError, match="60 queries among 1 "):
        learn_trust(single)
