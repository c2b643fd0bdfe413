"""Laws of P and N, on whatever moments there may be."""

from functools import reduce
from operator import add

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from workers.training.pair_statistics import ShapeMoments, pair_statistics

SIZE = 3
SEEDS = st.integers(0, 2**32 - 1)


def some_moments(rng: np.random.Generator) -> ShapeMoments:
    """Of one pair of shapes, made from values at ten pairs of points."""
    first, second = rng.normal(size=(2, 10, SIZE))
    return ShapeMoments(
        count=1,
        positive=(first - second).T @ (first - second) / 10,
        second=first.T @ first / 10,
        transformed_second=second.T @ second / 10,
        mean=first.mean(axis=0),
        transformed_mean=second.mean(axis=0),
    )


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, sizes=st.lists(st.integers(1, 4), min_size=1, max_size=4))
def test_statistics_of_a_union_are_the_sum(seed: int, sizes: list[int]) -> None:
    """However the pairs of a class are divided: negatives are those to the other class alone."""
    rng = np.random.default_rng(seed)
    other = some_moments(rng)
    divided = []
    for size in sizes:
        divided.append(reduce(add, [some_moments(rng) for _ in range(size)]))
    union = reduce(add, divided)
    whole = pair_statistics({"class": union, "other": other}, ["class"])
    parts = [pair_statistics({"class": one, "other": other}, ["class"]) for one in divided]
    total = reduce(add, parts)
    assert_allclose(whole.positive, total.positive, rtol=1e-9)
    assert_allclose(whole.negative, total.negative, rtol=1e-9)
    assert (whole.n_positive, whole.n_negative) == (total.n_positive, total.n_negative)
    assert (whole.n_positive, whole.n_negative) == (sum(sizes), 2 * sum(sizes))
