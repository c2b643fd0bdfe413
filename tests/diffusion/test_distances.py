"""Diffusion distances: closed forms on the sphere, units, and the axioms of a metric."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.distance import squareform

from workers.diffusion.distances import (
    diagonal_signature,
    diffusion_map,
    pairwise_diffusion_distances,
)
from workers.diffusion.kernels import (
    BiharmonicKernel,
    CommuteTimeKernel,
    HeatKernel,
    Kernel,
    TabulatedKernel,
    evaluate,
)
from workers.errors import KernelDomainError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import Spectrum

Solved = tuple[TriangleMesh, Spectrum]
KERNELS = [HeatKernel(0.15), CommuteTimeKernel(), BiharmonicKernel()]
SAMPLE = np.arange(0, 640, 16)


def diffusion_distances(spectrum: Spectrum, kernel: Kernel, sample: IntArray) -> FloatArray:
    """Distances as a matrix (s, s)."""
    once = pairwise_diffusion_distances(spectrum, kernel, sample)
    matrix: FloatArray = squareform(once).reshape(len(sample), len(sample))
    return matrix


@pytest.mark.parametrize("kernel", KERNELS)
def test_sphere_distances_follow_the_addition_theorem(sphere: Solved, kernel: Kernel) -> None:
    mesh, spectrum = sphere
    degrees = np.arange(1, 7)
    share = (2 * degrees + 1) / (4 * np.pi) * evaluate(kernel, degrees * (degrees + 1.0))  # (6,)
    sample = np.arange(0, 2560, 64)
    points = mesh.vertices[sample]
    cosines = np.clip(points @ points.T, -1.0, 1.0)
    correlation = legendre.legval(cosines, np.concatenate([[0.0], share]))
    expected = 2.0 * (share.sum() - correlation)
    found = np.square(diffusion_distances(spectrum, kernel, sample))
    # eigenfunctions of this mesh are 0.5 % off; relative to the largest distance
    assert_allclose(found, expected, atol=1e-2 * expected.max())
    assert_allclose(diagonal_signature(spectrum, kernel), share.sum(), rtol=1.5e-2)


@pytest.mark.parametrize("kernel", KERNELS)
def test_distances_are_the_sum_of_equation_four(bumpy: Solved, kernel: Kernel) -> None:
    _, spectrum = bumpy
    i, j = 3, 500
    transfer = kernel.squared_transfer(spectrum.eigenvalues)
    difference = spectrum.eigenvectors[i] - spectrum.eigenvectors[j]
    expected = sum(k * d * d for k, d in zip(transfer, difference, strict=True))
    found = np.square(diffusion_distances(spectrum, kernel, np.array([i, j])))
    assert_allclose(found, [[0.0, expected], [expected, 0.0]], rtol=1e-12)


@pytest.mark.parametrize("kernel", KERNELS)
def test_distances_are_a_metric(bumpy: Solved, kernel: Kernel) -> None:
    distances = diffusion_distances(bumpy[1], kernel, SAMPLE)  # (s, s)
    assert_array_equal(distances, distances.T)
    assert_array_equal(np.diag(distances), 0.0)
    assert np.all(distances[~np.eye(len(SAMPLE), dtype=bool)] > 0.0)
    detours = distances[:, :, None] + distances[None, :, :]  # (s, s, s): i to j to l
    assert np.all(distances <= detours.min(axis=1) + 1e-12)


def test_the_diffusion_map_embeds_the_distances(bumpy: Solved) -> None:
    coordinates = diffusion_map(bumpy[1], CommuteTimeKernel(), SAMPLE)
    gaps = np.linalg.norm(coordinates[:, None] - coordinates[None], axis=2)
    assert_allclose(gaps, diffusion_distances(bumpy[1], CommuteTimeKernel(), SAMPLE), atol=1e-12)


@pytest.mark.parametrize(
    ("kernel", "power", "scaled_kernel"),
    [
        (CommuteTimeKernel(), 0, CommuteTimeKernel()),
        (BiharmonicKernel(), 1, BiharmonicKernel()),
        (HeatKernel(0.15), -1, HeatKernel(0.15 * 2.5**2)),
    ],
)
def test_distances_scale_with_their_unit(
    bumpy: Solved, kernel: Kernel, power: int, scaled_kernel: Kernel
) -> None:
    _, spectrum = bumpy
    before = diffusion_distances(spectrum, kernel, SAMPLE)
    after = diffusion_distances(spectrum.rescaled(2.5), scaled_kernel, SAMPLE)
    assert_allclose(after, 2.5**power * before, rtol=1e-12)


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_diagonal_integrates_to_the_trace(bumpy: Solved, kernel: Kernel) -> None:
    _, spectrum = bumpy
    trace = evaluate(kernel, spectrum.eigenvalues).sum()
    integral = float(spectrum.areas @ diagonal_signature(spectrum, kernel))
    assert integral == pytest.approx(trace, rel=1e-9)


def test_distance_and_diagonal_belong_together(bumpy: Solved) -> None:
    # d²(x,y) = k(x,x) + k(y,y) - 2 k(x,y), with K² in every term
    _, spectrum = bumpy
    kernel = HeatKernel(0.1)
    diagonal = diagonal_signature(spectrum, kernel)[SAMPLE]
    phi = spectrum.eigenvectors[SAMPLE]
    cross = (phi * evaluate(kernel, spectrum.eigenvalues)) @ phi.T
    expected = diagonal[:, None] + diagonal[None] - 2.0 * cross
    found = np.square(diffusion_distances(spectrum, kernel, SAMPLE))
    assert_allclose(found, expected, atol=1e-10 * diagonal.max())


def test_a_kernel_that_ends_below_the_spectrum_is_an_error(bumpy: Solved) -> None:
    short = TabulatedKernel(np.array([1e-3, 1.0]), np.array([1.0, 1.0]))
    with pytest.raises(KernelDomainError):
        diffusion_distances(bumpy[1], short, SAMPLE)
    with pytest.raises(KernelDomainError):
        diagonal_signature(bumpy[1], short)


def test_one_point_has_one_distance(bumpy: Solved) -> None:
    assert_array_equal(diffusion_distances(bumpy[1], HeatKernel(0.1), np.array([7])), [[0.0]])
