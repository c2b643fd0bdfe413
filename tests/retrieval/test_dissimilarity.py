"""Dissimilarities: second implementations, axioms, and rows that do not see each other."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.distance import cdist, jensenshannon
from scipy.stats import entropy, ks_2samp, wasserstein_distance

from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array, FloatArray
from workers.retrieval.dissimilarity import (
    DISSIMILARITIES,
    EPSILON,
    VECTOR_DISSIMILARITIES,
    find_dissimilarity,
)

NAMES = sorted(DISSIMILARITIES)
METRICS = ["l1", "l2", "linf", "hellinger", "jensen-shannon", "earth-movers", "kolmogorov-smirnov"]
ASYMMETRIC = {"kullback-leibler"}
EDGES = np.concatenate([np.linspace(0.0, 2.0, 30), np.geomspace(2.1, 9.0, 8)])
WIDTHS = np.diff(EDGES)  # (37,)
CENTRES = 0.5 * (EDGES[1:] + EDGES[:-1])


def distributions(n: int, *, seed: int = 0) -> Float32Array:
    """Rows (n, 37) of probabilities, about a third of them empty bins."""
    rng = np.random.default_rng(seed)
    rows = rng.gamma(0.7, size=(n, len(WIDTHS))) * (rng.random((n, len(WIDTHS))) > 0.3)
    result: Float32Array = (rows / rows.sum(axis=1, keepdims=True)).astype(np.float32)
    return result


def compare(name: str, query: Float32Array, rows: Float32Array) -> FloatArray:
    return DISSIMILARITIES[name](query.astype(np.float64), rows, WIDTHS)


@pytest.mark.parametrize("name", NAMES)
def test_equal_rows_are_zero_apart_and_others_are_not(name: str) -> None:
    rows = distributions(40)
    for i, row in enumerate(rows):
        found = compare(name, row, rows)
        assert found[i] == 0.0
        assert np.all(np.isfinite(found))
        assert np.all(np.delete(found, i) > 0.0)


@pytest.mark.parametrize("name", NAMES)
def test_a_row_is_bit_for_bit_the_same_among_any_others(name: str) -> None:
    rng = np.random.default_rng(5)
    rows = distributions(5003)  # more than one chunk, and no multiple of anything
    query = rows[17]
    expected = compare(name, query, rows)
    order = rng.permutation(len(rows))
    assert_array_equal(compare(name, query, rows[order]), expected[order])
    assert_array_equal(compare(name, query, np.asfortranarray(rows)), expected)
    assert_array_equal(compare(name, query, rows[::-3]), expected[::-3])
    wide = np.concatenate([distributions(5003, seed=1)[:, :5], rows], axis=1)
    assert_array_equal(compare(name, query, wide[:, 5:]), expected)
    for start in range(1, 40):
        assert_array_equal(compare(name, query, rows[start : start + 1]), expected[start])
        assert_array_equal(compare(name, query, rows[start : start + 3]), expected[start:][:3])


@pytest.mark.parametrize("name", sorted(set(NAMES) - ASYMMETRIC))
def test_query_and_row_may_change_places(name: str) -> None:
    rows = distributions(20)
    matrix = np.stack([compare(name, row, rows) for row in rows])
    assert_allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", METRICS)
def test_detours_are_not_shorter(name: str) -> None:
    rows = distributions(25)
    matrix = np.stack([compare(name, row, rows) for row in rows])  # (25, 25)
    detours = matrix[:, :, None] + matrix[None, :, :]  # (25, 25, 25): i to j to l
    assert np.all(matrix <= detours.min(axis=1) + 1e-9)


def test_earth_movers_is_scipys_wasserstein_distance_of_the_centres() -> None:
    rows = distributions(30).astype(np.float64)
    expected = [wasserstein_distance(CENTRES, CENTRES, rows[0], row) for row in rows]
    found = DISSIMILARITIES["earth-movers"](rows[0], rows, WIDTHS)
    assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_jensen_shannon_is_scipys_distance() -> None:
    rows = distributions(30).astype(np.float64)
    found = DISSIMILARITIES["jensen-shannon"](rows[0], rows, WIDTHS)
    assert_allclose(found, [jensenshannon(rows[0], row) for row in rows], rtol=1e-7, atol=1e-9)


def test_kullback_leibler_is_scipys_entropy_of_smoothed_rows() -> None:
    rows = distributions(30).astype(np.float64)
    rows /= rows.sum(axis=1, keepdims=True)
    found = DISSIMILARITIES["kullback-leibler"](rows[0], rows, WIDTHS)
    expected = [entropy(rows[0] + EPSILON, row + EPSILON) for row in rows]
    assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_differences_of_vectors_are_scipys() -> None:
    rows = np.random.default_rng(6).normal(size=(30, 20))
    expected = {
        "l1": cdist(rows[:1], rows, "cityblock"),
        "l2": cdist(rows[:1], rows, "euclidean"),
        "linf": cdist(rows[:1], rows, "chebyshev"),
    }
    for name, values in expected.items():
        found = DISSIMILARITIES[name](rows[0], rows, np.ones(20))
        assert_allclose(found, values[0], rtol=1e-12)


def test_kolmogorov_smirnov_is_scipys_statistic() -> None:
    rng = np.random.default_rng(7)
    counts = rng.multinomial(40, np.full(len(WIDTHS), 1 / len(WIDTHS)), size=2)
    first, second = np.repeat(CENTRES, counts[0]), np.repeat(CENTRES, counts[1])
    found = DISSIMILARITIES["kolmogorov-smirnov"](counts[0].astype(float), counts[1:], WIDTHS)
    assert_allclose(found, [ks_2samp(first, second).statistic], rtol=1e-9)


def test_densities_not_masses_are_squared() -> None:
    # halving every bin of piecewise constant densities must not change them
    rows = distributions(10).astype(np.float64)
    halves = np.repeat(rows / 2, 2, axis=1)
    for name in ("l1", "l2", "linf", "normalised-l1", "normalised-l2"):
        coarse = DISSIMILARITIES[name](rows[0], rows, WIDTHS)
        fine = DISSIMILARITIES[name](halves[0], halves, np.repeat(WIDTHS / 2, 2))
        assert_allclose(fine, coarse, rtol=1e-12)


def test_closed_forms_of_two_bins() -> None:
    p, q = np.array([0.5, 0.5]), np.array([[0.9, 0.1]])
    widths = np.array([1.0, 2.0])
    expected = {
        "l1": 0.8,
        "l2": np.sqrt(0.16 + 0.16 / 2),
        "linf": 0.4,
        "normalised-l1": 0.4,
        "chi-squared": 0.5 * (0.16 / 1.4 + 0.16 / 0.6),
        "hellinger": np.sqrt(1 - np.sqrt(0.45) - np.sqrt(0.05)),
        "earth-movers": 0.4 * 1.5,
        "kolmogorov-smirnov": 0.4,
    }
    for name, value in expected.items():
        assert_allclose(DISSIMILARITIES[name](p, q, widths), [value], rtol=1e-12)
    found = DISSIMILARITIES["bhattacharyya"](p, q, widths)
    # EPSILON in both bins moves it by about as much
    assert_allclose(found, [-np.log(np.sqrt(0.45) + np.sqrt(0.05))], atol=10 * EPSILON)


@pytest.mark.parametrize("name", NAMES)
def test_distributions_without_a_common_bin_stay_finite(name: str) -> None:
    rows = np.eye(len(WIDTHS), dtype=np.float32)
    found = compare(name, rows[0], rows)
    assert np.all(np.isfinite(found))
    assert np.all(found[1:] > 0.05)


BOUNDS = {
    "l1": 2.0,
    "normalised-l1": 1.0,
    "jensen-shannon": np.sqrt(np.log(2.0)),
    "hellinger": 1.0,
    "chi-squared": 1.0,
    "kolmogorov-smirnov": 1.0,
}


@pytest.mark.parametrize("name", sorted(BOUNDS))
def test_bounds_are_reached_by_distributions_without_a_common_bin(name: str) -> None:
    query, row = np.zeros((2, len(WIDTHS)))
    query[0] = row[-1] = 1.0
    assert_allclose(DISSIMILARITIES[name](query, row[None], WIDTHS), [BOUNDS[name]], rtol=1e-12)
    assert np.all(compare(name, *_halves(distributions(60))) <= BOUNDS[name] + 1e-12)


def _halves(rows: Float32Array) -> tuple[Float32Array, Float32Array]:
    return rows[0], rows[1:]


@pytest.mark.parametrize("name", ["normalised-l1", "normalised-l2"])
def test_normalised_forms_forget_a_common_factor(name: str) -> None:
    rows = distributions(10).astype(np.float64)
    before = DISSIMILARITIES[name](rows[0], rows, WIDTHS)
    assert_allclose(DISSIMILARITIES[name](7 * rows[0], 7 * rows, WIDTHS), before, rtol=1e-12)


@pytest.mark.parametrize(
    "name", ["kullback-leibler", "jensen-shannon", "hellinger", "bhattacharyya", "earth-movers"]
)
def test_probabilities_are_compared_whatever_the_measure(name: str) -> None:
    rows = distributions(10).astype(np.float64)
    before = DISSIMILARITIES[name](rows[0], rows, WIDTHS)
    after = DISSIMILARITIES[name](rows[0], 3 * rows, WIDTHS)
    assert_allclose(after, before, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_no_rows_and_empty_rows_are_no_error(name: str) -> None:
    assert compare(name, distributions(1)[0], distributions(0)).shape == (0,)
    assert np.all(np.isfinite(compare(name, distributions(1)[0], np.zeros_like(distributions(2)))))


@pytest.mark.parametrize("name", NAMES)
def test_arguments_are_left_alone(name: str) -> None:
    rows, query = distributions(5), distributions(1)[0].astype(np.float64)
    for array in (rows, query):
        array.flags.writeable = False
    DISSIMILARITIES[name](query, rows, WIDTHS)


def test_memory_does_not_grow_with_the_rows() -> None:
    rows = np.random.default_rng(8).random((100_000, 100), dtype=np.float32)
    tracemalloc.start()
    DISSIMILARITIES["kullback-leibler"](rows[0].astype(np.float64), rows, np.ones(100))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6  # a float64 copy of the matrix alone would be 80e6


def test_unknown_names_are_answered_with_the_known_ones() -> None:
    with pytest.raises(InvalidRequestError, match=r"no dissimilarity 'cosine'.*earth-movers"):
        find_dissimilarity("cosine")


@pytest.mark.parametrize("name", NAMES)
def test_vectors_are_compared_by_differences_only(name: str) -> None:
    if name in VECTOR_DISSIMILARITIES:
        assert find_dissimilarity(name, distribution=False) is DISSIMILARITIES[name]
    else:
        with pytest.raises(InvalidRequestError, match="possible are l1, l2, linf"):
            find_dissimilarity(name, distribution=False)
