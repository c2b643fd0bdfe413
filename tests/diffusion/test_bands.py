"""Mexican hats and wave kernels: where they peak, and what they refuse."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from workers.diffusion.bands import MexicanHatKernel, WaveKernel
from workers.diffusion.kernels import HeatKernel, evaluate, kernel_from_json, kernel_to_json
from workers.errors import InvalidRequestError

EIGENVALUES = np.geomspace(0.1, 1000.0, 4001)


@given(time=st.floats(0.01, 1.0))
def test_a_mexican_hat_is_largest_at_the_inverse_of_its_time(time: float) -> None:
    peak = EIGENVALUES[np.argmax(evaluate(MexicanHatKernel(time), EIGENVALUES))]
    assert peak == pytest.approx(1.0 / time, rel=5e-3)  # the grid's step


def test_a_mexican_hat_is_the_second_derivative_of_heat_in_time() -> None:
    time, step = 0.2, 1e-3
    heat = [HeatKernel(time + i * step).squared_transfer(EIGENVALUES[:2000]) for i in (-1, 0, 1)]
    second = (heat[0] - 2.0 * heat[1] + heat[2]) / step**2
    hat = MexicanHatKernel(time).squared_transfer(EIGENVALUES[:2000])
    assert_allclose(hat, 0.25 * time**2 * second, rtol=1e-3, atol=1e-6)


@given(energy=st.floats(0.0, 5.0))
def test_a_wave_is_largest_at_its_energy_and_even_about_it(energy: float) -> None:
    wave = WaveKernel(energy)
    offsets = np.linspace(0.0, 2.0, 50)
    above, below = (evaluate(wave, np.exp(energy + s * offsets)) for s in (1.0, -1.0))
    assert_allclose(above, below, rtol=1e-9)
    assert above[0] == pytest.approx(1.0)
    assert np.all(np.diff(above) < 0.0)


def test_no_band_lets_a_zero_through() -> None:
    for kernel in (MexicanHatKernel(0.1), WaveKernel(2.0)):
        assert evaluate(kernel, np.array([0.0]))[0] == 0.0


@pytest.mark.parametrize("kernel", [MexicanHatKernel(0.004), WaveKernel(3.0), WaveKernel(3.0, 0.5)])
def test_bands_survive_json(kernel: MexicanHatKernel | WaveKernel) -> None:
    assert kernel_from_json(json.loads(json.dumps(kernel_to_json(kernel)))) == kernel


def test_parameters_that_make_no_band_are_refused() -> None:
    for time in (0.0, -1.0, np.nan):
        with pytest.raises(InvalidRequestError, match="Mexican hat time"):
            MexicanHatKernel(time)
    for energy, width in ((np.inf, 0.35), (1.0, 0.0), (1.0, np.nan)):
        with pytest.raises(InvalidRequestError, match="wave energy"):
            WaveKernel(energy, width)
