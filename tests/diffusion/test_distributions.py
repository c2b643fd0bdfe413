"""Distributions of eq. (6): against loops, and the laws of a measure."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.distance import squareform

from workers.diffusion.distributions import (
    Distribution,
    bin_numbers,
    product_measure,
    value_distribution,
    weighted_mean,
    weighted_quantiles,
)
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray

EDGES = np.array([0.0, 0.2, 0.5, 1.0, 1.2])


def distance_distribution(
    distances: FloatArray, weights: FloatArray, edges: FloatArray, *, normalised: bool = True
) -> Distribution:
    """Distribution of a matrix (s, s) of distances, eq. (6)."""
    values, pairs = product_measure(squareform(distances, checks=False), weights)
    return value_distribution(values, pairs, edges, normalised=normalised)


@pytest.fixture
def points() -> tuple[FloatArray, FloatArray]:
    """Distances between 30 random points of a square, some beyond the edges, and weights."""
    rng = np.random.default_rng(1)
    places = rng.uniform(size=(30, 2)) * 1.3
    return np.linalg.norm(places[:, None] - places[None], axis=2), rng.uniform(0.1, 1.0, size=30)


def test_distances_are_counted_by_the_product_measure(
    points: tuple[FloatArray, FloatArray],
) -> None:
    distances, weights = points
    expected = np.zeros(4)
    for i in range(30):
        for j in range(30):
            inside = [k for k in range(4) if EDGES[k] <= distances[i, j] < EDGES[k + 1]]
            expected[inside[0] if inside else 3] += weights[i] * weights[j]
    found = distance_distribution(distances, weights, EDGES, normalised=False)
    assert_allclose(found.masses, expected, rtol=1e-12)
    assert_allclose(found.density * np.diff(EDGES), expected, rtol=1e-12)
    assert_allclose(found.cdf, np.cumsum(expected), rtol=1e-12)


def test_the_whole_measure_is_the_squared_area(points: tuple[FloatArray, FloatArray]) -> None:
    distances, weights = points
    plain = distance_distribution(distances, weights, EDGES, normalised=False)
    normalised = distance_distribution(distances, weights, EDGES)
    assert plain.cdf[-1] == pytest.approx(weights.sum() ** 2)
    assert normalised.cdf[-1] == pytest.approx(1.0)
    assert_allclose(normalised.density * weights.sum() ** 2, plain.density, rtol=1e-12)


def test_the_diagonal_is_part_of_the_measure() -> None:
    distances = np.array([[0.0, 0.7], [0.7, 0.0]])
    found = distance_distribution(distances, np.array([1.0, 3.0]), EDGES)
    assert_allclose(found.masses, [10 / 16, 0.0, 6 / 16, 0.0])


def test_a_point_counted_as_two_halves_changes_nothing(
    points: tuple[FloatArray, FloatArray],
) -> None:
    distances, weights = points
    twice = np.concatenate([[0], np.arange(30)])
    halves = weights[twice].copy()
    halves[:2] /= 2
    before = distance_distribution(distances, weights, EDGES)
    after = distance_distribution(distances[np.ix_(twice, twice)], halves, EDGES)
    assert_allclose(after.masses, before.masses, rtol=1e-12)


def test_points_may_come_in_any_order(points: tuple[FloatArray, FloatArray]) -> None:
    distances, weights = points
    order = np.random.default_rng(2).permutation(30)
    shuffled = distance_distribution(distances[np.ix_(order, order)], weights[order], EDGES)
    before = distance_distribution(distances, weights, EDGES)
    assert_allclose(shuffled.masses, before.masses, rtol=1e-12)


def test_values_inside_the_edges_are_numpys_histogram() -> None:
    rng = np.random.default_rng(3)
    values, weights = rng.uniform(0.0, 1.2, size=500), rng.uniform(size=500)
    expected, _ = np.histogram(values, EDGES, weights=weights)
    found = value_distribution(values, weights, EDGES, normalised=False)
    assert_allclose(found.masses, expected, rtol=1e-12)
    density, _ = np.histogram(values, EDGES, weights=weights, density=True)
    assert_allclose(value_distribution(values, weights, EDGES).density, density, rtol=1e-12)


def test_nothing_is_lost_beyond_the_edges() -> None:
    found = value_distribution(np.array([-5.0, 0.1, 99.0]), np.array([1.0, 2.0, 4.0]), EDGES)
    assert_allclose(found.masses, np.array([3.0, 0.0, 0.0, 4.0]) / 7)


def test_results_are_read_only() -> None:
    found = value_distribution(np.array([0.1]), np.array([1.0]), EDGES)
    for array in (found.edges, found.density, found.cdf):
        assert not array.flags.writeable


@pytest.mark.parametrize("edges", [[0.0], [0.0, 0.0, 1.0], [1.0, 0.0], []])
def test_edges_must_ascend(edges: list[float]) -> None:
    with pytest.raises(InvalidRequestError, match="ascend"):
        value_distribution(np.array([0.1]), np.array([1.0]), np.array(edges))


def test_weights_of_nothing_cannot_be_normalised() -> None:
    with pytest.raises(InvalidRequestError, match="sum to 0"):
        value_distribution(np.array([0.1]), np.array([0.0]), EDGES)


def test_the_mean_of_distances_is_over_all_pairs(points: tuple[FloatArray, FloatArray]) -> None:
    distances, weights = points
    pairs = np.outer(weights, weights)
    expected = np.average(distances, weights=pairs)
    measure = product_measure(squareform(distances, checks=False), weights)
    assert weighted_mean(*measure) == pytest.approx(expected, rel=1e-12)
    assert weighted_mean(distances.ravel(), pairs.ravel()) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    "edges",
    [
        np.linspace(0.0, 3.0, 91),
        np.concatenate([np.linspace(0.0, 3.0, 91), np.geomspace(3.0, 12.0, 11)[1:]]),
        np.array([-1.0, -0.5, 1e-3, 2.0, 2.0 + 1e-9, 7.0]),  # too fine for a table
        np.array([0.1, 0.3]),
    ],
)
def test_bins_are_those_of_a_binary_search(edges: FloatArray) -> None:
    rng = np.random.default_rng(6)
    near = np.nextafter(edges, -np.inf), edges, np.nextafter(edges, np.inf)
    values = np.concatenate([rng.uniform(-2.0, 15.0, 20_000), *near, [-1e300, 1e300, np.inf]])
    expected = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    assert_array_equal(bin_numbers(values, edges), expected)


def test_quantiles_of_equal_weights_are_hazens() -> None:
    values = np.random.default_rng(4).normal(size=101)
    levels = np.linspace(0.005, 0.995, 9)
    expected = np.quantile(values, levels, method="hazen")
    assert_allclose(weighted_quantiles(values, np.full(101, 0.3), levels), expected, rtol=1e-12)


def test_quantiles_of_a_heavier_value_lie_nearer_to_it() -> None:
    levels = np.array([0.5])
    light = weighted_quantiles(np.array([0.0, 1.0]), np.array([1.0, 1.0]), levels)
    heavy = weighted_quantiles(np.array([0.0, 1.0]), np.array([1.0, 3.0]), levels)
    assert_array_equal(light, [0.5])
    assert_allclose(heavy, [0.75])
