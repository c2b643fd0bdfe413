"""A distance taken apart is the distance of the scan, and its parts sum to it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.retrieval.test_points import LOCAL
from tests.retrieval.test_scan import COMMUTE, DNA, HEAT, MIXED, PLAIN, descriptors
from workers.errors import InvalidRequestError
from workers.retrieval.comparison import compare
from workers.retrieval.model import Model
from workers.retrieval.scan import distances, rerank, similarity

POINTED = replace(MIXED, name="pointed", channels=(HEAT, LOCAL, DNA, COMMUTE))


@pytest.mark.parametrize("model", [PLAIN, MIXED, POINTED])
@pytest.mark.parametrize("dissimilarity", [None, "l2"])
def test_the_distance_is_that_of_the_scan(model: Model, dissimilarity: str | None) -> None:
    rows = descriptors(model, 20)
    scanned = distances(rows[3], rows, model, dissimilarity=dissimilarity)
    ranked = rerank(rows[3], rows.__getitem__, scanned, model, dissimilarity=dissimilarity)
    similar = similarity(ranked, model, dissimilarity=dissimilarity)
    for row, distance, alike in zip(rows, ranked, similar, strict=True):
        found = compare(rows[3], row, model, dissimilarity=dissimilarity)
        assert (found.distance, found.similarity) == (distance, alike)
        shares = [part.share for part in found.channels]
        assert_allclose(sum(shares), distance, rtol=1e-12)
        assert shares == sorted(shares, reverse=True)


def test_a_share_is_the_weighted_power_of_the_channels_distance() -> None:
    query, match = descriptors(POINTED, 2)
    found = compare(query, match, POINTED)
    assert {part.channel for part in found.channels} == set(POINTED.channels)
    for part in found.channels:
        channel = part.channel
        assert part.dissimilarity == channel.dissimilarity
        assert part.share == pytest.approx(
            channel.weight * (part.distance / channel.scale) ** 0.25, rel=1e-12
        )
        assert_array_equal(part.query, query[POINTED.slices[channel.name]])
        assert_array_equal(part.match, match[POINTED.slices[channel.name]])


def test_points_are_compared_one_way_and_count_at_most_so_much() -> None:
    query, match = descriptors(POINTED, 2, seed=4)
    there, back = (
        {part.channel.name: part.distance for part in compare(*pair, POINTED).channels}
        for pair in ((query, match), (match, query))
    )
    assert there["points"] != back["points"]
    assert there["heat"] == back["heat"]
    moved = match.copy()
    moved[POINTED.slices["points"]] += 1e4
    (points,) = [p for p in compare(query, moved, POINTED).channels if p.channel is LOCAL]
    assert points.distance == 16.0 * LOCAL.scale


def test_under_another_dissimilarity_points_are_left_out() -> None:
    query, match = descriptors(POINTED, 2)
    found = compare(query, match, POINTED, dissimilarity="linf")
    assert {part.channel.name for part in found.channels} == {"heat", "dna", "commute"}
    assert {part.dissimilarity for part in found.channels} == {"linf"}
    with pytest.raises(InvalidRequestError, match="possible are l1, l2, linf"):
        compare(query, match, POINTED, dissimilarity="chi-squared")


def test_a_shape_differs_from_itself_in_nothing() -> None:
    (row,) = descriptors(POINTED, 1)
    found = compare(row, row, POINTED)
    assert (found.distance, found.similarity) == (0.0, 1.0)
    assert not np.any([part.distance for part in found.channels])
