"""Fields carried from mesh to mesh: exact where they are linear, close where they are smooth."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import bumpy_sphere, icosphere, rectangle, renumbered, single_triangle, subdivided
from workers.errors import InvalidRequestError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.transfer import closest_barycentric, closest_points, transfer_to_vertices


def test_the_same_mesh_keeps_its_values() -> None:
    rng = np.random.default_rng(0)
    mesh = bumpy_sphere(3)
    values = rng.normal(size=mesh.n_vertices)
    shuffled, order = renumbered(mesh, rng)
    assert_allclose(transfer_to_vertices(mesh, values, shuffled), values[order], atol=1e-12)


def test_linear_functions_arrive_exactly_on_a_finer_mesh() -> None:
    coarse, fine = rectangle(7, 3, 3.0, 2.0), rectangle(31, 23, 3.0, 2.0)
    field = coarse.vertices @ [2.0, -1.0, 0.0] + 4.0
    carried = transfer_to_vertices(coarse, field, fine)
    assert_allclose(carried, fine.vertices @ [2.0, -1.0, 0.0] + 4.0, atol=1e-12)


def test_long_triangles_far_from_their_vertices_are_found() -> None:
    coarse, fine = rectangle(1, 9, 10.0, 1.0), rectangle(40, 27, 10.0, 1.0)
    carried = transfer_to_vertices(coarse, coarse.vertices[:, 0].copy(), fine)
    assert_allclose(carried, fine.vertices[:, 0], atol=1e-12)


def test_the_error_of_a_smooth_function_falls_with_the_square_of_the_edge_length() -> None:
    fine = icosphere(4)
    errors = []
    for subdivisions in (1, 2, 3):
        coarse = icosphere(subdivisions)
        carried = transfer_to_vertices(coarse, coarse.vertices[:, 2] ** 2, fine)
        errors.append(np.abs(carried - fine.vertices[:, 2] ** 2).max())
    assert errors[2] < 1e-2
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


def test_values_stay_within_the_range_of_the_source() -> None:
    rng = np.random.default_rng(1)
    source = bumpy_sphere(2)
    values = rng.uniform(-1.0, 3.0, source.n_vertices)
    noise = 0.05 * rng.normal(size=(source.n_vertices, 3))
    target = subdivided(TriangleMesh(source.vertices + noise, source.faces))
    carried = transfer_to_vertices(source, values, target)
    assert carried.shape == (target.n_vertices,)
    assert values.min() <= carried.min() <= carried.max() <= values.max()


def test_a_single_triangle_can_be_the_source() -> None:
    carried = transfer_to_vertices(single_triangle(), np.array([0.0, 1.0, 2.0]), icosphere(1))
    assert np.all((carried >= 0.0) & (carried <= 2.0))


def test_closest_point_is_nearer_than_any_other_point_of_the_triangle() -> None:
    rng = np.random.default_rng(2)
    corners = rng.normal(size=(200, 3, 3))
    points = 2.0 * rng.normal(size=(200, 3))
    weights = closest_barycentric(points, corners)
    assert np.all(weights >= 0.0)
    assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    closest = np.einsum("pc,pcd->pd", weights, corners)
    # For a convex set: nothing in it lies beyond the plane through its closest point.
    outward = points - closest
    reach = np.einsum("pcd,pd->pc", corners - closest[:, None], outward)
    assert np.all(reach <= 1e-9)


def test_a_field_of_another_mesh_is_refused() -> None:
    with pytest.raises(
        InvalidRequestError, match="shape \\(5,\\), expected one value for each of 3"
    ):
        transfer_to_vertices(single_triangle(), np.zeros(5), icosphere(1))


def test_closest_points_of_points_on_the_surface_are_those_points() -> None:
    rng = np.random.default_rng(1)
    mesh = bumpy_sphere(3)
    faces = rng.integers(mesh.n_faces, size=300)
    weights = rng.dirichlet(np.ones(3), size=300)
    positions = np.einsum("pc,pcd->pd", weights, mesh.vertices[mesh.faces[faces]])
    found = closest_points(mesh, positions)
    assert_allclose(found.interpolate(mesh.vertices), positions, atol=1e-12)
    assert_allclose(found.squared_distances, 0.0, atol=1e-24)


def test_squared_distances_are_those_to_the_surface() -> None:
    mesh = icosphere(4)
    found = closest_points(mesh, 1.5 * mesh.vertices[::7])
    assert_allclose(np.sqrt(found.squared_distances), 0.5, atol=5e-3)  # faces lie inside the sphere
