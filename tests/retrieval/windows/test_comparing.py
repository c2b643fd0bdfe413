"""X: as a plain loop has it, 0 for the same, and the same bits among any others."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import rectangle
from tests.retrieval.windows.shapes import PLAIN, asked, asked_bumpy, stored_bumpy
from workers.geometry.arrays import FloatArray
from workers.retrieval.windows.comparing import (
    ALL_AROUND,
    AT_A_GLANCE,
    FACING,
    NOTHING_COUNTS,
    POWER,
    Side,
)
from workers.retrieval.windows.moments import STEADY
from workers.retrieval.windows.signature import CUT, KINDS, LOST, WHOLE, Signature
from workers.retrieval.windows.whitening import Whitening

ALL = tuple(range(KINDS))


def skewed(rng: np.random.Generator) -> Whitening:
    """A whitening that mixes numbers."""
    return Whitening(
        20.0 * np.eye(7) + rng.normal(size=(7, 7, 7)), 20.0 * np.eye(4) + rng.normal(size=(7, 4, 4))
    )


def part_like() -> Signature:
    """A query of whole, cut and lost windows."""
    return asked(rectangle(24, 24))


def costs_by_loops(
    query: Signature, candidate: Signature, whitening: Whitening, group: Sequence[int], scale: int
) -> tuple[FloatArray, FloatArray]:
    """Mean squared differences (s, p) of each two points, and dimensions (s,); in float64."""
    found = np.zeros((query.n_points, candidate.n_points))
    dimensions = np.zeros(query.n_points)
    for s in range(query.n_points):
        for w in group:
            reach = query.reaches[scale, s, w]
            gaps = query.numbers[scale, s, w].astype(float) - candidate.numbers[0, :, w]
            if reach == WHOLE:
                white, dimension = gaps @ whitening.whole[w], 7
            elif reach == CUT:
                white, dimension = gaps[:, STEADY] @ whitening.cut[w], 4
            else:
                continue
            found[s] += np.square(white).sum(axis=1)
            dimensions[s] += dimension
        found[s] /= max(dimensions[s], 1)
    return found, dimensions


@pytest.mark.parametrize("group", [ALL, ALL_AROUND, FACING, AT_A_GLANCE])
def test_differences_are_those_of_a_plain_loop(group: Sequence[int]) -> None:
    whitening = skewed(np.random.default_rng(1))
    query, candidate = part_like(), stored_bumpy(1)
    assert {WHOLE, CUT, LOST} == set(np.unique(query.reaches[:, :, list(group)]).tolist())
    side = Side.of(query, whitening, group)
    right = side.right(candidate.numbers[0][:, side.windows])
    scales = [0, 5]
    costs = side.costs(scales, right)
    found = side.differences(scales, costs)
    for place, scale in enumerate(scales):
        expected, dimensions = costs_by_loops(query, candidate, whitening, group, scale)
        assert_array_equal(side.dimensions[scale], dimensions)
        # squares of 32 bits are subtracted: the error is that of the squared numbers
        rounding = 1e-6 * float(right[:, right.shape[1] // 2 :].sum(axis=1).max())
        assert_allclose(costs[place], expected, rtol=1e-4, atol=rounding)
        weights = query.areas * np.sqrt(dimensions)
        mean = (weights * expected.min(axis=1) ** POWER).sum() / weights.sum()
        assert found[place] == pytest.approx(mean, rel=1e-3)


def test_a_shape_differs_from_itself_by_nothing_and_from_others_by_more() -> None:
    """Half a code of ln mass is 0.014, or 0.27 whitened: the fourth root makes much of it."""
    query = asked_bumpy(1)
    side = Side.of(query, PLAIN, ALL)
    own, *others = (
        float(side.differences([0], side.costs([0], side.right(stored_bumpy(n).numbers[0])))[0])
        for n in range(1, 6)
    )
    assert own < 0.3
    assert min(others) > 1.2 * own
    exact = replace(query, numbers=stored_bumpy(1).numbers[:, :128], reaches=query.reaches[:1])
    side = Side.of(exact, PLAIN, ALL)
    found = side.differences([0], side.costs([0], side.right(stored_bumpy(1).numbers[0])))
    assert found[0] < 0.12  # float32: squares of 200 leave 4e-5, of which the fourth root is 0.08


def test_a_point_of_the_query_counts_by_its_area_and_what_is_known_of_it() -> None:
    query = part_like()
    side = Side.of(query, PLAIN, ALL)
    expected = query.areas * np.sqrt(side.dimensions[0])
    assert_allclose(side.weights[0], expected, rtol=1e-6)
    first = Side.of(query, PLAIN, ALL, points=64)
    assert_array_equal(first.weights, side.weights[:, :64])
    assert_array_equal(first.left, side.left[:, :64])


def test_where_nothing_counts_the_difference_is_that_of_noise() -> None:
    query = part_like()
    blind = replace(query, reaches=np.full_like(query.reaches, LOST))
    side = Side.of(blind, PLAIN, ALL)
    costs = side.costs([0, 1], side.right(stored_bumpy(1).numbers[0]))
    assert side.differences([0, 1], costs).tolist() == [NOTHING_COUNTS] * 2


def test_points_that_are_repeated_change_nothing() -> None:
    side = Side.of(asked_bumpy(1), PLAIN, ALL)
    right = side.right(stored_bumpy(2).numbers[0])
    again = np.concatenate([right, right[:100]])
    one, other = (side.differences([0, 3], side.costs([0, 3], points)) for points in (right, again))
    assert_allclose(one, other, rtol=1e-5)


def test_a_candidate_has_the_same_bits_alone_and_among_others() -> None:
    side = Side.of(part_like(), PLAIN, AT_A_GLANCE, points=32)
    numbers = np.stack([stored_bumpy(n).numbers[0][:64, side.windows] for n in range(7)])
    together = side.costs([0, 3], side.right(numbers))
    differences = side.differences([0, 3], together)
    assert together.shape == (7, 2, 32, 64)
    for place, one in enumerate(numbers):
        alone = side.costs([0, 3], side.right(one))
        assert alone.tobytes() == together[place].tobytes()
        assert_array_equal(side.differences([0, 3], alone), differences[place])
