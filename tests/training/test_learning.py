"""Laws of learned kernels: what they minimise, what they cannot see, what is refused."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.training.pairs_of_shapes import (
    deformed_pairs,
    deformed_spectra,
    moments_of,
    scaled_pairs,
    small_shapes,
)
from workers.diffusion.kernels import (
    CommuteTimeKernel,
    HeatKernel,
    Kernel,
    SplineKernel,
    TabulatedKernel,
    evaluate,
    kernel_to_json,
)
from workers.diffusion.splines import SplineBasis
from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.training.learning import LearnedKernel, learn_kernel
from workers.training.learning_options import LearningOptions
from workers.training.moments import CRITERIA, UNITS, PairMoments
from workers.training.pair_statistics import ShapeMoments, pair_statistics, shape_moments
from workers.training.quotient import RIDGE, closed_form, nonnegative_minimum, numerator, quotient
from workers.training.training_set import make_training_set

Pairs = tuple[list[PairMoments], list[str]]
FACTORS = (0.25, 0.5, 2.0, 4.0)
UNRELATED_FACTORS = (0.3, 0.5, 2.0, 3.5)
"""Not powers of one number, which would tie each point of a grid to every seventh one only."""


def criterion_value(
    kernel: Kernel, moments: list[PairMoments], labels: list[str], *, unit: str
) -> float:
    """Criterion of eq. (7) for one kernel, with nothing held out."""
    everything = make_training_set(
        moments, labels, criterion=moments[0].criterion, unit=unit, hold_out=False
    )
    return float(everything.criteria(lambda values: evaluate(kernel, values)[:, None])[0])


@pytest.fixture(scope="module", params=CRITERIA)
def scaled(request: pytest.FixtureRequest) -> Pairs:
    """Four shapes and copies of other sizes."""
    return scaled_pairs(small_shapes(), FACTORS, request.param)


@pytest.fixture(scope="module", params=CRITERIA)
def deformed(request: pytest.FixtureRequest) -> Pairs:
    """Four shapes, smoothly deformed, in several sizes."""
    return deformed_pairs(request.param)


def learn(pairs: Pairs, **options: Any) -> LearnedKernel:
    moments, labels = pairs
    return learn_kernel(moments, labels, LearningOptions(criterion=moments[0].criterion, **options))


def training_part(pairs: Pairs, learned: LearnedKernel) -> Pairs:
    """The pairs of the classes that were learned from."""
    kept = [i for i, label in enumerate(pairs[1]) if label in learned.report["classes"]]
    return [pairs[0][i] for i in kept], [pairs[1][i] for i in kept]


@pytest.mark.parametrize("smoothness", [0.0, 1e-9])
def test_scale_alone_teaches_commute_time(scaled: Pairs, smoothness: float) -> None:
    learned = learn(scaled, unit="none", smoothness=smoothness)
    assert_allclose(learned.report["slope"], -1.0, atol=0.005)
    low, high = learned.report["trained_range"]
    places = np.geomspace(low, high, 1000)
    flat = evaluate(learned.kernel, places) * places
    # 7 % of a function that falls by four decades: what the smoothness term costs
    assert_allclose(flat / np.median(flat), 1.0, atol=0.07)


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("interpolation", ["nearest", "linear"])
def test_scale_alone_teaches_commute_time_on_a_grid(criterion: str, interpolation: str) -> None:
    pairs = scaled_pairs(small_shapes(), UNRELATED_FACTORS, criterion)
    learned = learn(pairs, unit="none", method="grid", points=40, interpolation=interpolation)
    assert_allclose(learned.report["slope"], -1.0, atol=0.01)  # steps of 0.2 in ln λ


def test_a_strong_smoothness_flattens_the_kernel(scaled: Pairs) -> None:
    slopes = [learn(scaled, unit="none", smoothness=s).report["slope"] for s in (0, 1e-5, 1e-1)]
    assert slopes[0] < slopes[1] < slopes[2] < -0.1


def test_commute_time_is_perfect_under_scale_and_heat_is_not(scaled: Pairs) -> None:
    assert criterion_value(CommuteTimeKernel(), *scaled, unit="none") < 1e-14
    assert criterion_value(HeatKernel(0.02), *scaled, unit="none") > 0.01


@pytest.mark.parametrize("unit", UNITS)
def test_the_closed_form_is_below_every_kernel_of_its_span(deformed: Pairs, unit: str) -> None:
    learned = learn(deformed, unit=unit, smoothness=0.0, splines=12)
    found = learned.report["criterion"]["training"]
    kept = training_part(deformed, learned)
    assert isinstance(learned.kernel, SplineKernel)
    rng = np.random.default_rng(0)
    for _ in range(20):
        coefficients = rng.exponential(size=12) ** 3
        other = SplineKernel(learned.kernel.low, learned.kernel.high, 3, coefficients)
        assert found["learned"] <= criterion_value(other, *kept, unit=unit)
    assert 0.0 < found["closed-form"] <= found["learned"] * (1 + 1e-9)


@pytest.mark.parametrize("unit", UNITS)
def test_what_is_learned_is_no_worse_than_commute_time_and_heat(deformed: Pairs, unit: str) -> None:
    learned = learn(deformed, unit=unit, smoothness=0.0)
    found = learned.report["criterion"]["training"]
    assert found["learned"] <= found["commute-time"] * (1 + 1e-6)  # 1/λ is all but in the span
    assert found["learned"] <= found["heat"] * (1 + 1e-6)


@pytest.mark.parametrize("unit", UNITS)
def test_learned_kernels_are_never_negative(deformed: Pairs, unit: str) -> None:
    for options in ({}, {"smoothness": 1e-2}, {"method": "grid"}, {"nonnegative": False}):
        learned = learn(deformed, unit=unit, **options)
        low, high = learned.report["domain"]
        squared = evaluate(learned.kernel, np.geomspace(low, high, 100_000))
        assert squared.min() >= 0.0
        assert squared.max() > 0.0


def test_the_plain_closed_form_is_clipped_and_says_how_much(deformed: Pairs) -> None:
    learned = learn(deformed, nonnegative=False, smoothness=0.0)
    assert isinstance(learned.kernel, TabulatedKernel)
    low, high = learned.report["trained_range"]
    inner = learned.kernel.squared_transfer(np.geomspace(low, high, 2000))
    assert_allclose((inner == 0.0).mean(), learned.report["negative_share"], atol=0.01)


@pytest.mark.parametrize("unit", ["area", "first-eigenvalue"])
@pytest.mark.parametrize("method", ["spline", "grid", "heat-time"])
def test_the_size_of_shapes_does_not_matter_where_the_unit_forgets_it(
    unit: str, method: str
) -> None:
    pairs = deformed_spectra()
    labels = [label for _, _, label in pairs]
    plain = [moments_of(x, y, "distance") for x, y, _ in pairs]
    sizes = np.geomspace(0.01, 30.0, len(pairs))
    scaled = [
        moments_of(x.rescaled(size), y.rescaled(1.0 / size), "distance")
        for (x, y, _), size in zip(pairs, sizes, strict=True)
    ]
    options = LearningOptions(method=method, unit=unit)
    first, second = (learn_kernel(moments, labels, options) for moments in (plain, scaled))
    assert_allclose(second.report["heat_time"], first.report["heat_time"], rtol=1e-4)
    assert_allclose(
        second.report["criterion"]["training"]["learned"],
        first.report["criterion"]["training"]["learned"],
        rtol=1e-6,
    )


def test_the_best_time_is_the_least_of_a_fine_grid(deformed: Pairs) -> None:
    learned = learn(deformed, method="heat-time", unit="none")
    assert isinstance(learned.kernel, HeatKernel)
    best = learned.kernel.time
    kept = training_part(deformed, learned)
    times = best * np.geomspace(0.05, 20.0, 81)  # the 41st is the best
    values = [criterion_value(HeatKernel(time), *kept, unit="none") for time in times]
    assert int(np.argmin(values)) == 40
    found = learned.report["criterion"]["training"]
    assert_allclose([found["learned"], found["heat"]], values[40], rtol=1e-9)


def test_classes_are_held_out_and_measured_apart(deformed: Pairs) -> None:
    learned = learn(deformed)
    report = learned.report
    assert report["held_out_classes"] == ["class-3"]
    assert report["classes"] == ["class-0", "class-1", "class-2"]
    assert (report["n_pairs"], report["n_held_out_pairs"]) == (9, 3)
    moments, labels = deformed
    without = learn_kernel(moments[:9], labels[:9], LearningOptions(criterion=moments[0].criterion))
    assert without.report["criterion"]["held-out"] is None
    assert without.report["criterion"]["training"] == report["criterion"]["training"]
    assert isinstance(learned.kernel, SplineKernel)
    assert isinstance(without.kernel, SplineKernel)
    assert_array_equal(without.kernel.coefficients, learned.kernel.coefficients)


def test_the_held_out_criterion_is_that_of_the_pairs_of_these_classes(deformed: Pairs) -> None:
    learned = learn(deformed, unit="area")
    sums: dict[str, ShapeMoments] = {}
    for moments, label in zip(*deformed, strict=True):
        one = shape_moments(moments, lambda x: 1.0 / x[:, None], "area")
        sums[label] = sums[label] + one if label in sums else one
    positive, negative = pair_statistics(sums, ["class-3"]).means
    found = learned.report["criterion"]["held-out"]["commute-time"]
    assert_allclose(found, positive[0, 0] / negative[0, 0], rtol=1e-10)


def test_distances_have_mean_square_one_and_stay_below_the_top(deformed: Pairs) -> None:
    learned = learn(deformed, unit="area")
    means = []
    for moments in training_part(deformed, learned)[0]:
        first, second = moments.columns(
            lambda values: evaluate(learned.kernel, values)[:, None], "area"
        )
        k = len(first)
        means.append(float(moments.squared_distance[:k] @ first[:, 0]))
        means.append(float(moments.squared_distance[k:] @ second[:, 0]))
    assert_allclose(np.mean(means), 1.0, rtol=1e-12)
    assert_allclose(learned.report["top_distance"], 2.5 * np.sqrt(max(means)), rtol=1e-12)


def test_knots_stand_a_factor_e_apart_unless_told_otherwise(deformed: Pairs) -> None:
    report = learn(deformed).report
    low, high = report["trained_range"]
    assert report["functions"] == round(np.log(high / low)) + 3
    assert learn(deformed, splines=7).report["functions"] == 7


@pytest.mark.parametrize(
    "options",
    [{}, {"nonnegative": False}, {"method": "grid", "interpolation": "nearest"}, {"splines": 60}],
)
def test_learning_again_gives_the_same_bytes(deformed: Pairs, options: dict[str, Any]) -> None:
    first, second = (learn(deformed, **options) for _ in range(2))
    assert json.dumps(kernel_to_json(first.kernel)) == json.dumps(kernel_to_json(second.kernel))
    assert json.dumps(dict(first.report), allow_nan=False) == json.dumps(dict(second.report))


@pytest.mark.parametrize(("method", "size"), [("grid", "points"), ("spline", "splines")])
def test_more_functions_than_eigenvalues_still_give_a_kernel(
    deformed: Pairs, method: str, size: str
) -> None:
    options: dict[str, Any] = {"method": method, size: 400, "unit": "area"}
    if method == "spline":
        options["smoothness"] = 0.0
    else:
        options["interpolation"] = "nearest"
    learned = learn(deformed, **options)
    assert learned.report["unseen_functions"] > 0
    low, high = learned.report["domain"]
    squared = evaluate(learned.kernel, np.geomspace(low, high, 5000))
    assert np.isfinite(squared).all()
    found = learned.report["criterion"]["training"]
    assert 0.0 <= found["learned"] <= found["commute-time"]


def test_one_class_is_not_enough(deformed: Pairs) -> None:
    moments, _ = deformed
    with pytest.raises(InsufficientTrainingDataError, match=r"1 classes \('cat'\); at least 2"):
        learn((moments, ["cat"] * len(moments)))
    with pytest.raises(InsufficientTrainingDataError, match="0 pairs of shapes of 0 classes"):
        learn_kernel([], [], LearningOptions())


def test_transformations_that_change_nothing_teach_nothing(scaled: Pairs) -> None:
    with pytest.raises(InsufficientTrainingDataError, match=r"do not differ .* 'area'"):
        learn(scaled, unit="area")


def test_a_single_eigenvalue_is_no_range_to_learn_on() -> None:
    moments = []
    for spectrum in small_shapes()[:2]:
        one = spectrum.rescaled(1.0)
        cut = type(one)(one.eigenvalues[:1], one.eigenvectors[:, :1], one.areas, one.area)
        moments.append(moments_of(cut, cut, "distance"))
    with pytest.raises(InsufficientTrainingDataError, match="all eigenvalues to learn from are 1"):
        learn_kernel(moments, ["a", "b"], LearningOptions())


def test_moments_of_another_criterion_are_refused(deformed: Pairs) -> None:
    moments, labels = deformed
    other = "kernel" if moments[0].criterion == "distance" else "distance"
    with pytest.raises(InvalidRequestError, match=f"expected '{other}'"):
        learn_kernel(moments, labels, LearningOptions(criterion=other))
    with pytest.raises(InvalidRequestError, match="12 pairs of shapes have 1 labels"):
        learn_kernel(moments, ["a"], LearningOptions())


@pytest.mark.parametrize(
    ("method", "parameters", "message"),
    [
        ("bank", {}, "no method 'bank'; there are spline, grid, heat-time"),
        ("spline", {"points": 5}, "takes no parameter 'points'"),
        ("spline", {"splines": 3}, "splines is 3, expected a whole number from 4"),
        ("spline", {"splines": True}, "splines is True"),
        ("spline", {"smoothness": -1.0}, "smoothness is -1.0"),
        ("spline", {"smoothness": float("nan")}, "smoothness is nan"),
        ("spline", {"nonnegative": 1}, "nonnegative is 1"),
        ("spline", {"unit": "metre"}, "no unit 'metre'"),
        ("grid", {"interpolation": "cubic"}, "no interpolation 'cubic'"),
        ("grid", {"criterion": []}, "no criterion"),
        ("heat-time", {"smoothness": 1.0}, "takes no parameter 'smoothness'"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    method: str, parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(InvalidRequestError, match=message):
        LearningOptions.from_json(method, parameters)


@pytest.mark.parametrize("method", ["spline", "grid", "heat-time"])
def test_options_come_back_from_json(method: str) -> None:
    options = LearningOptions(method=method, unit="none", criterion="kernel")
    again = LearningOptions.from_json(method, json.loads(json.dumps(options.to_json())))
    assert again == options


def random_quotient(seed: int, size: int = 9) -> Sequence[np.ndarray]:
    """Two positive definite matrices."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, size, 2 * size))
    return a @ a.T, b @ b.T


