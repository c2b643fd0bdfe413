"""The fused distance: its formula, and that it is a metric for powers up to 1."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from workers.retrieval.channels import EigenvalueChannel
from workers.retrieval.fusion import fuse

FIRST = EigenvalueChannel(name="a", view="v", numbers=(1,), scale=2.0, weight=0.5)
SECOND = replace(FIRST, name="b", scale=0.1, weight=3.0)
VALUES = (np.array([0.0, 2.0, 8.0]), np.array([0.0, 0.2, 0.4]))


@pytest.mark.parametrize("power", [0.25, 1.0, 2.0])
def test_channels_are_scaled_raised_weighted_and_summed(power: float) -> None:
    expected = 0.5 * (VALUES[0] / 2.0) ** power + 3.0 * (VALUES[1] / 0.1) ** power
    assert_allclose(fuse(VALUES, (FIRST, SECOND), power=power), expected, rtol=1e-12)


def test_one_plain_channel_is_its_dissimilarity() -> None:
    plain = replace(FIRST, scale=1.0, weight=1.0)
    assert_array_equal(fuse(VALUES[:1], (plain,), power=1.0), VALUES[0])


@pytest.mark.parametrize("power", [0.25, 1.0])
def test_metrics_stay_a_metric(power: float) -> None:
    rng = np.random.default_rng(11)
    places = rng.normal(size=(2, 15))
    gaps = np.abs(places[:, :, None] - places[:, None, :])  # (2, 15, 15)
    rows = [fuse(tuple(gaps[:, i]), (FIRST, SECOND), power=power) for i in range(15)]
    fused = np.stack(rows)  # (15, 15)
    assert np.all(fused <= (fused[:, :, None] + fused[None]).min(axis=1) + 1e-12)
