"""A learned kernel as a model: its unit, its range, its scale of similarity."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import box, bumpy_sphere, scaled, torus
from workers.diffusion.kernels import SplineKernel
from workers.errors import KernelDomainError
from workers.geometry.solution import Solution, solve
from workers.geometry.views import View, default_view
from workers.retrieval.calibration import typical_distance
from workers.retrieval.channels import DistanceChannel
from workers.retrieval.dissimilarity import DISSIMILARITIES
from workers.retrieval.kernel_curves import kernel_curves
from workers.retrieval.model import Model, describe
from workers.retrieval.scan import distances, similarity
from workers.training.learned import calibrated, learned_model
from workers.training.learning import LearnedKernel

VIEW = default_view(working_vertices=500)
KERNEL = SplineKernel(1.0, 100.0, 3, np.array([4.0, 2.0, 1.0, 0.5, 0.1]), (0.5, 200.0))
LEARNED = LearnedKernel(
    KERNEL,
    MappingProxyType({"method": "spline", "unit": "first-eigenvalue", "top_distance": 6.0}),
)


def make(learned: LearnedKernel = LEARNED, view: View = VIEW) -> Model:
    return learned_model(
        "mine", learned, parameters={"splines": 5}, view=view, versions={"pairs": "7"}
    )


@pytest.fixture(scope="module")
def solutions() -> list[Solution]:
    ball = bumpy_sphere(2, seed=1)
    return [solve(mesh, VIEW) for mesh in (ball, scaled(ball, 5.0), torus(24, 12), box(1, 2, 3))]


def test_a_learned_model_is_one_channel_in_the_unit_it_was_learned_in() -> None:
    model = make()
    (channel,) = model.channels
    assert isinstance(channel, DistanceChannel)
    assert (model.method, model.parameters, channel.kernel) == ("spline", {"splines": 5}, KERNEL)
    assert (channel.name, channel.normalisation) == ("distances", "first-eigenvalue")
    assert channel.axis.values[90] == 6.0
    assert model.versions["pairs"] == "7"
    assert "solver" in model.versions


def test_a_learned_model_survives_json() -> None:
    model = replace(make(), typical_distances={"l1": 0.4})
    found = Model.from_json(model.to_json())
    assert found.to_json() == model.to_json()
    assert typical_distance(found) == 0.4


def test_the_curve_of_a_learned_kernel_is_drawn_where_it_is_known() -> None:
    (curve,) = kernel_curves(make())
    assert_allclose(curve.eigenvalues[[0, -1]], [0.5, 200.0])
    assert_allclose(curve.squared_transfer[[0, -1]], [4.0, 0.1])


def test_typical_distances_are_medians_between_classes(solutions: list[Solution]) -> None:
    labels = ["ball", "ball", "ring", "crate"]
    model = calibrated(make(), solutions, labels)
    assert model.typical_distances.keys() <= DISSIMILARITIES.keys()
    rows = np.stack([describe({VIEW.name: solution}, model) for solution in solutions])
    matrix = np.stack([distances(row, rows, model) for row in rows])
    others = np.array(labels)[:, None] != np.array(labels)
    assert_allclose(model.typical_distances["l1"], np.median(matrix[others]), rtol=5e-3)
    assert similarity(matrix[0], model)[1] > 0.99  # the same shape in another size
    assert similarity(np.array([model.typical_distances["l1"]]), model)[0] == 0.5


def test_shapes_that_the_kernel_is_not_known_for_count_nothing(solutions: list[Solution]) -> None:
    narrow = replace(KERNEL, limits=(1.0, 100.0), low=1.0, high=100.0)
    model = make(replace(LEARNED, kernel=narrow))
    needle = solve(box(0.05, 0.05, 9.0), VIEW)
    with pytest.raises(KernelDomainError):
        describe({VIEW.name: needle}, model)
    labels = ["ball", "ball", "ring", "crate"]
    with_needle = calibrated(model, [*solutions, needle], [*labels, "needle"])
    assert with_needle.typical_distances == calibrated(model, solutions, labels).typical_distances


def test_one_class_has_no_typical_distance(solutions: list[Solution]) -> None:
    assert calibrated(make(), solutions[:2], ["ball", "ball"]).typical_distances == {}
