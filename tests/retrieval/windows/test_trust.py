"""Trust: 0 for perfect evidence, more for worse, and never an edge for what was not compared."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.retrieval.windows.shapes import EVEN, asked_bumpy
from workers.retrieval.windows.trust import (
    NOT_VERIFIED,
    Trust,
    Weights,
    query_features,
    saturated,
)

WEIGHTS = Weights(2.0, 3.0, 0.5, 0.3, 1.4, 1.3)
numbers = st.floats(0.0, 100.0)
logs = st.floats(NOT_VERIFIED, 0.0)


def fused(distance: float, difference: float, log_consistency: float) -> float:
    return float(
        WEIGHTS.fused(np.array([distance]), np.array([difference]), np.array([log_consistency]))[0]
    )


def test_perfect_evidence_is_no_distance() -> None:
    assert fused(0.0, 0.0, 0.0) == 0.0


def test_small_evidence_counts_as_it_is() -> None:
    """(2 d + 3 X - 0.5 ln p) / 5."""
    assert fused(0.1, 0.2, -1.0) == pytest.approx((0.2 + 0.6 + 0.5) / 5.0, rel=1e-6)


@given(numbers, numbers, logs, numbers, st.sampled_from(["distance", "difference", "consistency"]))
def test_worse_evidence_is_never_nearer(
    distance: float, difference: float, log_consistency: float, more: float, of: str
) -> None:
    worse = {
        "distance": (distance + more, difference, log_consistency),
        "difference": (distance, difference + more, log_consistency),
        "consistency": (distance, difference, max(NOT_VERIFIED, log_consistency - more)),
    }[of]
    assert fused(*worse) >= fused(distance, difference, log_consistency) - 1e-12  # rounding


@given(numbers, numbers, logs)
def test_a_shape_that_was_not_compared_does_not_come_before_its_equal_that_was(
    distance: float, difference: float, log_consistency: float
) -> None:
    not_compared = fused(distance, np.inf, NOT_VERIFIED)
    assert np.isfinite(not_compared)
    assert fused(distance, difference, log_consistency) <= not_compared + 1e-12


def test_evidence_saturates() -> None:
    values = np.array([0.0, 1e-3, 0.5, 1.3, 2.0, 10.0, 1e9, np.inf])
    found = saturated(values, 1.3)
    assert (np.diff(found) >= 0.0).all()
    assert found[0] == 0.0
    assert_allclose(found[1:3], values[1:3], rtol=1e-4)
    assert found[3] == pytest.approx(1.3 / 2.0 ** (1.0 / 8.0))
    assert_allclose(found[-3:], 1.3, rtol=1e-6)
    assert found.max() <= 1.3


def test_a_query_shows_its_boundary_its_roughness_and_how_coarse_it_is() -> None:
    query = replace(asked_bumpy(1), boundary=3.5, roughness=20.0, n_vertices=1000)
    assert query_features(query).tolist() == [1.0, 0.5, 0.5, 0.0]
    coarse = replace(query, boundary=99.0, roughness=170.0, n_vertices=368)
    assert_allclose(query_features(coarse), [1.0, 1.5, 1.5, 1.0], atol=1e-3)
    assert query_features(replace(query, n_vertices=10**6))[3] == 0.0
    assert query_features(replace(query, n_vertices=4))[3] == 3.0


def test_weights_follow_what_the_query_shows() -> None:
    trust = Trust((2.0, -4.0, 0, 0), (1.0, 2.0, -4.0, 0), (0.0, 0, 0, 1.0), (0.0, 2.0), 1.4, 1.3)
    smooth = replace(asked_bumpy(1), boundary=0.0, roughness=0.0, n_vertices=5000)
    weights = trust.weights(smooth)
    expected = [np.log1p(np.exp(w)) for w in (2.0, 1.0, 0.0)]
    assert_allclose([weights.distance, weights.windows, weights.consistency], expected)
    assert (weights.facing, weights.most_distance, weights.most_windows) == (0.5, 1.4, 1.3)
    part = trust.weights(replace(smooth, boundary=7.0))
    assert part.distance < weights.distance
    assert part.windows > weights.windows
    assert part.facing == pytest.approx(1.0 / (1.0 + np.exp(-2.0)))
    rough = trust.weights(replace(smooth, roughness=40.0))
    assert 0.0 < rough.windows < weights.windows


def test_it_goes_through_json_in_five_digits() -> None:
    trust = Trust((1.0, 2.345678, 0, 0), (3.0,) * 4, (0.5,) * 4, (-1.0, 1e-7 / 3.0), 1.4, 1.3)
    found = Trust.from_json(json.loads(json.dumps(trust.to_json())))
    assert found.distance == (1.0, 2.3457, 0.0, 0.0)
    assert found.facing == (-1.0, 3.3333e-8)
    assert Trust.from_json(found.to_json()) == found


@pytest.mark.parametrize(
    "change",
    [
        {"distance": [1.0, 2.0]},
        {"facing": [1.0, 2.0, 3.0]},
        {"windows": "none"},
        {"windows": [float("nan"), 0.0, 0.0, 0.0]},
        {"consistency": None},
        {"most_distance": 0.0},
        {"most_windows": float("inf")},
        {"most_windows": "most"},
    ],
)
def test_anything_else_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        Trust.from_json({**EVEN.to_json(), **change})
    name = next(iter(change))
    without = {key: value for key, value in EVEN.to_json().items() if key != name}
    with pytest.raises((ValueError, KeyError, TypeError)):
        Trust.from_json(without)


def test_no_shapes_have_no_distances() -> None:
    none = np.empty(0)
    assert_array_equal(WEIGHTS.fused(none, none, none), none)
