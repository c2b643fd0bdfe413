"""The scan: the distance's formula, bit-for-bit rows, order and similarity."""

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from workers.diffusion.kernels import CommuteTimeKernel, HeatKernel
from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array
from workers.geometry.views import default_view
from workers.retrieval.calibration import typical_distance
from workers.retrieval.channels import DistanceChannel, EigenvalueChannel, Histogram
from workers.retrieval.dissimilarity import DISSIMILARITIES
from workers.retrieval.model import Model
from workers.retrieval.scan import distances, nearest, similarity

EDGES = Histogram(tuple((np.linspace(0.0, 2.0, 41) ** 1.5).tolist()))
HEAT = DistanceChannel(name="heat", view="closed", kernel=HeatKernel(0.2), summary=EDGES, scale=0.4)
COMMUTE = replace(
    HEAT, name="commute", kernel=CommuteTimeKernel(), dissimilarity="hellinger", weight=2.0
)
DNA = EigenvalueChannel(
    name="dna",
    view="closed",
    normalisation="area",
    numbers=tuple(range(1, 8)),
    dissimilarity="l2",
)
MIXED = Model("mixed", "bank", {}, (default_view(),), (HEAT, DNA, COMMUTE), fusion_power=0.25)
PLAIN = replace(MIXED, name="plain", channels=(HEAT, COMMUTE), fusion_power=1.0)


def descriptors(model: Model, n: int, *, seed: int = 0) -> Float32Array:
    """Rows (n, d) as `describe` would make them."""
    rng = np.random.default_rng(seed)
    rows = rng.gamma(0.8, size=(n, model.dimension))
    for channel in model.channels:
        part = rows[:, model.slices[channel.name]]
        if channel.is_distribution:
            part /= part.sum(axis=1, keepdims=True)
    return rows.astype(np.float32)


def test_the_distance_is_the_weighted_sum_of_its_channels() -> None:
    rows = descriptors(MIXED, 50)
    expected = np.zeros(50)
    for channel in MIXED.channels:
        part = MIXED.slices[channel.name]
        compare = DISSIMILARITIES[channel.dissimilarity]
        single = compare(rows[3, part].astype(np.float64), rows[:, part], channel.widths)
        expected += channel.weight * (single / channel.scale) ** 0.25
    assert_allclose(distances(rows[3], rows, MIXED), expected, rtol=1e-12)


def test_another_dissimilarity_takes_the_place_of_every_channels_own() -> None:
    rows = descriptors(PLAIN, 30)
    everywhere = replace(
        PLAIN, channels=tuple(replace(c, dissimilarity="earth-movers") for c in PLAIN.channels)
    )
    found = distances(rows[0], rows, PLAIN, dissimilarity="earth-movers")
    assert_array_equal(found, distances(rows[0], rows, everywhere))
    assert np.any(found != distances(rows[0], rows, PLAIN))


def test_dissimilarities_of_distributions_do_not_apply_to_eigenvalues() -> None:
    rows = descriptors(MIXED, 3)
    with pytest.raises(InvalidRequestError, match="possible are l1, l2, linf"):
        distances(rows[0], rows, MIXED, dissimilarity="chi-squared")
    assert distances(rows[0], rows, MIXED, dissimilarity="linf").shape == (3,)


@pytest.mark.parametrize("model", [MIXED, PLAIN])
def test_a_distance_is_bit_for_bit_the_same_in_any_matrix(model: Model, tmp_path: Path) -> None:
    rows = descriptors(model, 7001)  # several chunks
    query = rows[4]
    expected = distances(query, rows, model)
    order = np.random.default_rng(1).permutation(len(rows))
    assert_array_equal(distances(query, rows[order], model), expected[order])
    for start, stop in ((0, 1), (1, 4), (17, 18), (100, 5000), (7000, 7001)):
        assert_array_equal(distances(query, rows[start:stop], model), expected[start:stop])
    np.save(tmp_path / "matrix.npy", rows)
    mapped = np.load(tmp_path / "matrix.npy", mmap_mode="r")
    assert_array_equal(distances(query, mapped, model), expected)
    assert_array_equal(distances(query, np.asfortranarray(rows), model), expected)


@pytest.mark.parametrize("model", [MIXED, PLAIN])
def test_a_shapes_nearest_neighbour_is_itself(model: Model) -> None:
    rows = descriptors(model, 60)
    for i, row in enumerate(rows):
        found = distances(row, rows, model)
        assert found[i] == 0.0
        assert np.all(np.delete(found, i) > 0.0)


def test_memory_does_not_grow_with_the_matrix() -> None:
    rows = descriptors(PLAIN, 100_000)
    tracemalloc.start()
    distances(rows[0], rows, PLAIN)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 16e6  # a float64 copy of the matrix alone would be 64e6


@pytest.mark.parametrize(("query", "width"), [(79, 80), (80, 79), (81, 81)])
def test_sizes_that_do_not_fit_the_model_are_refused(query: int, width: int) -> None:
    with pytest.raises(InvalidRequestError, match="80 numbers"):
        distances(np.zeros(query, np.float32), np.zeros((4, width), np.float32), PLAIN)


def test_an_empty_collection_has_no_distances() -> None:
    assert distances(descriptors(PLAIN, 1)[0], descriptors(PLAIN, 0), PLAIN).shape == (0,)


@pytest.mark.parametrize("seed", range(5))
def test_order_is_by_distance_then_by_id(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 6, size=200) / 7.0  # many ties
    ids = [f"id-{number}" for number in rng.permutation(200)]
    expected = sorted(range(200), key=lambda i: (values[i], ids[i]))
    for limit in (0, 1, 10, 199, 200, 500):
        found = nearest(values, ids, limit)
        assert found.dtype == np.int64
        assert found.tolist() == expected[:limit]


def test_order_does_not_depend_on_where_rows_stand() -> None:
    values = np.array([0.5, 0.25, 0.5, 0.25])
    ids = ["d", "c", "b", "a"]
    answer = [ids[i] for i in nearest(values, ids, 3)]
    assert answer == ["a", "c", "b"]
    assert [ids[::-1][i] for i in nearest(values[::-1], ids[::-1], 3)] == answer


def test_nothing_ranks_to_nothing() -> None:
    assert nearest(np.empty(0), [], 10).shape == (0,)


def test_similarity_halves_with_every_typical_distance() -> None:
    typical = typical_distance(PLAIN)
    found = similarity(np.array([0.0, 1.0, 2.0, 10.0]) * typical, PLAIN)
    assert_allclose(found, [1.0, 0.5, 0.25, 2.0**-10], rtol=1e-12)


def test_similarity_orders_as_distance_does() -> None:
    rows = descriptors(MIXED, 100)
    found = distances(rows[0], rows, MIXED)
    similar = similarity(found, MIXED)
    assert np.all((similar > 0.0) & (similar <= 1.0))
    assert_array_equal(np.argsort(-similar, kind="stable"), np.argsort(found, kind="stable"))
