"""Whitening: differences get the covariance 1, and what counts where a window is cut."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.retrieval.windows.shapes import PLAIN
from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import FloatArray
from workers.retrieval.windows.moments import NUMBERS, STEADY
from workers.retrieval.windows.signature import CUT, KINDS, LOST, WHOLE
from workers.retrieval.windows.whitening import COLUMNS, Whitening, learn_whitening, masks

Reaches = np.ndarray[tuple[int, ...], np.dtype[np.uint8]]


def correlated(rng: np.random.Generator, pairs: int) -> FloatArray:
    """Differences of windows, another mixture each; numbers have units of their own."""
    mixtures = np.eye(NUMBERS) + 0.2 * rng.normal(size=(KINDS, NUMBERS, NUMBERS))
    mixtures *= 10.0 ** rng.uniform(-3, 0, NUMBERS)
    drawn: FloatArray = np.einsum(
        "pwi,wij->pwj", rng.uniform(-1.0, 1.0, (pairs, KINDS, NUMBERS)), mixtures
    )
    return drawn


def all_of(reach: int, pairs: int) -> Reaches:
    return np.full((pairs, KINDS), reach, dtype=np.uint8)


def test_whitened_differences_have_the_covariance_1() -> None:
    """But for the 1 % of each number that are clipped, and they are hardly longer than others."""
    rng = np.random.default_rng(1)
    differences = correlated(rng, 4000)
    whole = all_of(WHOLE, 4000)
    whitening = learn_whitening(differences, whole, whole)
    for window in range(KINDS):
        of_whole = differences[:, window] @ whitening.whole[window]
        of_cut = differences[:, window][:, STEADY] @ whitening.cut[window]
        for white in (of_whole, of_cut):
            assert_allclose(np.cov(white.T), np.eye(white.shape[1]), atol=0.08)
    applied = whitening.apply(differences.astype(np.float32))
    assert applied.shape == (4000, COLUMNS)
    first = differences[:, 0] @ whitening.whole[0]
    assert_allclose(applied[:, :NUMBERS], first, atol=1e-3)
    last = differences[:, -1][:, STEADY] @ whitening.cut[-1]
    assert_allclose(applied[:, -len(STEADY) :], last, atol=1e-3)


def test_points_that_do_not_correspond_hardly_count() -> None:
    rng = np.random.default_rng(2)
    clean = correlated(rng, 3000)
    wrong = clean.copy()
    wrong[:15] *= 100.0
    whole = all_of(WHOLE, 3000)
    expected, found = (learn_whitening(one, whole, whole) for one in (clean, wrong))
    for one, other in zip(found.whole, expected.whole, strict=True):
        kept = np.linalg.solve(other, one)  # of unit differences
        assert_allclose(kept, np.eye(NUMBERS), atol=0.3)  # 0.5 % are still at the limit


def test_windows_are_learned_from_where_they_count() -> None:
    """Whole ones from whole pairs; cut ones from whole ones against whole or cut ones."""
    rng = np.random.default_rng(3)
    differences = correlated(rng, 1500)
    whole = all_of(WHOLE, 1500)
    one, other = whole.copy(), whole.copy()
    other[500:1000], other[1000:1250] = CUT, LOST
    one[1250:] = CUT
    expected_whole = learn_whitening(differences[:500], whole[:500], whole[:500]).whole
    expected_cut = learn_whitening(differences[:1000], whole[:1000], whole[:1000]).cut
    found = learn_whitening(differences, one, other)
    assert_array_equal(found.whole, expected_whole)
    assert_array_equal(found.cut, expected_cut)


def test_too_few_pairs_or_such_as_do_not_differ_are_refused() -> None:
    differences = correlated(np.random.default_rng(4), 300)
    whole = all_of(WHOLE, 300)
    mostly_lost = all_of(LOST, 300)
    mostly_lost[:199] = WHOLE
    with pytest.raises(InsufficientTrainingDataError, match="199 pairs"):
        learn_whitening(differences, whole, mostly_lost)
    with pytest.raises(InsufficientTrainingDataError, match="do not differ"):
        learn_whitening(np.zeros_like(differences), whole, whole)


def test_what_counts_of_whole_cut_and_lost_windows() -> None:
    reaches = all_of(WHOLE, 2)
    reaches[1, :3] = [WHOLE, CUT, LOST]
    counted, dimensions = masks(reaches)
    assert counted.shape == (2, COLUMNS)
    assert dimensions.tolist() == [[7.0] * 7, [7.0, 4.0, 0.0, *[7.0] * 4]]
    of_whole = counted[:, : KINDS * NUMBERS].reshape(2, KINDS, NUMBERS)
    of_cut = counted[:, KINDS * NUMBERS :].reshape(2, KINDS, len(STEADY))
    assert_array_equal(of_whole.sum(axis=2) + of_cut.sum(axis=2), dimensions)
    assert of_whole[1].any(axis=1).tolist() == [True, False, False, *[True] * 4]
    assert of_cut[1].any(axis=1).tolist() == [False, True, False, *[False] * 4]


def test_it_goes_through_json() -> None:
    rng = np.random.default_rng(5)
    whole = all_of(WHOLE, 400)
    learned = learn_whitening(correlated(rng, 400), whole, whole)
    found = Whitening.from_json(json.loads(json.dumps(learned.to_json())))
    assert_allclose(found.whole, learned.whole, rtol=1e-5)
    assert_allclose(found.cut, learned.cut, rtol=1e-5)
    again = Whitening.from_json(found.to_json())
    assert_array_equal(again.whole, found.whole)


@pytest.mark.parametrize(
    "value",
    [
        {},
        {"whole": PLAIN.to_json()["whole"]},
        {"whole": PLAIN.to_json()["cut"], "cut": PLAIN.to_json()["whole"]},
        {"whole": "wide", "cut": "short"},
        {**PLAIN.to_json(), "cut": [[[float("nan")] * 4] * 4] * 7},
        {**PLAIN.to_json(), "cut": [[["one"] * 4] * 4] * 7},
    ],
)
def test_anything_else_is_refused(value: dict[str, Any]) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        Whitening.from_json(value)
