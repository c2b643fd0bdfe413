"""Laws of the functions in which K² is written, and of the kernel made of them."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from workers.diffusion.kernels import SplineKernel, evaluate, kernel_from_json, kernel_to_json
from workers.diffusion.splines import SplineBasis
from workers.errors import InvalidRequestError, KernelDomainError

LOW, HIGH = 0.5, 800.0
FINE = np.geomspace(LOW, HIGH, 100_000)
RANGE = np.log(HIGH / LOW)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_basis_functions_sum_to_one_and_are_never_negative(degree: int) -> None:
    values = SplineBasis(LOW, HIGH, 11, degree).values(FINE[::50])
    assert values.min() >= 0.0
    assert_allclose(values.sum(axis=1), 1.0, rtol=1e-13)


@pytest.mark.parametrize("degree", [0, 1])
def test_interpolation_gives_back_what_stands_on_the_grid(degree: int) -> None:
    basis = SplineBasis(LOW, HIGH, 9, degree)
    assert_allclose(basis.places, np.geomspace(LOW, HIGH, 9), rtol=1e-13)
    assert_allclose(basis.values(basis.places), np.eye(9), atol=1e-12)


def test_nearest_neighbours_change_half_way_between_grid_points() -> None:
    basis = SplineBasis(1.0, 100.0, 3, 0)  # grid 1, 10, 100; bounds at 10^0.5 and 10^1.5
    values = basis.values(np.array([1.0, 3.1, 3.2, 10.0, 31.0, 32.0, 100.0]))
    assert_array_equal(values.argmax(axis=1), [0, 0, 1, 1, 1, 2, 2])


def test_linear_interpolation_is_numpys_own_in_ln_lambda() -> None:
    basis = SplineBasis(LOW, HIGH, 7, 1)
    heights = np.array([3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0])
    expected = np.interp(np.log(FINE), np.log(basis.places), heights)
    assert_allclose(basis.values(FINE) @ heights, expected, rtol=1e-10)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_splines_reproduce_a_straight_line_from_their_places(degree: int) -> None:
    basis = SplineBasis(LOW, HIGH, 12, degree)
    line = basis.values(FINE[::50]) @ np.log(basis.places)
    assert_allclose(line, np.log(FINE[::50]), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_roughness_of_ln_lambda_is_the_length_of_its_range(degree: int) -> None:
    basis = SplineBasis(LOW, HIGH, 14, degree)
    line = np.log(basis.places)
    assert_allclose(line @ basis.roughness_penalty() @ line, RANGE, rtol=1e-12)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_only_constants_have_no_roughness(degree: int) -> None:
    roughness = SplineBasis(LOW, HIGH, 10, degree).roughness_penalty()
    assert_allclose(roughness, roughness.T, atol=1e-14)
    values, vectors = np.linalg.eigh(roughness)
    assert abs(values[0]) < 1e-12 < values[1]
    assert_allclose(vectors[:, 0], vectors[0, 0], rtol=1e-10)


def test_roughness_is_the_integral_of_the_squared_slope() -> None:
    basis = SplineBasis(LOW, HIGH, 9, 3)
    coefficients = np.array([1.0, 7.0, 2.0, 0.0, 3.0, 3.0, 8.0, 1.0, 4.0])
    places = np.linspace(np.log(LOW), np.log(HIGH), 200_001)
    slope = np.gradient(basis.values(np.exp(places)) @ coefficients, places)
    numerical = np.trapezoid(slope**2, places)
    exact = coefficients @ basis.roughness_penalty() @ coefficients
    assert_allclose(exact, numerical, rtol=1e-4)  # of the finite differences at the ends


def test_roughness_of_a_grid_is_that_of_its_steps() -> None:
    heights = np.array([1.0, 4.0, 4.0, 0.0])
    nearest, linear = (SplineBasis(LOW, HIGH, 4, degree).roughness_penalty() for degree in (0, 1))
    assert_allclose(heights @ nearest @ heights, (9.0 + 0.0 + 16.0) / (RANGE / 3.0), rtol=1e-12)
    assert_allclose(linear, nearest, atol=1e-12)


@pytest.mark.parametrize("outside", [LOW * 0.999, HIGH * 1.001, 0.0, -1.0, np.nan])
def test_a_basis_says_nothing_outside_its_range(outside: float) -> None:
    values = SplineBasis(LOW, HIGH, 6, 3).values(np.array([1.0, outside]))
    assert np.isfinite(values[0]).all()
    assert np.isnan(values[1]).all()


@pytest.mark.parametrize(
    "arguments",
    [(0.0, 1.0, 5, 3), (2.0, 1.0, 5, 3), (1.0, np.inf, 5, 3), (1.0, 2.0, 3, 3), (1.0, 2.0, 5, 4)],
)
def test_a_basis_that_cannot_be_is_refused(arguments: tuple[float, float, int, int]) -> None:
    with pytest.raises(InvalidRequestError):
        SplineBasis(*arguments)


hostile = st.lists(
    st.one_of(st.just(0.0), st.floats(0.0, 1e300), st.floats(0.0, 1e-300)), min_size=4, max_size=30
)


@given(coefficients=hostile, degree=st.integers(0, 3))
def test_no_coefficients_from_zero_make_a_kernel_negative(
    coefficients: list[float], degree: int
) -> None:
    kernel = SplineKernel(LOW, HIGH, degree, np.array(coefficients))
    squared = kernel.squared_transfer(FINE)
    assert squared.min() >= 0.0
    assert squared.max() <= max(coefficients) * (1.0 + 1e-12)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_a_spline_kernel_is_constant_between_its_splines_and_its_domain(degree: int) -> None:
    coefficients = np.array([5.0, 1.0, 2.0, 3.0])
    kernel = SplineKernel(1.0, 100.0, degree, coefficients, (0.25, 400.0))
    found = evaluate(kernel, np.array([0.25, 0.9, 1.0, 100.0, 101.0, 400.0]))
    assert_allclose(found, [5.0, 5.0, 5.0, 3.0, 3.0, 3.0], rtol=1e-12)


@pytest.mark.parametrize("outside", [0.2, 401.0, 0.0, -1.0])
def test_a_spline_kernel_is_never_extrapolated(outside: float) -> None:
    kernel = SplineKernel(1.0, 100.0, 3, np.ones(5), (0.25, 400.0))
    with pytest.raises(
        KernelDomainError, match=rf"spline kernel is known .* 0.25 to 400, .* has {outside:g}"
    ):
        evaluate(kernel, np.array([2.0, outside]))


def test_a_bound_off_by_rounding_is_still_inside() -> None:
    kernel = SplineKernel(1.0, 100.0, 3, np.arange(5.0))
    bounds = np.array([np.nextafter(1.0, 0.0), np.nextafter(100.0, 200.0)])
    assert_allclose(evaluate(kernel, bounds), [0.0, 4.0], atol=1e-9)


@pytest.mark.parametrize("limits", [None, (0.1, 3000.0)])
def test_json_brings_a_spline_kernel_back(limits: tuple[float, float] | None) -> None:
    kernel = SplineKernel(LOW, HIGH, 3, np.array([0.1, 2.0 / 3.0, 0.0, 7.0, 1e-9]), limits)
    again = kernel_from_json(json.loads(json.dumps(kernel_to_json(kernel))))
    assert isinstance(again, SplineKernel)
    assert again.domain == kernel.domain
    assert_array_equal(evaluate(again, FINE[::100]), evaluate(kernel, FINE[::100]))


@pytest.mark.parametrize("wrong", [[1.0, -1e-9, 1.0, 1.0], [1.0, np.nan, 1.0, 1.0], [np.inf] * 4])
def test_coefficients_that_are_no_squares_are_refused(wrong: list[float]) -> None:
    with pytest.raises(KernelDomainError, match="coefficient"):
        SplineKernel(LOW, HIGH, 3, np.array(wrong))


def test_a_domain_inside_the_splines_range_is_refused() -> None:
    with pytest.raises(InvalidRequestError, match="domain goes from 1 to 500"):
        SplineKernel(LOW, HIGH, 3, np.ones(4), (1.0, 500.0))


@pytest.mark.parametrize(
    "parameters",
    [{}, {"low": 1, "high": 2, "degree": 3}, {"low": 1, "high": 2, "degree": 3, "coefficients": 1}],
)
def test_json_of_no_spline_is_refused(parameters: dict[str, Any]) -> None:
    with pytest.raises(InvalidRequestError):
        kernel_from_json({"kind": "spline", "parameters": parameters})
