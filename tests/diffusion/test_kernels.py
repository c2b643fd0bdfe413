"""Laws of the transfer functions: closed forms, units, domains."""

import json
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from workers.diffusion.kernels import (
    BiharmonicKernel,
    CommuteTimeKernel,
    HeatKernel,
    Kernel,
    TabulatedKernel,
    evaluate,
    kernel_from_json,
    kernel_to_json,
)
from workers.errors import InvalidRequestError, KernelDomainError
from workers.geometry.arrays import FloatArray

EIGENVALUES = np.geomspace(0.01, 1000.0, 40)
TABLE = TabulatedKernel(np.array([1.0, 10.0, 1000.0]), np.array([4.0, 2.0, 0.0]))


def test_heat_kernels_of_two_times_multiply_to_that_of_their_sum() -> None:
    product = evaluate(HeatKernel(0.3), EIGENVALUES) * evaluate(HeatKernel(0.5), EIGENVALUES)
    assert_allclose(product, evaluate(HeatKernel(0.8), EIGENVALUES), rtol=1e-12)


def test_heat_transfer_is_the_square_of_the_heat_operators_own() -> None:
    assert_allclose(evaluate(HeatKernel(0.25), np.array([2.0])), [np.exp(-0.25 * 2.0) ** 2])


@given(factor=st.floats(0.01, 100.0))
def test_commute_time_satisfies_the_paper_s_condition_of_scale(factor: float) -> None:
    scaled = evaluate(CommuteTimeKernel(), EIGENVALUES / factor**2) / factor**2
    assert_allclose(scaled, evaluate(CommuteTimeKernel(), EIGENVALUES), rtol=1e-12)


def test_biharmonic_is_the_square_of_commute_time() -> None:
    commute = evaluate(CommuteTimeKernel(), EIGENVALUES)
    assert_allclose(evaluate(BiharmonicKernel(), EIGENVALUES), commute**2, rtol=1e-12)


def test_a_table_is_linear_in_the_logarithm_between_its_points() -> None:
    found = evaluate(TABLE, np.array([1.0, np.sqrt(10.0), 10.0, 100.0, 1000.0]))
    assert_allclose(found, [4.0, 3.0, 2.0, 1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("outside", [0.0, 0.99, 1001.0, -1.0])
def test_a_table_is_never_extrapolated(outside: float) -> None:
    with pytest.raises(
        KernelDomainError, match=r"tabulated kernel is known for eigenvalues from 1 to 1000"
    ):
        evaluate(TABLE, np.array([2.0, outside]))


def test_a_bound_off_by_rounding_is_still_inside_the_table() -> None:
    bounds = np.array([np.nextafter(1.0, 0.0), np.nextafter(1000.0, 2000.0)])
    assert_allclose(evaluate(TABLE, bounds), [4.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("kernel", [CommuteTimeKernel(), BiharmonicKernel()])
def test_a_zero_eigenvalue_is_outside_the_domain_of_its_inverse(kernel: Kernel) -> None:
    with pytest.raises(KernelDomainError, match="K² is inf at the eigenvalue 0"):
        evaluate(kernel, np.array([1.0, 0.0]))


class SineKernel:
    """No K²: it goes below 0."""

    kind: ClassVar[str] = "sine"

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        sine: FloatArray = np.sin(eigenvalues)
        return sine

    @property
    def parameters(self) -> dict[str, Any]:
        return {}


def test_a_kernel_that_goes_negative_is_refused() -> None:
    with pytest.raises(KernelDomainError, match="K² is -0"):
        evaluate(SineKernel(), np.array([1.0, 6.0]))


@pytest.mark.parametrize("time", [0.0, -1.0, np.nan, np.inf])
def test_heat_takes_positive_times_only(time: float) -> None:
    with pytest.raises(InvalidRequestError, match="heat time"):
        HeatKernel(time)


@pytest.mark.parametrize(
    ("eigenvalues", "values"),
    [([1.0], [1.0]), ([1.0, 2.0], [1.0]), ([2.0, 1.0], [1.0, 1.0]), ([0.0, 1.0], [1.0, 1.0])],
)
def test_a_table_without_an_ascending_axis_is_refused(
    eigenvalues: list[float], values: list[float]
) -> None:
    with pytest.raises(InvalidRequestError):
        TabulatedKernel(np.array(eigenvalues), np.array(values))


def test_a_table_below_zero_is_refused() -> None:
    with pytest.raises(KernelDomainError):
        TabulatedKernel(np.array([1.0, 2.0]), np.array([1.0, -1.0]))


@pytest.mark.parametrize(
    "kernel", [HeatKernel(0.15), CommuteTimeKernel(), BiharmonicKernel(), TABLE]
)
def test_json_brings_every_kernel_back(kernel: Kernel) -> None:
    again = kernel_from_json(json.loads(json.dumps(kernel_to_json(kernel))))
    assert type(again) is type(kernel)
    places = np.geomspace(1.0, 1000.0, 17)
    np.testing.assert_array_equal(evaluate(again, places), evaluate(kernel, places))


@pytest.mark.parametrize(
    "value",
    [
        {"kind": "wave"},
        {"kind": "heat", "parameters": {}},
        {"kind": "heat", "parameters": {"time": "soon"}},
        {"kind": "heat", "parameters": None},
        {"kind": "tabulated", "parameters": {"eigenvalues": [1, 2]}},
    ],
)
def test_json_of_no_kernel_is_refused(value: dict[str, object]) -> None:
    with pytest.raises(InvalidRequestError):
        kernel_from_json(value)
