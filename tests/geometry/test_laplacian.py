"""The cotangent Laplacian: closed forms on single triangles, and what it must always obey."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    box,
    bumpy_sphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    single_triangle,
    tetrahedron,
)
from workers.errors import InvalidMeshError
from workers.geometry.laplacian import cotangent_laplacian, mesh_laplacian
from workers.geometry.mesh import TriangleMesh


def test_right_triangle_has_the_cotangents_zero_one_one() -> None:
    laplacian = mesh_laplacian(single_triangle())
    expected = [[1.0, -0.5, -0.5], [-0.5, 0.5, 0.0], [-0.5, 0.0, 0.5]]
    assert_allclose(laplacian.stiffness.toarray(), expected, atol=1e-15)
    assert_allclose(laplacian.areas, [1 / 6] * 3, rtol=1e-15)


def test_regular_tetrahedron_couples_all_vertices_by_the_cotangent_of_sixty_degrees() -> None:
    stiffness = mesh_laplacian(tetrahedron(2.5)).stiffness.toarray()
    expected = (4.0 * np.eye(4) - np.ones((4, 4))) / np.sqrt(3.0)
    assert_allclose(stiffness, expected, atol=1e-14)


def test_stiffness_is_symmetric_semidefinite_with_rows_that_sum_to_zero() -> None:
    stiffness = mesh_laplacian(bumpy_sphere(2)).stiffness.toarray()
    assert_array_equal(stiffness, stiffness.T)
    assert_allclose(stiffness.sum(axis=1), 0.0, atol=1e-13)
    eigenvalues = np.linalg.eigvalsh(stiffness)
    assert eigenvalues[0] > -1e-13
    assert eigenvalues[1] > 1e-3


def test_areas_sum_to_the_surface_area() -> None:
    assert_allclose(mesh_laplacian(box(1, 2, 3)).areas.sum(), 22.0, rtol=1e-14)


def test_dirichlet_energy_of_a_linear_function_is_its_squared_slope_times_the_area() -> None:
    mesh = rectangle(7, 5, 3.0, 2.0)
    heights = 2.0 * mesh.vertices[:, 0] - 3.0 * mesh.vertices[:, 1]
    stiffness = mesh_laplacian(mesh).stiffness
    assert_allclose(heights @ (stiffness @ heights), (4.0 + 9.0) * 6.0, rtol=1e-13)


def test_linear_functions_are_harmonic_inside_a_flat_surface() -> None:
    mesh = rectangle(7, 5, 3.0, 2.0)
    interior = np.all((mesh.vertices[:, :2] > 0.1) & (mesh.vertices[:, :2] < [2.9, 1.9]), axis=1)
    flow = mesh_laplacian(mesh).stiffness @ mesh.vertices[:, 0]
    assert interior.sum() == 6 * 4
    assert_allclose(flow[interior], 0.0, atol=1e-13)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e6])
def test_stiffness_has_no_unit_and_areas_that_of_area(factor: float) -> None:
    mesh = bumpy_sphere(2)
    plain, other = mesh_laplacian(mesh), mesh_laplacian(scaled(mesh, factor))
    assert_allclose(other.stiffness.toarray(), plain.stiffness.toarray(), rtol=1e-9, atol=1e-12)
    assert_allclose(other.areas, plain.areas * factor**2, rtol=1e-12)


def test_rotation_and_renumbering_do_not_change_the_operator() -> None:
    rng = np.random.default_rng(1)
    mesh = bumpy_sphere(2)
    plain = mesh_laplacian(mesh)
    moved, order = renumbered(rotated(mesh, rng), rng)
    other = mesh_laplacian(moved)
    expected = plain.stiffness.toarray()[np.ix_(order, order)]
    assert_allclose(other.stiffness.toarray(), expected, atol=1e-12)
    assert_allclose(other.areas, plain.areas[order], rtol=1e-12)


@pytest.mark.parametrize("dimension", [2, 4, 7])
def test_any_dimension_gives_the_same_operator(dimension: int) -> None:
    rng = np.random.default_rng(2)
    mesh = rectangle(4, 3, 2.0, 1.0)
    isometry = np.linalg.qr(rng.normal(size=(dimension, 2)))[0].T  # (2, dimension)
    corners = (mesh.vertices[:, :2] @ isometry)[mesh.faces]
    other = cotangent_laplacian(corners, mesh.faces, mesh.n_vertices)
    plain = mesh_laplacian(mesh)
    assert_allclose(other.stiffness.toarray(), plain.stiffness.toarray(), atol=1e-13)
    assert_allclose(other.areas, plain.areas, rtol=1e-13)


@pytest.mark.parametrize("height", [1e-3, 1e-5, 1e-7])
def test_cotangents_of_a_needle_are_exact(height: float) -> None:
    # cot at the base is foot / height; cos / sqrt(1 - cos²) would be off by per cents here.
    corners = np.array([[[0.0, 0.0], [1.0, 0.0], [0.3, height]]])
    stiffness = cotangent_laplacian(corners, np.array([[0, 1, 2]]), 3).stiffness.toarray()
    assert_allclose(stiffness[1, 2], -0.5 * 0.3 / height, rtol=1e-14)
    assert_allclose(stiffness[0, 2], -0.5 * 0.7 / height, rtol=1e-14)
    assert_allclose(stiffness[0, 1], -0.5 * (height - 0.21 / height), rtol=1e-14)


def test_a_face_without_area_is_named() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    mesh = TriangleMesh(vertices, np.array([[0, 1, 2], [0, 1, 3]]))
    with pytest.raises(InvalidMeshError, match="face 1 has no area"):
        mesh_laplacian(mesh)


@pytest.mark.parametrize("position", [np.nan, np.inf, 1e200])
def test_a_position_that_is_not_finite_or_overflows_is_refused(position: float) -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, position, 0]])
    with pytest.raises(InvalidMeshError, match="not finite"):
        mesh_laplacian(TriangleMesh(vertices, np.array([[0, 1, 2]])))


def test_a_vertex_without_a_face_is_named() -> None:
    vertices = np.concatenate([tetrahedron().vertices, [[5.0, 5.0, 5.0]]])
    with pytest.raises(InvalidMeshError, match="vertex 4 belongs to no face"):
        mesh_laplacian(TriangleMesh(vertices, tetrahedron().faces))
