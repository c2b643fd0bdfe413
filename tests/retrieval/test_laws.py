"""Laws of comparing and ranking, on whatever descriptors there may be."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal

from tests.retrieval.test_points import LOCAL
from tests.retrieval.test_scan import COMMUTE, DNA, HEAT, MIXED
from workers.geometry.arrays import Float32Array
from workers.retrieval.channels import Channel
from workers.retrieval.dissimilarity import DISSIMILARITIES
from workers.retrieval.fusion import fuse
from workers.retrieval.scan import distances, nearest, rerank

POINTED = replace(MIXED, name="pointed", channels=(HEAT, LOCAL, DNA, COMMUTE))
METRICS = replace(  # l1, hellinger, l2: each a metric
    MIXED,
    name="metrics",
    channels=(HEAT, replace(COMMUTE, dissimilarity="hellinger"), DNA),
)
SEEDS = st.integers(0, 2**32 - 1)
POWERS = st.floats(0.05, 1.0)


def rows_of(dimension: int, n: int, seed: int) -> Float32Array:
    """Rows that are not negative."""
    rng = np.random.default_rng(seed)
    return rng.gamma(0.5, size=(n, dimension)).astype(np.float32)


@settings(max_examples=60, deadline=None)
@given(
    row=arrays(np.float32, 12, elements=st.floats(0.0, 1e6, width=32)),
    channel=st.sampled_from([HEAT, DNA, COMMUTE, LOCAL]),
    name=st.sampled_from([None, *DISSIMILARITIES]),
)
def test_equal_vectors_differ_in_nothing(
    row: Float32Array, channel: Channel, name: str | None
) -> None:
    vector = np.resize(row, channel.dimension)
    asked = name if channel.is_distribution else None
    rows = np.stack([vector, vector])
    assert channel.compare(vector, rows, dissimilarity=asked).tolist() == [0.0, 0.0]


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, power=POWERS)
def test_the_fused_distance_of_metrics_is_a_metric(seed: int, power: float) -> None:
    model = replace(METRICS, fusion_power=power)
    rows = rows_of(model.dimension, 5, seed)
    matrix = np.stack([distances(row, rows, model) for row in rows])  # (5, 5)
    slack = 1e-9 * matrix.max()  # rounding
    assert np.all(np.diag(matrix) == 0.0)
    assert np.all(matrix + np.eye(5) > 0.0)
    assert np.all(np.abs(matrix - matrix.T) <= slack)
    detours = matrix[:, :, None] + matrix[None]  # (from, by, to)
    assert np.all(matrix <= detours.min(axis=1) + slack)


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, n=st.integers(1, 40), depth=st.integers(1, 12), limit=st.integers(1, 50))
def test_a_ranking_does_not_depend_on_the_order_of_rows(
    seed: int, n: int, depth: int, limit: int
) -> None:
    rng = np.random.default_rng(seed)
    rows = rows_of(POINTED.dimension, 1, seed) + rng.integers(0, 3, size=(n, 1)) / 4.0  # many ties
    query = rows[0]
    ids = [f"id-{number:02}" for number in rng.permutation(n)]

    def ranked(order: list[int]) -> list[tuple[str, float]]:
        some = rows[order]
        scanned = distances(query, some, POINTED)
        found = rerank(query, some.__getitem__, scanned, POINTED, depth=depth)
        names = [ids[i] for i in order]
        return [(names[i], float(found[i])) for i in nearest(found, names, limit)]

    expected = ranked(list(range(n)))
    assert ranked(rng.permutation(n).tolist()) == expected
    assert len(expected) == min(limit, n)


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, power=POWERS, factor=st.floats(1.0, 1e9))
def test_no_channel_takes_a_row_farther_than_its_largest_term(
    seed: int, power: float, factor: float
) -> None:
    rows = rows_of(LOCAL.dimension, 4, seed)
    found = LOCAL.compare(rows[0], factor * rows)
    largest = fuse([np.full(4, np.inf)], [LOCAL], power=power)
    assert np.all(fuse([found], [LOCAL], power=power) <= largest)
    assert_array_equal(largest, np.full(4, LOCAL.weight * 16.0**power))
