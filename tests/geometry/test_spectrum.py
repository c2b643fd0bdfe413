"""The spectrum against closed forms, and what position, unit and numbering may not change."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import floats
from numpy.testing import assert_allclose

from tests.meshes import (
    bent_rectangle,
    box,
    bumpy_sphere,
    cylinder,
    flat_torus_corners,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    single_triangle,
    subdivided,
    tetrahedron,
    torus,
    translated,
    union,
)
from workers.errors import InvalidMeshError, InvalidRequestError
from workers.geometry.arrays import FloatArray
from workers.geometry.laplacian import cotangent_laplacian, mesh_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import (
    Spectrum,
    compute_spectrum,
    eigenfunction,
    first_eigenvalues,
    laplacian_spectrum,
)


def _gram(spectrum: Spectrum) -> FloatArray:
    vectors = spectrum.eigenvectors
    return vectors.T @ (spectrum.areas[:, None] * vectors)


def _smallest(values: FloatArray, count: int) -> FloatArray:
    """The smallest of the values, without the zero."""
    return np.sort(values.ravel())[1 : count + 1]


def test_sphere_eigenvalues_are_l_times_l_plus_one() -> None:
    values = compute_spectrum(icosphere(4), n_eigenpairs=24).eigenvalues
    exact = np.repeat([2.0, 6.0, 12.0, 20.0], [3, 5, 7, 9])
    assert_allclose(values, exact, rtol=7e-3)  # discretisation error of 2,562 vertices


def test_sphere_eigenvalues_converge_with_the_square_of_the_edge_length() -> None:
    exact = np.repeat([2.0, 6.0, 12.0], [3, 5, 7])
    coarse, fine = (
        np.abs(compute_spectrum(icosphere(s), n_eigenpairs=15).eigenvalues - exact).max()
        for s in (2, 3)
    )
    assert 3.0 < coarse / fine < 5.0


def test_flat_torus_has_the_eigenvalues_of_its_lattice() -> None:
    laplacian = cotangent_laplacian(*flat_torus_corners(60, 50, 3.0, 2.0))
    spectrum = laplacian_spectrum(laplacian, n_eigenpairs=60)
    p, q = np.meshgrid(np.arange(60), np.arange(50), indexing="ij")
    # the five-point scheme that these right triangles are, exactly, and its continuous limit
    grid = 400 * 2 * (1 - np.cos(2 * np.pi * p / 60)) + 625 * 2 * (1 - np.cos(2 * np.pi * q / 50))
    assert_allclose(spectrum.eigenvalues, _smallest(grid, 60), rtol=1e-9)
    p, q = np.meshgrid(np.arange(-9, 10), np.arange(-9, 10), indexing="ij")
    exact = 4 * np.pi**2 * (p**2 / 9.0 + q**2 / 4.0)
    assert_allclose(spectrum.eigenvalues[:12], _smallest(exact, 12), rtol=1e-2)


def test_rectangle_has_neumann_eigenvalues() -> None:
    mesh = rectangle(60, 40, 3.0, 2.0)
    values = compute_spectrum(mesh, n_eigenpairs=40).eigenvalues
    p, q = np.meshgrid(np.arange(12), np.arange(12), indexing="ij")
    exact = _smallest(np.pi**2 * (p**2 / 9.0 + q**2 / 4.0), 40)
    assert_allclose(values, exact, rtol=1.5e-2)
    assert_allclose(values[:3], exact[:3], rtol=1e-3)


def test_open_cylinder_has_the_eigenvalues_of_circle_and_segment() -> None:
    values = compute_spectrum(cylinder(90, 40, 1.0, 2.0), n_eigenpairs=15).eigenvalues
    m, q = np.meshgrid(np.arange(-6, 7), np.arange(6), indexing="ij")
    exact = _smallest(m**2 + (np.pi * q / 2.0) ** 2, 15)
    assert_allclose(values, exact, rtol=1e-2)


def test_regular_tetrahedron_is_solved_in_closed_form() -> None:
    spectrum = compute_spectrum(tetrahedron(2.0))
    assert_allclose(spectrum.eigenvalues, [16.0 / 3.0 / 4.0] * 3, rtol=1e-13)


def test_single_triangle_is_solved_in_closed_form() -> None:
    spectrum = compute_spectrum(single_triangle())
    assert_allclose(spectrum.eigenvalues, [3.0, 9.0], rtol=1e-13)  # of 6 W


@pytest.mark.parametrize(
    "mesh",
    [bumpy_sphere(4), icosphere(3), rectangle(40, 30), torus(50, 30), box(), single_triangle()],
)
def test_eigenvectors_are_area_orthonormal_and_without_mean(mesh: TriangleMesh) -> None:
    spectrum = compute_spectrum(mesh)
    assert spectrum.n_eigenpairs == min(100, mesh.n_vertices - 1)
    assert_allclose(_gram(spectrum), np.eye(spectrum.n_eigenpairs), atol=1e-11)
    mean = spectrum.areas @ spectrum.eigenvectors / np.sqrt(spectrum.area)
    assert_allclose(mean, 0.0, atol=1e-11)
    assert_allclose(spectrum.area, mesh.area, rtol=1e-12)


def test_every_eigenpair_solves_the_equation() -> None:
    mesh = bumpy_sphere(4)
    laplacian, spectrum = mesh_laplacian(mesh), compute_spectrum(mesh)
    left = laplacian.stiffness @ spectrum.eigenvectors
    right = spectrum.areas[:, None] * spectrum.eigenvectors * spectrum.eigenvalues
    error = np.linalg.norm(left - right, axis=0) / np.linalg.norm(right, axis=0)
    assert np.all(error < 1e-8)


@settings(max_examples=10, deadline=None)
@given(exponent=floats(-7.0, 7.0))
def test_unit_changes_eigenvalues_by_its_square_and_nothing_else(exponent: float) -> None:
    mesh, factor = bumpy_sphere(3), 10.0**exponent
    plain = compute_spectrum(mesh, n_eigenpairs=30).rescaled(factor)
    other = compute_spectrum(scaled(mesh, factor), n_eigenpairs=30)
    assert_allclose(other.eigenvalues, plain.eigenvalues, rtol=1e-8)
    assert_allclose(other.areas, plain.areas, rtol=1e-8)
    assert_allclose(other.area, plain.area, rtol=1e-8)
    heat_kernel = [  # k(x,x), which no choice of basis can change
        (s.eigenvectors**2) @ np.exp(-0.05 * s.area * s.eigenvalues) * s.area
        for s in (plain, other)
    ]
    assert_allclose(heat_kernel[1], heat_kernel[0], rtol=1e-8)


def test_rotation_translation_and_numbering_do_not_change_the_spectrum() -> None:
    rng = np.random.default_rng(3)
    mesh = bumpy_sphere(4)
    moved, order = renumbered(translated(rotated(mesh, rng), (3.0, -1.0, 2.0)), rng)
    plain, other = compute_spectrum(mesh), compute_spectrum(moved)
    assert_allclose(other.eigenvalues, plain.eigenvalues, rtol=1e-9)
    commute_time = [(s.eigenvectors**2) @ (1.0 / s.eigenvalues) for s in (plain, other)]
    assert_allclose(commute_time[1], commute_time[0][order], rtol=1e-8)


def test_bending_without_stretching_does_not_change_the_spectrum() -> None:
    flat = compute_spectrum(rectangle(40, 20, 2.0, 1.0), n_eigenpairs=50)
    bent = compute_spectrum(bent_rectangle(40, 20, 2.0, 1.0, angle=4.0), n_eigenpairs=50)
    assert_allclose(bent.eigenvalues, flat.eigenvalues, rtol=1e-9)


def test_components_are_merged_exactly() -> None:
    parts = [bumpy_sphere(3), scaled(torus(40, 20), 0.7), scaled(icosphere(2), 0.2), box()]
    whole = compute_spectrum(union(*parts), n_eigenpairs=100)
    apart = np.concatenate([compute_spectrum(part).eigenvalues for part in parts])
    assert_allclose(whole.eigenvalues, np.sort(apart)[:100], rtol=1e-9)
    assert_allclose(_gram(whole), np.eye(100), atol=1e-11)


def test_every_component_has_its_zero_dropped() -> None:
    parts = [scaled(tetrahedron(), size) for size in (1.0, 2.0, 3.0)]
    spectrum = compute_spectrum(union(*parts))
    assert spectrum.n_eigenpairs == 12 - 3
    exact = np.repeat(16.0 / 3.0 / np.array([9.0, 4.0, 1.0]), 3)
    assert_allclose(spectrum.eigenvalues, exact, rtol=1e-12)


@pytest.mark.parametrize("subdivisions", [1, 3])
def test_sixty_equal_components_each_give_their_share(subdivisions: int) -> None:
    # 42 and 642 vertices each: the dense and the sparse way; 180 equal eigenvalues
    one = icosphere(subdivisions)
    sixty = union(*[translated(one, (3.0 * i, 0.0, 0.0)) for i in range(60)])
    spectrum = compute_spectrum(sixty, n_eigenpairs=200)
    exact = compute_spectrum(one, n_eigenpairs=4).eigenvalues
    assert_allclose(spectrum.eigenvalues, np.repeat(exact, [60, 60, 60, 20]), rtol=1e-9)
    assert_allclose(_gram(spectrum), np.eye(200), atol=1e-11)


def test_a_component_too_small_for_an_eigenvalue_keeps_its_zeros() -> None:
    spectrum = compute_spectrum(
        union(icosphere(3), translated(scaled(tetrahedron(), 0.01), (5, 0, 0))), n_eigenpairs=20
    )
    assert_allclose(spectrum.eigenvectors[-4:], 0.0)
    assert_allclose(
        spectrum.eigenvalues, compute_spectrum(icosphere(3), n_eigenpairs=20).eigenvalues
    )


def test_an_edge_with_three_faces_is_no_obstacle() -> None:
    # Three half planes around a line: even functions are those of a half plane with Neumann
    # conditions; the two odd families vanish on the line.
    page = rectangle(40, 20, 2.0, 1.0)
    shared = page.vertices[:, 1] == 0.0
    n_shared, n = int(shared.sum()), page.n_vertices
    vertices, faces = [page.vertices], [page.faces]
    for i, angle in enumerate((2.0, 4.0)):
        turned = page.vertices[~shared] * [1.0, 0.0, 0.0]
        turned[:, 1] = np.cos(angle) * page.vertices[~shared, 1]
        turned[:, 2] = np.sin(angle) * page.vertices[~shared, 1]
        vertices.append(turned)
        offset = (i + 1) * (n - n_shared)
        faces.append(np.where(page.faces < n_shared, page.faces, page.faces + offset))
    book = TriangleMesh(np.concatenate(vertices), np.concatenate(faces))
    values = compute_spectrum(book, n_eigenpairs=12).eigenvalues
    p, q = np.meshgrid(np.arange(9), np.arange(9), indexing="ij")
    even = np.pi**2 * (p**2 / 4.0 + q**2)
    odd = np.pi**2 * (p**2 / 4.0 + (q + 0.5) ** 2)
    exact = _smallest(np.concatenate([even, odd, odd]), 12)
    assert_allclose(values, exact, rtol=1e-2)


def test_a_coarse_box_has_all_the_eigenpairs_there_are() -> None:
    assert compute_spectrum(box()).n_eigenpairs == 7
    assert compute_spectrum(subdivided(box(), 2)).n_eigenpairs == 97


def test_first_eigenvalues_are_those_of_the_spectrum() -> None:
    mesh = bumpy_sphere(3)
    assert_allclose(first_eigenvalues(mesh, 6), compute_spectrum(mesh).eigenvalues[:6], rtol=1e-10)


@pytest.mark.parametrize("mesh", [bumpy_sphere(2), rectangle(12, 7, 3.0, 1.0)])
def test_the_sign_of_an_eigenfunction_does_not_depend_on_the_solvers(mesh: TriangleMesh) -> None:
    spectrum = compute_spectrum(mesh, n_eigenpairs=12)
    rng = np.random.default_rng(3)
    noise = 1e-9 * rng.normal(size=spectrum.eigenvectors.shape)  # what another machine may add
    other = replace(spectrum, eigenvectors=noise - spectrum.eigenvectors)
    for number in range(1, 13):
        values = eigenfunction(spectrum, number)
        assert_allclose(np.abs(values), np.abs(spectrum.eigenvectors[:, number - 1]))
        assert_allclose(eigenfunction(other, number), values, atol=1e-7)


@pytest.mark.parametrize("number", [-1, 0, 4])
def test_an_eigenfunction_that_there_is_not_is_refused(number: int) -> None:
    with pytest.raises(InvalidRequestError, match="has 3 of them"):
        eigenfunction(compute_spectrum(tetrahedron()), number)


def test_arrays_cannot_be_written_to() -> None:
    spectrum = compute_spectrum(tetrahedron())
    for array in (spectrum.eigenvalues, spectrum.eigenvectors, spectrum.areas):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_nonsense_is_refused_by_name() -> None:
    with pytest.raises(InvalidRequestError, match="at least 1"):
        compute_spectrum(tetrahedron(), n_eigenpairs=0)
    with pytest.raises(InvalidRequestError, match="expected a number > 0"):
        compute_spectrum(tetrahedron()).rescaled(0.0)
    soup = TriangleMesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))
    with pytest.raises(InvalidMeshError, match="no area"):
        compute_spectrum(soup)
