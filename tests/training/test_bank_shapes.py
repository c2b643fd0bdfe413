"""A bank is learned from what a search compares: the same dissimilarities and largest terms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.retrieval.banks import of_copies
from workers.diffusion.kernels import CommuteTimeKernel
from workers.geometry.views import default_view
from workers.retrieval.channels import DistanceChannel, Histogram, PointsChannel
from workers.retrieval.model import Model
from workers.retrieval.scan import distances, rerank
from workers.training.bank_shapes import BankShapes, dissimilarities, ranking_terms
from workers.training.candidates import candidate_model

EVERY = candidate_model([default_view()], power=0.25)
SIGNATURE = EVERY.channels[0]
(POINTS,) = [one for one in EVERY.channels if isinstance(one, PointsChannel)]
HISTOGRAM = DistanceChannel(
    name="distances",
    view=default_view().name,
    kernel=CommuteTimeKernel(),
    summary=Histogram(tuple(np.linspace(0.0, 2.0, 21).tolist())),
    dissimilarity="chi-squared",
)
CANDIDATES = replace(
    EVERY,
    channels=(
        SIGNATURE,
        replace(SIGNATURE, name="by l2", dissimilarity="l2"),
        HISTOGRAM,
        replace(HISTOGRAM, name="by earth mover's", dissimilarity="earth-movers"),
        POINTS,
    ),
)


def some_shapes(model: Model, *, spread: float = 1.0) -> BankShapes:
    """Three copies each of six shapes; numbers of histograms are not negative."""
    rng = np.random.default_rng(5)
    references = np.abs(rng.normal(size=(6, model.dimension)))
    changes = 0.1 * rng.normal(size=(18, model.dimension))
    queries = np.abs(np.repeat(references, 3, axis=0) + changes)
    queries[1::3] *= spread
    return of_copies(references, queries, ("noise", "holes", "noise") * 6, members=2)


def test_a_bank_is_learned_from_the_dissimilarities_of_a_search() -> None:
    shapes = some_shapes(CANDIDATES)
    found = dissimilarities(shapes, CANDIDATES)
    for channel, of_channel in zip(CANDIDATES.channels, found, strict=True):
        own = CANDIDATES.slices[channel.name]
        for query, of_query in zip(shapes.queries, of_channel, strict=True):
            searched = channel.compare(query[own], shapes.references[:, own])
            assert_allclose(of_query, searched, rtol=1e-5, atol=1e-6)  # float32


@pytest.mark.parametrize("spread", [1.0, 1e3])
def test_a_bank_is_learned_from_the_distances_of_a_search(spread: float) -> None:
    """Points that are far from everything have the largest term there, and no larger one here."""
    weights, scales = np.array([1.0, 0.3, 0.2, 0.4, 0.6]), np.array([1.0, 2.0, 0.5, 3.0, 0.1])
    shapes = some_shapes(CANDIDATES, spread=spread)
    found = dissimilarities(shapes, CANDIDATES)
    assert np.any(found[-1] > 16.0 * scales[-1]) == (spread > 1.0)
    terms = ranking_terms(shapes, CANDIDATES, found, scales, power=CANDIDATES.fusion_power)
    model = replace(
        CANDIDATES,
        channels=tuple(
            replace(channel, scale=scale, weight=weight)
            for channel, scale, weight in zip(
                CANDIDATES.channels, scales.tolist(), weights.tolist(), strict=True
            )
        ),
    )
    for query, learned_from in zip(shapes.queries, terms.search_distances(weights), strict=True):
        scanned = distances(query, shapes.references, model)
        searched = rerank(query, lambda places: shapes.references[places], scanned, model)
        assert_allclose(learned_from, searched, rtol=1e-5)  # float32
