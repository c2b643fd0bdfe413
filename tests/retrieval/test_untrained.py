"""Models that are asked for by method and parameters."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import bumpy_sphere, scaled
from workers.errors import InvalidRequestError
from workers.geometry.solution import Solution, solve
from workers.geometry.views import default_view
from workers.retrieval.builtin import FIRST_EIGENVALUE, built_in_models
from workers.retrieval.model import Model, describe
from workers.retrieval.untrained import UNTRAINED_METHODS, untrained_model

VIEW = default_view(working_vertices=500)
DEFAULTS: dict[str, dict[str, Any]] = {
    "heat": {"time": 0.15, "unit": "first-eigenvalue"},
    "commute-time": {"unit": "area"},
    "biharmonic": {},
    "shape-dna": {"eigenvalues": 20},
}


def make(method: str, **changes: Any) -> Model:
    return untrained_model("mine", method, {**DEFAULTS[method], **changes}, view=VIEW)


@pytest.fixture(scope="module")
def ball() -> Solution:
    return solve(bumpy_sphere(2, seed=1), VIEW)


def descriptor(solution: Solution, model: Model) -> np.ndarray:
    return describe({VIEW.name: solution}, model)


def test_defaults_are_the_built_in_models() -> None:
    built_in = {model.method: model for model in built_in_models(working_vertices=500)}
    assert set(UNTRAINED_METHODS) == built_in.keys()
    for method, model in built_in.items():
        assert make(method).channels == model.channels
        assert make(method).parameters == DEFAULTS[method]


@pytest.mark.parametrize("method", UNTRAINED_METHODS)
def test_models_survive_json(method: str) -> None:
    model = make(method)
    assert Model.from_json(model.to_json()).to_json() == model.to_json()


def test_commute_time_is_the_same_in_every_unit(ball: Solution) -> None:
    rows = [
        descriptor(ball, make("commute-time", unit=unit))
        for unit in ("none", "area", "first-eigenvalue")
    ]
    assert_allclose(rows[0], rows[1], atol=1e-4)  # a distance on a bin's edge may change sides
    assert_allclose(rows[0], rows[2], atol=1e-4)


def test_heat_sees_scale_in_the_files_own_unit_only(ball: Solution) -> None:
    large = solve(scaled(bumpy_sphere(2, seed=1), 3.0), VIEW)
    for unit, is_seen in (("none", True), ("area", False), ("first-eigenvalue", False)):
        model = make("heat", time=0.05, unit=unit)
        moved = np.abs(descriptor(ball, model) - descriptor(large, model)).sum()
        assert (moved > 0.2) == is_seen, unit


@pytest.mark.parametrize("time", [0.005, 0.15, 2.0])
def test_the_range_of_heat_distances_is_the_same_in_both_normalised_units(time: float) -> None:
    """Area 1 is λ₁ = 1 in another size: lengths, and so 1/distances, by √(λ₁ A)."""
    normal, by_area = (
        make("heat", time=time),
        make("heat", time=time / FIRST_EIGENVALUE, unit="area"),
    )
    ends = [model.channels[0].axis.values for model in (normal, by_area)]
    assert_allclose(ends[1][-1] / ends[0][-1], np.sqrt(FIRST_EIGENVALUE), rtol=1e-8)


def test_what_makes_no_model_is_refused() -> None:
    with pytest.raises(InvalidRequestError, match="heat, commute-time, biharmonic, shape-dna"):
        untrained_model("mine", "spline", {}, view=VIEW)
    with pytest.raises(InvalidRequestError, match="at most 20"):
        make("heat", time=1e6)
    with pytest.raises(InvalidRequestError, match="30 are computed"):
        untrained_model("mine", "shape-dna", {"eigenvalues": 31}, view=replace(VIEW, eigenpairs=30))
