"""Verification: points that belong together are found by their distances."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere, translated, union
from tests.retrieval.windows.shapes import PLAIN, asked, stored, stored_bumpy
from workers.geometry.arrays import BoolArray, FloatArray
from workers.retrieval.windows.signature import Signature
from workers.retrieval.windows.verification import QUERY_POINTS, Verified, verify

FIRST = slice(0, QUERY_POINTS)


def costs_of(query: Signature, candidate: Signature) -> FloatArray:
    """Mean squared whitened differences of points, as if all windows were whole; in float64."""
    own, other = (PLAIN.apply(one.numbers[0]).astype(float)[:, :49] for one in (query, candidate))
    squares = np.square(own[FIRST, None] - other[: len(candidate.mutual)]).mean(axis=2)
    costs: FloatArray = squares
    return costs


def verified(
    query: Signature,
    candidate: Signature,
    *,
    own: FloatArray | None = None,
    counts: BoolArray | None = None,
) -> Verified:
    """Matches of the first points; all of them count if nothing else is said."""
    if own is None:
        own = query.mutual[FIRST, FIRST].astype(np.float64)
    if counts is None:
        counts = np.ones(len(own), dtype=np.bool_)
    there = candidate.mutual.astype(np.float64)
    cells = query.areas[FIRST].astype(np.float64)
    return verify(costs_of(query, candidate), counts, cells, own, there)


def test_points_of_a_shape_lie_at_themselves() -> None:
    shape = stored_bumpy(1)
    found = verified(shape, shape)
    assert_array_equal(found.matches, np.arange(QUERY_POINTS))
    assert found.consistency == pytest.approx(1.0, abs=1e-9)
    assert found.scale == pytest.approx(1.0, abs=1e-9)


def test_another_shape_is_less_consistent_and_random_distances_are_least() -> None:
    shape = stored_bumpy(1)
    others = [verified(shape, stored_bumpy(n)).consistency for n in (2, 3, 4)]
    rng = np.random.default_rng(1)
    noise = rng.uniform(0.0, 1.5, (QUERY_POINTS, QUERY_POINTS))
    random = verified(shape, shape, own=np.minimum(noise, noise.T)).consistency
    assert max(others) < 0.6
    assert random < 0.25
    assert min(others) > random


@pytest.mark.parametrize("factor", [0.95, 1.0, 1.05])
def test_the_scale_is_found_beside_the_hypothesis(factor: float) -> None:
    shape = stored_bumpy(1)
    own = shape.mutual[FIRST, FIRST].astype(np.float64) / factor
    found = verified(shape, shape, own=own)
    assert found.scale == pytest.approx(factor, rel=1e-6)
    assert found.consistency == pytest.approx(1.0, abs=1e-6)
    assert_array_equal(found.matches, np.arange(QUERY_POINTS))


def test_the_scale_stays_within_7_percent() -> None:
    shape = stored_bumpy(1)
    own = shape.mutual[FIRST, FIRST].astype(np.float64) / 1.12
    found = verified(shape, shape, own=own)
    assert found.scale == pytest.approx(1.07)
    assert found.consistency < 1.0


def test_pairs_of_islands_agree_nowhere() -> None:
    """What is between two components is no distance: of a perfect match the pairs within count."""
    islands = union(bumpy_sphere(2, 4), translated(bumpy_sphere(2, 5), (20.0, 0.0, 0.0)))
    shape = stored(islands)
    found = verified(shape, shape)
    weights = shape.areas[FIRST].astype(float)
    pairs = np.outer(weights, weights) * (1.0 - np.eye(QUERY_POINTS))
    within = np.isfinite(shape.mutual[FIRST, FIRST])
    assert not within.all()
    expected = pairs[within].sum() / pairs.sum()
    assert found.consistency == pytest.approx(expected, abs=1e-6)
    apart = np.where(np.eye(QUERY_POINTS) == 1.0, 0.0, np.inf)
    nothing = verified(shape, shape, own=apart)
    assert (nothing.consistency, nothing.scale) == (0.0, 1.0)


def test_points_of_which_no_window_counts_have_no_say() -> None:
    shape = stored_bumpy(1)
    own = shape.mutual[FIRST, FIRST].astype(np.float64)
    counts = np.ones(QUERY_POINTS, dtype=np.bool_)
    counts[::3] = False
    spoiled = own.copy()
    spoiled[::3] = spoiled[:, ::3] = 5.0
    np.fill_diagonal(spoiled, 0.0)
    expected = verified(shape, shape, counts=counts)
    found = verified(shape, shape, own=spoiled, counts=counts)
    assert expected.consistency == pytest.approx(1.0, abs=1e-9)
    assert found.consistency == pytest.approx(1.0, abs=0.01)
    assert_array_equal(found.matches[counts], np.arange(QUERY_POINTS)[counts])


def test_fewer_than_two_points_are_not_consistent() -> None:
    shape = stored_bumpy(1)
    own = shape.mutual[FIRST, FIRST].astype(np.float64)
    one = np.zeros(QUERY_POINTS, dtype=np.bool_)
    one[5] = True
    assert verified(shape, shape, own=own, counts=one).consistency == 0.0
    costs, single = np.zeros((1, 3)), np.ones(1)
    alone = verify(costs, single > 0.0, single, np.zeros((1, 1)), np.zeros((3, 3)))
    assert (alone.consistency, alone.scale, alone.matches.tolist()) == (0.0, 1.0, [0])


def test_a_candidate_of_fewer_points_than_choices_is_verified() -> None:
    shape = stored_bumpy(1)
    there = shape.mutual[:3, :3].astype(np.float64)
    costs = costs_of(shape, shape)[:, :3]
    own = shape.mutual[FIRST, FIRST].astype(np.float64)
    found = verify(costs, np.ones(48, np.bool_), np.ones(48), own, there)
    assert set(found.matches.tolist()) <= {0, 1, 2}
    assert 0.0 <= found.consistency < 0.5


def test_another_copy_is_matched_though_its_points_are_others() -> None:
    """128 points of a query: its first 112 are those of the stored shape, within rounding."""
    query, shape = asked(bumpy_sphere(3, 1)), stored_bumpy(1)
    found = verified(query, shape)
    assert found.consistency > 0.95
    lying = shape.mutual[found.matches, np.arange(QUERY_POINTS)]
    assert np.median(lying) == 0.0
    assert_allclose(found.scale, 1.0, atol=0.01)
