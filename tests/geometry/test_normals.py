"""Normals: outward on a sphere, the diagonal of a cube, and the two orders of adding agree."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere, icosphere, rectangle, tetrahedron
from workers.geometry.arrays import FloatArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.normals import angle_weighted_normals, unit_vectors, vertex_normals


@pytest.mark.parametrize("normals", [vertex_normals, angle_weighted_normals])
def test_normals_of_a_sphere_point_outwards(normals: Callable[[TriangleMesh], FloatArray]) -> None:
    sphere = icosphere(3, radius=2.5)
    assert_allclose(normals(sphere), sphere.vertices / 2.5, atol=0.02)  # edges of 0.15
    corners = tetrahedron().vertices  # by symmetry exactly along the corners
    assert_allclose(normals(tetrahedron()), unit_vectors(corners), atol=1e-15)


def test_weights_by_angle_do_not_see_how_a_side_is_cut() -> None:
    # Three sides of a cube meet at the origin, one of them cut in two. By area that side weighs
    # twice as much, by angle every side counts alike.
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]])
    corner = TriangleMesh(vertices, np.array([[0, 2, 3], [0, 3, 1], [0, 1, 4], [0, 4, 2]]))
    assert_allclose(angle_weighted_normals(corner)[0], np.full(3, 3**-0.5), rtol=1e-15)
    assert_allclose(vertex_normals(corner)[0], np.array([1.0, 1.0, 2.0]) / 6**0.5, rtol=1e-15)


def test_the_order_of_adding_moves_the_last_bits_alone() -> None:
    mesh = bumpy_sphere(3)
    ordered = vertex_normals(mesh, corner_by_corner=True)
    assert_allclose(ordered, vertex_normals(mesh), atol=1e-15)
    assert_allclose(np.linalg.norm(ordered, axis=1), 1.0, rtol=1e-15)


def test_a_flat_surface_has_one_normal_and_a_lone_vertex_none() -> None:
    flat = rectangle(4, 3)
    lone = TriangleMesh(np.concatenate([flat.vertices, [[9.0, 9.0, 9.0]]]), flat.faces)
    for normals in (vertex_normals(lone), angle_weighted_normals(lone)):
        assert_allclose(normals[:-1], np.tile([0.0, 0.0, 1.0], (flat.n_vertices, 1)), atol=1e-15)
        assert_array_equal(normals[-1], 0.0)


def test_vectors_of_no_length_stay_what_they_are() -> None:
    vectors = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    assert_allclose(unit_vectors(vectors), [[0.6, 0.8, 0.0], [0.0, 0.0, 0.0]], rtol=1e-15)