@pytest.mark.parametrize("seed", range(4))
def test_the_closed_form_solves_the_generalised_eigenproblem(seed: int) -> None:
    above, below = random_quotient(seed)
    smallest = np.linalg.eigvals(np.linalg.solve(below, above)).real.min()
    assert_allclose(quotient(closed_form(above, below), above, below), smallest, rtol=1e-9)


def test_the_line_above_the_closed_form_in_the_paper_is_another_function() -> None:
    positive, negative = random_quotient(0)
    roughness = SplineBasis(1.0, 10.0, 9, 3).roughness_penalty()
    best = closed_form(positive + roughness, negative)
    half = 0.5 * best

    def first_line(a: np.ndarray) -> float:
        return quotient(a, positive, negative) + float(a @ roughness @ a)

    assert first_line(half) < first_line(best)  # it falls with the scale of a, which means nothing
    both = positive + roughness
    assert_allclose(quotient(half, both, negative), quotient(best, both, negative), rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_the_nonnegative_minimum_is_below_its_starts_and_its_neighbours(seed: int) -> None:
    above, below = random_quotient(seed)
    rng = np.random.default_rng(seed + 50)
    starts = [np.ones(9), np.maximum(closed_form(above, below), 0.0), rng.exponential(size=9)]
    found = nonnegative_minimum(above, below, starts)
    assert found.min() >= 0.0
    value = quotient(found, above, below)
    assert quotient(closed_form(above, below), above, below) <= value * (1 + 1e-12)
    for start in starts:
        assert value <= quotient(start, above, below)
    for i in range(9):
        for step in (-1e-4, 1e-4):
            moved = found.copy()
            moved[i] = max(moved[i] + step, 0.0)
            assert value <= quotient(moved, above, below) * (1 + 1e-12)


def test_the_ridge_moves_no_quotient_of_nonnegative_coefficients() -> None:
    positive, negative = (np.abs(matrix) for matrix in random_quotient(1))
    a = np.random.default_rng(0).exponential(size=9)
    plain = quotient(a, positive, negative)
    with_ridge = quotient(a, numerator(positive, 0.0 * positive, negative), negative)
    assert 0.0 <= with_ridge - plain <= RIDGE + 1e-15 * plain
