"""Implicit smoothing: a closed form, invariances, and what it is for."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import (
    bumpy_sphere,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    translated,
    union,
)
from workers.errors import InvalidRequestError
from workers.geometry import smoothing
from workers.geometry.cleaning import without_useless_faces
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.smoothing import (
    fair,
    fair_rough,
    jitter,
    median_angle,
    roughness,
    smooth,
)
from workers.geometry.spectrum import compute_spectrum

TIME = 1e-3
Smoothing = Callable[[TriangleMesh], TriangleMesh]
WAYS = (partial(smooth, time=TIME, steps=2), partial(fair, time=TIME))


def test_a_sphere_shrinks_as_its_coordinates_are_eigenfunctions() -> None:
    # λ = 2 at radius 1, area 4π: each coordinate is divided by 1 + 2 · 4π · t
    sphere = icosphere(4)
    shrunk = smooth(sphere, time=TIME)
    expected = sphere.vertices / (1.0 + 8.0 * np.pi * TIME)
    assert_allclose(shrunk.vertices, expected, atol=5e-4)  # discretisation error of this mesh


def test_noise_goes_and_the_shape_stays() -> None:
    sphere = icosphere(4)
    rng = np.random.default_rng(0)
    noise = 1.0 + 0.03 * rng.normal(size=(sphere.n_vertices, 1))
    noisy = TriangleMesh(sphere.vertices * noise, sphere.faces)
    radii = np.linalg.norm(smooth(noisy, time=TIME).vertices, axis=1)
    assert np.std(radii) < 0.3 * 0.03
    assert radii.mean() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("way", WAYS, ids=["smooth", "fair"])
def test_it_does_not_see_unit_place_or_numbering(way: Smoothing) -> None:
    mesh = bumpy_sphere(3)
    rng = np.random.default_rng(1)
    smoothed = way(mesh)
    assert_allclose(way(scaled(mesh, 1e3)).vertices, 1e3 * smoothed.vertices, rtol=1e-9)
    moved = way(translated(mesh, (5.0, -3.0, 1.0)))
    assert_allclose(moved.vertices, translated(smoothed, (5.0, -3.0, 1.0)).vertices, atol=1e-12)
    turned = way(rotated(mesh, np.random.default_rng(2)))
    assert_allclose(
        turned.vertices, rotated(smoothed, np.random.default_rng(2)).vertices, atol=1e-12
    )
    shuffled, order = renumbered(mesh, rng)
    found = way(shuffled).vertices
    distances = np.linalg.norm(found[:, None] - smoothed.vertices[None], axis=2)
    assert distances.min(axis=1).max() < 1e-12
    assert len(order) == mesh.n_vertices


@pytest.mark.parametrize("way", WAYS, ids=["smooth", "fair"])
@pytest.mark.parametrize("iterations", [1, 2000])  # with one it does not end, and factors are taken
def test_large_meshes_are_solved_by_iteration_to_the_same_end(
    way: Smoothing, iterations: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = bumpy_sphere(3)
    expected = way(mesh)
    monkeypatch.setattr(smoothing, "ITERATIVE_FROM", 0)
    monkeypatch.setattr(smoothing, "MOST_ITERATIONS", iterations)
    assert_allclose(way(mesh).vertices, expected.vertices, atol=1e-10)


def test_fairing_equilateral_triangles_is_a_step_of_smoothing() -> None:
    radii = np.linalg.norm(fair(icosphere(4), time=TIME).vertices, axis=1)  # nearly equilateral
    assert_allclose(radii, 1.0 / (1.0 + 8.0 * np.pi * TIME), rtol=0.01)


def test_fairing_averages_noise_however_large_and_uneven_the_triangles() -> None:
    mesh = uneven_sphere(4, 4.0)
    rng = np.random.default_rng(0)
    noise = 0.1 * rng.normal(size=mesh.vertices.shape)
    noisy = TriangleMesh(mesh.vertices + noise, mesh.faces)
    assert noisy.area > 2.0 * mesh.area
    left, left_by_smoothing = (
        np.sqrt(np.mean((way(noisy).vertices - way(mesh).vertices) ** 2))
        for way in (partial(fair, time=TIME), partial(smooth, time=TIME))
    )
    assert left < 0.5 * 0.1
    assert left < 0.8 * left_by_smoothing


def test_what_is_coarse_beside_something_fine_stays_where_it_is() -> None:
    mesh = uneven_sphere(5, 30.0)
    areas = mesh_laplacian(mesh).areas
    coarse = areas > 100.0 * areas.mean()
    assert coarse.sum() > 10
    moved = np.linalg.norm(fair(mesh, time=3e-4).vertices - mesh.vertices, axis=1)
    assert moved[coarse].max() < 0.05


def uneven_sphere(subdivisions: int, factor: float) -> TriangleMesh:
    """Unit sphere of nearly equilateral triangles: large about one pole, small about the other."""
    x, y, z = icosphere(subdivisions).vertices.T
    plane = factor * (x + 1j * y) / (1.0 - np.minimum(z, 1.0 - 1e-9))  # stereographic projection
    squared = np.abs(plane) ** 2
    vertices = np.stack([2 * plane.real, 2 * plane.imag, squared - 1], axis=1)
    return TriangleMesh(vertices / (squared + 1)[:, None], icosphere(subdivisions).faces)


def test_a_sphere_stays_one_through_many_steps() -> None:
    radii = np.linalg.norm(smooth(icosphere(3), time=0.01, steps=20).vertices, axis=1)
    assert np.ptp(radii) < 0.01 * radii.mean()


def test_fingers_go_before_the_hand() -> None:
    sphere = icosphere(4)
    top = sphere.vertices[:, 2] > 0.99
    spiked = TriangleMesh(sphere.vertices * np.where(top, 2.0, 1.0)[:, None], sphere.faces)
    heights = []
    for steps in (0, 10, 20):
        places = smooth(spiked, time=1e-3, steps=steps).vertices
        heights.append(places[:, 2].max() / np.linalg.norm(places[~top], axis=1).mean())
    assert heights[0] == pytest.approx(2.0, abs=0.01)
    assert heights[0] - 0.1 > heights[1] > 1.3 > heights[2] > 1.0


def test_thin_parts_do_not_tear() -> None:
    thin = TriangleMesh(
        bumpy_sphere(3).vertices * np.array([1.0, 1.0, 0.02]), bumpy_sphere(3).faces
    )
    flowed = smooth(thin, time=3e-3, steps=10)
    assert np.isfinite(flowed.vertices).all()
    assert flowed.area > 0.0


def test_what_shrinks_to_a_point_is_one() -> None:
    """A bubble that hangs on one vertex once left faces that no spectrum could be computed of."""
    sphere = icosphere(3)
    bubble = scaled(icosphere(1), 1e-3)
    at = sphere.vertices[0] - bubble.vertices[0]
    faces = bubble.faces + sphere.n_vertices
    hanging = TriangleMesh(
        np.concatenate([sphere.vertices, bubble.vertices + at]),
        np.concatenate([sphere.faces, np.where(faces == sphere.n_vertices, 0, faces)]),
    )
    alone = smooth(sphere, time=TIME, steps=3)
    smoothed = without_useless_faces(smooth(without_useless_faces(hanging), time=TIME, steps=3))
    assert smoothed.n_faces == sphere.n_faces
    found, expected = (compute_spectrum(m, n_eigenpairs=20) for m in (smoothed, alone))
    assert_allclose(found.eigenvalues, expected.eigenvalues, rtol=1e-4)


def test_nothing_happens_in_no_time() -> None:
    mesh = bumpy_sphere(2)
    assert smooth(mesh, time=0.0) is mesh
    assert smooth(mesh, time=TIME, steps=0) is mesh
    assert fair(mesh, time=0.0) is mesh


@pytest.mark.parametrize("time", [-1e-4, np.nan, np.inf])
def test_times_that_are_none_are_refused(time: float) -> None:
    with pytest.raises(InvalidRequestError, match="smoothing time"):
        smooth(icosphere(1), time=time)
    with pytest.raises(InvalidRequestError, match="smoothing time"):
        fair(icosphere(1), time=time)
    with pytest.raises(InvalidRequestError, match="steps are -1"):
        smooth(icosphere(1), time=TIME, steps=-1)


def cone(n_edges: int) -> TriangleMesh:
    """A cone with so many edges at its tip, open below."""
    angles = np.linspace(0.0, 2.0 * np.pi, n_edges, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(n_edges)], axis=1)
    here = np.arange(1, n_edges + 1)
    faces = np.stack([np.zeros_like(here), here, np.roll(here, -1)], axis=1)
    return TriangleMesh(np.concatenate([[[0.0, 0.0, 1.0]], ring]), faces)


@pytest.mark.parametrize(
    "mesh",
    [
        bumpy_sphere(3),
        union(icosphere(2), translated(scaled(rectangle(20, 10), 1e-2), (5.0, 0.0, 0.0))),
        uneven_sphere(3, 0.05),
        cone(300),  # the sums of rows without the diagonal are as large as they get
    ],
)
def test_roughness_is_that_of_a_faired_surface(mesh: TriangleMesh) -> None:
    noisy = TriangleMesh(
        mesh.vertices + 0.01 * np.random.default_rng(0).normal(size=mesh.vertices.shape), mesh.faces
    )
    faired = fair(noisy, time=smoothing.ROUGHNESS_TIME / mesh.n_vertices)  # by factors
    # float32, in which descriptors are kept, has a step of 4e-9 at 0.05
    assert roughness(noisy) == pytest.approx(np.log(noisy.area / faired.area), abs=1e-10)


def noisy_sphere(levels: int, height: float) -> TriangleMesh:
    """A sphere with normally distributed noise along its radii."""
    sphere = icosphere(levels)
    noise = 1.0 + height * np.random.default_rng(0).normal(size=(sphere.n_vertices, 1))
    return TriangleMesh(sphere.vertices * noise, sphere.faces)


def test_a_fine_noisy_mesh_jitters_and_a_coarse_clean_one_does_not() -> None:
    coarse, noisy = icosphere(2), noisy_sphere(5, 0.002)
    assert median_angle(coarse) > 2.0 * median_angle(noisy)
    assert jitter(coarse) < 1.1
    assert jitter(noisy) > 2.0


@pytest.mark.parametrize("mesh", [bumpy_sphere(3), uneven_sphere(3, 0.05), rectangle(20, 10)])
def test_shapes_do_not_jitter_in_any_unit(mesh: TriangleMesh) -> None:
    assert jitter(mesh) < 1.5
    assert jitter(scaled(mesh, 1e3)) == pytest.approx(jitter(mesh), rel=1e-6)


def test_rounding_of_a_flat_sheet_is_no_noise() -> None:
    flat = rotated(rectangle(20, 10), np.random.default_rng(0))
    rounded = TriangleMesh(flat.vertices.astype(np.float32).astype(np.float64), flat.faces)
    assert 0.0 < median_angle(rounded) < 0.01
    assert jitter(rounded) == pytest.approx(1.0, abs=0.01)


def test_only_what_is_rough_is_faired_as_far_as_it_is_rough() -> None:
    sphere = icosphere(4)
    assert fair_rough(sphere, time=TIME, clean=1.5, rough=3.0) is sphere
    for height, is_whole in ((0.005, False), (0.03, True)):
        noisy = noisy_sphere(4, height)
        expected = min(1.0, (jitter(noisy) - 1.5) / 1.5)
        assert expected > 0.0
        assert (expected == 1.0) == is_whole
        found = fair_rough(noisy, time=TIME, clean=1.5, rough=3.0)
        assert_allclose(found.vertices, fair(noisy, time=expected * TIME).vertices)
        assert median_angle(found) < 0.7 * median_angle(noisy)
