"""Signatures that are computed together are those that each kernel has alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere, rectangle, scaled
from workers.diffusion.bands import MexicanHatKernel, WaveKernel
from workers.diffusion.distances import diagonal_signature
from workers.diffusion.kernels import BiharmonicKernel, HeatKernel, Kernel
from workers.geometry.solution import Part, Solution, united
from workers.geometry.spectrum import compute_spectrum
from workers.retrieval.channels.normalisation import normalised_spectrum, part_spectra
from workers.retrieval.channels.signatures import LOG_FLOOR, Signatures, diagonals

KERNELS: tuple[Kernel, ...] = (
    *(HeatKernel(time) for time in (1e-3, 0.02, 0.5)),
    *(WaveKernel(energy) for energy in (1.0, 3.0, 5.0, 6.0)),
    *(MexicanHatKernel(time) for time in (0.01, 0.1)),
    BiharmonicKernel(),
)
NORMALISATIONS = ("none", "area", "first-eigenvalue", "mean")
NEEDED = [(name, kernel) for name in NORMALISATIONS for kernel in KERNELS]
# Sums of up to 60 products of positive numbers, in another order: some 60 units of the last place.
ROUNDING = 60 * 2.3e-16


@pytest.fixture(scope="module")
def several() -> Solution:
    """Three components, open and closed, the third one small."""
    meshes = (bumpy_sphere(2, seed=1), rectangle(14, 9, 2.0, 1.0), scaled(bumpy_sphere(1), 0.2))
    solutions = [Solution(mesh, compute_spectrum(mesh, n_eigenpairs=40)) for mesh in meshes]
    total = sum(mesh.area for mesh in meshes)
    shares = (0.6, 0.3, 0.1)
    return united(
        [
            Part(one, share, 1.0, total / mesh.area)
            for one, share, mesh in zip(solutions, shares, meshes, strict=True)
        ]
    )


def test_of_a_connected_surface_they_are_those_of_its_scaled_spectrum(bumpy: Solution) -> None:
    signatures = Signatures(bumpy, NEEDED)
    for name, kernel in NEEDED:
        (found,) = signatures.of(name, kernel)
        spectrum = normalised_spectrum(bumpy.spectrum, name)
        values = diagonal_signature(spectrum, kernel)
        order = np.argsort(values, kind="stable")
        assert_allclose(found.values, values[order], rtol=ROUNDING)
        assert_array_equal(found.areas, bumpy.spectrum.areas[order])
        assert_allclose(
            found.logarithms, np.log(values[order] + LOG_FLOOR / spectrum.area), rtol=1e-12
        )


def test_of_several_components_each_has_its_own(several: Solution) -> None:
    signatures = Signatures(several, NEEDED)
    for name, kernel in NEEDED:
        found = signatures.of(name, kernel)
        expected = part_spectra(several.parts, name)
        assert len(found) == len(expected) == 3
        for one, (spectrum, rest) in zip(found, expected, strict=True):
            values = np.sort(diagonal_signature(spectrum, kernel))
            assert_allclose(np.sort(one.values), values, rtol=ROUNDING)
            assert one.area == pytest.approx(spectrum.area, rel=1e-12)
            assert one.rest == rest


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    chosen=st.lists(st.sampled_from(range(len(KERNELS))), min_size=1, max_size=20),
    rows=st.integers(1, 642),
)
def test_bits_do_not_depend_on_what_is_computed_beside(
    bumpy: Solution, chosen: list[int], rows: int
) -> None:
    kernels = [(KERNELS[i], 0.7) for i in chosen]
    together = diagonals(bumpy.spectrum, kernels, np.arange(rows))
    assert together.shape == (len(chosen), rows)
    for values, kernel in zip(together, kernels, strict=True):
        assert_array_equal(values, diagonals(bumpy.spectrum, [kernel], np.arange(rows))[0])


@pytest.mark.parametrize("n", [1, 2, 3, 64, 65, 500])
def test_whatever_the_number_of_vertices_every_one_is_there_once(n: int, bumpy: Solution) -> None:
    # A flat eigenvector ties all of them, and 0 is a value too.
    for vectors in (np.zeros((n, 60)), np.full((n, 60), 1e-3), bumpy.spectrum.eigenvectors[:n]):
        areas = np.arange(1.0, n + 1.0)
        spectrum = type(bumpy.spectrum)(bumpy.spectrum.eigenvalues, vectors, areas, areas.sum())
        solution = Solution(bumpy.mesh, spectrum)
        (found,) = Signatures(solution, [("none", HeatKernel(0.01))]).of("none", HeatKernel(0.01))
        assert_array_equal(np.sort(found.areas), areas)
        assert_allclose(np.sort(found.values), found.values, rtol=1e-12)
