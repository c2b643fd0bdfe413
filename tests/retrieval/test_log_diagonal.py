"""Channels of ln k(x,x) and of the area: units, centres, and what does not fit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import bumpy_sphere, scaled
from workers.diffusion.bands import WaveKernel
from workers.diffusion.distances import diagonal_signature
from workers.diffusion.kernels import HeatKernel
from workers.errors import InvalidRequestError
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.retrieval.channels import (
    AreaChannel,
    LogDiagonalChannel,
    Quantiles,
    channel_from_json,
)

LEVELS = (0.05, 0.5, 0.95)
PLAIN = LogDiagonalChannel(
    name="h",
    view="closed",
    kernel=HeatKernel(0.01),
    normalisation="area",
    summary=Quantiles(LEVELS),
)
EVEN = replace(PLAIN, centre="log-mean")
SIZE = AreaChannel(name="a", view="closed")


def test_quantiles_of_logarithms_are_logarithms_of_quantiles(bumpy: Solution) -> None:
    spectrum = bumpy.spectrum.rescaled(1.0 / np.sqrt(bumpy.spectrum.area))
    values = diagonal_signature(spectrum, HeatKernel(0.01))
    found = np.exp(PLAIN.describe(bumpy))
    for quantile, level in zip(found, LEVELS, strict=True):
        below = spectrum.areas[values < quantile].sum()
        assert below == pytest.approx(level, abs=5e-3)  # the area of some vertices


def test_a_centre_moves_all_quantiles_alike(bumpy: Solution) -> None:
    plain = PLAIN.describe(bumpy)
    for centre in ("mean", "log-mean"):
        moved = plain - replace(PLAIN, centre=centre).describe(bumpy)
        assert_allclose(moved, moved[0], atol=1e-5)
        assert abs(moved[0]) > 0.1


def test_the_mean_of_a_wave_signature_is_the_sum_over_the_spectrum(bumpy: Solution) -> None:
    # mean φ² = 1 at area 1: the centre divides by Σ K², as Aubry and others do
    wave = replace(PLAIN, kernel=WaveKernel(4.0))
    spectrum = bumpy.spectrum.rescaled(1.0 / np.sqrt(bumpy.spectrum.area))
    total = np.log(WaveKernel(4.0).squared_transfer(spectrum.eigenvalues).sum())
    difference = wave.describe(bumpy) - replace(wave, centre="mean").describe(bumpy)
    assert_allclose(difference, total, rtol=1e-5)


def test_a_scaled_copy_differs_in_its_area_alone() -> None:
    mesh = bumpy_sphere(3)
    solutions = [
        Solution(one, compute_spectrum(one, n_eigenpairs=40)) for one in (mesh, scaled(mesh, 3.0))
    ]
    for channel in (PLAIN, EVEN, replace(EVEN, normalisation="first-eigenvalue")):
        one, other = (channel.describe(solution) for solution in solutions)
        assert_allclose(one, other, atol=1e-6)
    one, other = (SIZE.describe(solution) for solution in solutions)
    assert_allclose(other - one, 2.0 * np.log(3.0), rtol=1e-6)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(InvalidRequestError, match="no centre 'median'"):
        replace(PLAIN, centre="median")
    with pytest.raises(InvalidRequestError, match="centre is 'mean'"):
        channel_from_json({**PLAIN.to_json(), "feature": "diagonal-distribution", "centre": "mean"})
    with pytest.raises(InvalidRequestError, match="kernel is"):
        channel_from_json({**SIZE.to_json(), "kernel": PLAIN.to_json()["kernel"]})


def test_centres_survive_json() -> None:
    for channel in (PLAIN, EVEN, SIZE):
        assert channel_from_json(channel.to_json()) == channel
