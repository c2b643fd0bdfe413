"""Channels: what they describe, which scale they forget, and what they refuse."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import icosphere, renumbered, rotated, scaled
from workers.diffusion.distances import diagonal_signature
from workers.diffusion.kernels import BiharmonicKernel, CommuteTimeKernel, HeatKernel
from workers.errors import InvalidRequestError, KernelDomainError, SpectrumError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.sampling import sample_surface
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum, compute_spectrum
from workers.retrieval.channels import (
    Channel,
    DiagonalChannel,
    DistanceChannel,
    EigenvalueChannel,
    Histogram,
    Quantiles,
    channel_from_json,
)
from workers.retrieval.channels.normalisation import normalised_spectrum

EDGES = Histogram(tuple(np.linspace(0.0, 4.0, 41).tolist()))
COMMUTE = DistanceChannel(
    name="c", view="closed", kernel=CommuteTimeKernel(), summary=EDGES, samples=200
)
HEAT = replace(COMMUTE, kernel=HeatKernel(0.15), normalisation="first-eigenvalue")
SHORT_EDGES = Histogram(tuple(np.linspace(0.0, 0.6, 41).tolist()))
BIHARMONIC = replace(COMMUTE, kernel=BiharmonicKernel(), normalisation="area", summary=SHORT_EDGES)
MEAN = replace(COMMUTE, kernel=BiharmonicKernel(), normalisation="mean")
QUANTILES = replace(COMMUTE, summary=Quantiles((0.1, 0.5, 0.9)))
DIAGONALS = DiagonalChannel(
    name="d",
    view="closed",
    kernel=HeatKernel(0.15),
    normalisation="first-eigenvalue",
    summary=SHORT_EDGES,
)
SHAPE_DNA = EigenvalueChannel(
    name="e", view="closed", normalisation="area", numbers=tuple(range(1, 9))
)
SCALE_FREE: list[Channel] = [COMMUTE, HEAT, BIHARMONIC, MEAN, QUANTILES, DIAGONALS, SHAPE_DNA]


def solve(mesh: TriangleMesh) -> Solution:
    return Solution(mesh, compute_spectrum(mesh, n_eigenpairs=60))


@pytest.mark.parametrize("channel", [COMMUTE, HEAT, BIHARMONIC, MEAN, DIAGONALS])
def test_distributions_sum_to_one(bumpy: Solution, channel: Channel) -> None:
    vector = channel.describe(bumpy)
    assert vector.dtype == np.float32
    assert vector.shape == (channel.dimension,)
    assert np.all(vector >= 0.0)
    assert vector.sum() == pytest.approx(1.0, abs=1e-6)
    assert np.count_nonzero(vector) > 5  # not all in one bin


DISGUISES: dict[str, Callable[[TriangleMesh], TriangleMesh]] = {
    "larger": lambda mesh: scaled(mesh, 250.0),
    "smaller": lambda mesh: scaled(mesh, 1e-3),
    "rotated": lambda mesh: rotated(mesh, np.random.default_rng(0)),
    "renumbered": lambda mesh: renumbered(mesh, np.random.default_rng(1))[0],
}


@pytest.mark.parametrize("disguise", sorted(DISGUISES))
@pytest.mark.parametrize("channel", SCALE_FREE)
def test_a_disguised_copy_has_the_same_vector(
    bumpy: Solution, channel: Channel, disguise: str
) -> None:
    vector = channel.describe(bumpy)
    copy = channel.describe(solve(DISGUISES[disguise](bumpy.mesh)))
    assert_allclose(copy, vector, rtol=1e-5, atol=1e-6)  # float32, and rounding in the solver


@pytest.mark.parametrize(
    "channel", [replace(BIHARMONIC, normalisation="none"), replace(SHAPE_DNA, normalisation="none")]
)
def test_without_normalisation_scale_is_kept(bumpy: Solution, channel: Channel) -> None:
    copy = Solution(scaled(bumpy.mesh, 2.0), bumpy.spectrum.rescaled(2.0))
    larger = channel.describe(copy)
    assert np.abs(larger - channel.describe(bumpy)).sum() > 0.5


@pytest.mark.parametrize(
    ("normalisation", "quantity"),
    [("area", lambda s: s.area), ("first-eigenvalue", lambda s: s.eigenvalues[0])],
)
def test_normalisation_makes_its_quantity_one(
    bumpy: Solution, normalisation: str, quantity: Callable[[Spectrum], float]
) -> None:
    assert quantity(normalised_spectrum(bumpy.spectrum, normalisation)) == pytest.approx(1.0)


def test_sphere_eigenvalues_at_area_one_are_logarithms_of_four_pi_l_l_plus_one() -> None:
    degrees = np.repeat([1, 2], [3, 5])
    vector = SHAPE_DNA.describe(solve(icosphere(4, radius=3.0)))
    assert_allclose(vector, np.log(4 * np.pi * degrees * (degrees + 1)), atol=5e-3)


def test_mean_normalised_eigenvalues_have_mean_one(bumpy: Solution) -> None:
    vector = replace(SHAPE_DNA, normalisation="mean").describe(bumpy)
    assert np.exp(vector.astype(np.float64)).mean() == pytest.approx(1.0, abs=1e-6)


def test_mean_normalised_distances_have_mean_one(bumpy: Solution) -> None:
    edges = np.linspace(0.0, 6.0, 3001)
    fine = replace(MEAN, summary=Histogram(tuple(edges.tolist())))
    vector = fine.describe(bumpy)
    centres = np.convolve(edges, [0.5, 0.5], mode="valid")
    assert vector.astype(np.float64) @ centres == pytest.approx(1.0, abs=2e-3)  # the bins' width


def test_quantiles_lie_where_the_histogram_says(bumpy: Solution) -> None:
    edges = np.linspace(0.0, 4.0, 2001)
    fine = replace(COMMUTE, summary=Histogram(tuple(edges.tolist())))
    cdf = np.cumsum(fine.describe(bumpy).astype(np.float64))
    quantiles = QUANTILES.describe(bumpy)
    assert_allclose(np.interp(quantiles, edges[1:], cdf), [0.1, 0.5, 0.9], atol=0.01)


def test_the_diagonal_is_taken_of_all_vertices_by_area(bumpy: Solution) -> None:
    spectrum = normalised_spectrum(bumpy.spectrum, "first-eigenvalue")
    values = diagonal_signature(spectrum, HeatKernel(0.15))
    expected, _ = np.histogram(np.minimum(values, 0.599), SHORT_EDGES.edges, weights=spectrum.areas)
    vector = DIAGONALS.describe(bumpy)
    assert_allclose(vector, expected / spectrum.area, atol=1e-6)


def test_a_sample_that_is_there_is_used(bumpy: Solution) -> None:
    plain = COMMUTE.describe(bumpy)
    for count, same in ((COMMUTE.samples, True), (20, False)):
        sample = sample_surface(bumpy.mesh, bumpy.spectrum, count=count)
        given = replace(bumpy, samples={COMMUTE.samples: sample})
        assert np.array_equal(COMMUTE.describe(given), plain) == same


def test_too_few_eigenvalues_are_an_error(bumpy: Solution) -> None:
    channel = replace(SHAPE_DNA, numbers=(1, 61))
    with pytest.raises(SpectrumError, match=r"needs 61 eigenvalues.*642 vertices has 60"):
        channel.describe(bumpy)


@pytest.mark.parametrize("channel", [COMMUTE, HEAT, SHAPE_DNA])
def test_a_mesh_without_eigenpairs_is_an_error(bumpy: Solution, channel: Channel) -> None:
    areas, area = bumpy.spectrum.areas, bumpy.spectrum.area
    empty = Spectrum(np.empty(0), np.empty((642, 0)), areas, area)
    with pytest.raises(SpectrumError, match="has 0"):
        channel.describe(replace(bumpy, spectrum=empty))


def test_a_kernel_that_vanishes_has_no_mean(bumpy: Solution) -> None:
    with pytest.raises(KernelDomainError, match="vanishes"):
        replace(MEAN, kernel=HeatKernel(1e9)).describe(bumpy)


@pytest.mark.parametrize("channel", SCALE_FREE)
def test_json_brings_a_channel_back(channel: Channel) -> None:
    again = channel_from_json(json.loads(json.dumps(channel.to_json())))
    assert again == channel
    assert type(again) is type(channel)
    assert_array_equal(again.widths, channel.widths)


@pytest.mark.parametrize(
    "change",
    [
        {"normalisation": "volume"},
        {"summary": Quantiles((0.5,)), "dissimilarity": "earth-movers"},
        {"dissimilarity": "cosine"},
        {"dissimilarity": "unfound-points"},
        {"scale": 0.0},
        {"scale": float("nan")},
        {"scale": float("inf")},
        {"weight": -1.0},
        {"weight": float("nan")},
        {"samples": 0},
    ],
)
def test_parts_that_do_not_fit_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(InvalidRequestError, match=r"channel 'c'|dissimilarity"):
        replace(COMMUTE, **change)


@pytest.mark.parametrize("edges", [(), (0.0,), (0.0, 1.0, 1.0), (1.0, 0.0)])
def test_edges_ascend(edges: tuple[float, ...]) -> None:
    with pytest.raises(InvalidRequestError, match="at least 2 that ascend"):
        Histogram(edges)


@pytest.mark.parametrize("levels", [(), (0.0, 0.5), (0.5, 1.0)])
def test_levels_of_quantiles_lie_between_0_and_1(levels: tuple[float, ...]) -> None:
    with pytest.raises(InvalidRequestError, match="all in"):
        Quantiles(levels)


@pytest.mark.parametrize("numbers", [(), (0, 1)])
def test_eigenvalues_are_counted_from_1(numbers: tuple[int, ...]) -> None:
    with pytest.raises(InvalidRequestError, match="from 1 on"):
        replace(SHAPE_DNA, numbers=numbers)


@pytest.mark.parametrize(
    ("channel", "change"),
    [
        (COMMUTE, {"feature": "colours"}),
        (COMMUTE, {"kernel": None}),
        (COMMUTE, {"edges": None}),
        (COMMUTE, {"levels": [0.5]}),
        (COMMUTE, {"centre": "mean"}),
        (COMMUTE, {"edges": ["a", "b"]}),
        (SHAPE_DNA, {"kernel": {"kind": "commute-time", "parameters": {}}}),
        (SHAPE_DNA, {"levels": None}),
        (SHAPE_DNA, {"levels": [0.5]}),
        (SHAPE_DNA, {"edges": [0.0, 1.0]}),
    ],
)
def test_json_that_does_not_fit_is_refused(channel: Channel, change: dict[str, Any]) -> None:
    with pytest.raises(InvalidRequestError):
        channel_from_json({**channel.to_json(), **change})


@pytest.mark.parametrize("key", ["name", "view", "feature", "kernel", "dissimilarity", "scale"])
def test_json_with_a_part_missing_is_refused(key: str) -> None:
    content = COMMUTE.to_json()
    del content[key]
    with pytest.raises(InvalidRequestError, match="cannot be read"):
        channel_from_json(content)
