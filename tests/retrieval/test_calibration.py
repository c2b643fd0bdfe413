"""Typical distances: complete for the built-in models, and a rule for all others."""

from dataclasses import replace

import pytest

from workers.errors import InvalidRequestError
from workers.retrieval.builtin import built_in_models
from workers.retrieval.calibration import TYPICAL_DISTANCES, typical_distance
from workers.retrieval.dissimilarity import DISSIMILARITIES, find_dissimilarity
from workers.retrieval.model import Model

MODELS = built_in_models()
NAMES = [model.name for model in MODELS]


@pytest.mark.parametrize("model", MODELS, ids=NAMES)
@pytest.mark.parametrize("name", sorted(DISSIMILARITIES))
def test_every_comparison_of_a_built_in_model_is_calibrated(model: Model, name: str) -> None:
    try:
        find_dissimilarity(name, distribution=model.channels[0].is_distribution)
    except InvalidRequestError:
        assert name not in TYPICAL_DISTANCES[model.method]
    else:
        assert typical_distance(model, name) == TYPICAL_DISTANCES[model.method][name] > 0.0


@pytest.mark.parametrize("model", MODELS, ids=NAMES)
def test_a_models_own_dissimilarity_is_meant_by_default(model: Model) -> None:
    own = model.channels[0].dissimilarity
    assert typical_distance(model) == typical_distance(model, own)
    assert typical_distance(model, "linf") != typical_distance(model, "l1")


def test_a_heat_model_of_another_name_is_calibrated_by_its_method() -> None:
    assert typical_distance(replace(MODELS[0], name="mine")) == typical_distance(MODELS[0])


def test_models_that_were_not_calibrated_are_measured_by_their_own_scale() -> None:
    channel = MODELS[0].channels[0]
    trained = replace(MODELS[0], method="spline")
    assert typical_distance(trained) == 1.0
    scaled = replace(MODELS[0], channels=(replace(channel, scale=0.3, weight=2.0),))
    assert typical_distance(scaled) == 2.0
    pair = (replace(channel, weight=0.5), replace(channel, name="second", weight=0.25))
    assert typical_distance(replace(MODELS[0], channels=pair)) == 0.75
