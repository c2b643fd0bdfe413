"""The built-in models: what they are, and the laws that their descriptors hold to."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere, icosphere, renumbered, rotated, scaled, torus
from workers.errors import InvalidRequestError, SpectrumError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.views import default_view
from workers.retrieval.builtin import built_in_models, heat_model, histogram_edges
from workers.retrieval.kernel_curves import kernel_curves
from workers.retrieval.model import Model, describe
from workers.retrieval.scan import distances

MODELS = built_in_models()
each_model = pytest.mark.parametrize("model", MODELS, ids=[model.name for model in MODELS])


def described(mesh: TriangleMesh, model: Model) -> np.ndarray:
    solution = Solution(mesh, compute_spectrum(mesh, n_eigenpairs=60))
    return describe({"closed": solution}, model)


def test_the_built_in_models_are_those_of_the_interface() -> None:
    assert [model.name for model in MODELS] == ["heat", "commute-time", "biharmonic", "shape-dna"]
    assert all(model.name == model.method for model in MODELS)
    assert MODELS[0].parameters == {"time": 0.15}


@each_model
def test_json_brings_a_model_back(model: Model) -> None:
    assert Model.from_json(json.loads(json.dumps(model.to_json()))) == model


def test_the_view_follows_the_setting() -> None:
    keys = {model.views[0].key for model in built_in_models(working_vertices=2500)}
    assert keys == {default_view(working_vertices=2500).key}
    assert keys != {model.views[0].key for model in MODELS}


@each_model
def test_scaled_rotated_and_renumbered_copies_have_the_same_descriptor(
    bumpy: Solution, model: Model
) -> None:
    rng = np.random.default_rng(3)
    copy, _ = renumbered(rotated(scaled(bumpy.mesh, 37.0), rng), rng)
    original = describe({"closed": bumpy}, model)
    # relative to the whole descriptor: float32 and the solver's rounding
    assert np.abs(described(copy, model) - original).sum() <= 1e-6 * np.abs(original).sum()


@each_model
def test_different_surfaces_are_far_apart(bumpy: Solution, model: Model) -> None:
    shapes = [icosphere(3), torus(40, 16), bumpy_sphere(seed=5)]
    rows = np.stack([describe({"closed": bumpy}, model), *(described(s, model) for s in shapes)])
    for row in rows:
        assert np.count_nonzero(distances(row, rows, model) < 0.05) == 1


@each_model
def test_distance_is_the_plain_dissimilarity(model: Model) -> None:
    (channel,) = model.channels
    assert channel.scale == channel.weight == model.fusion_power == 1.0


def test_shape_dna_of_too_small_a_mesh_says_so() -> None:
    mesh = icosphere(0)
    prepared = {"closed": Solution(mesh, compute_spectrum(mesh, n_eigenpairs=100))}
    with pytest.raises(SpectrumError, match=r"needs 20 eigenvalues.* has 11"):
        describe(prepared, MODELS[3])


def test_edges_ascend_evenly_and_then_faster() -> None:
    widths = np.diff(histogram_edges(3.0))
    assert len(widths) == 100
    assert_allclose(widths[:90], 3.0 / 90, rtol=1e-6)  # edges have 9 digits
    assert np.all(np.diff(widths[90:]) > 0.0)
    assert histogram_edges(3.0)[-1] == pytest.approx(12.0)


@pytest.mark.parametrize("time", [1e-4, 0.01, 0.15, 1.0, 5.0, 20.0])
def test_histograms_of_every_heat_time_are_neither_empty_nor_full(
    bumpy: Solution, time: float
) -> None:
    model = heat_model(default_view(), time=time)
    vector = model.channels[0].describe(bumpy)
    assert np.count_nonzero(vector) >= 10
    assert vector[-1] < 0.01


def test_heat_of_the_default_time_is_the_built_in_model() -> None:
    assert heat_model(default_view()) == MODELS[0]


@pytest.mark.parametrize("time", [0.0, -1.0, float("nan"), float("inf"), 1000.0])
def test_heat_times_without_sense_are_refused(time: float) -> None:
    with pytest.raises(InvalidRequestError, match="heat time"):
        heat_model(default_view(), time=time)


def test_curves_are_those_of_the_kernels() -> None:
    (curve,) = kernel_curves(MODELS[1])
    assert curve.kind == "commute-time"
    assert_array_equal(curve.squared_transfer, 1.0 / curve.eigenvalues)
    assert kernel_curves(MODELS[3]) == ()
