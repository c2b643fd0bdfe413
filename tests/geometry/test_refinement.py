"""Refinement gives the vertices asked for and leaves the surface what it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import box, cylinder, rectangle, subdivided, torus, union
from workers.geometry.mesh import TriangleMesh
from workers.geometry.refinement import refine
from workers.geometry.spectrum import first_eigenvalues
from workers.geometry.topology import boundary_loops, count_components, euler_characteristic


@pytest.mark.parametrize(
    "mesh", [box(1, 2, 3), torus(5, 4), cylinder(5, 2), union(box(), rectangle(2, 1))]
)
def test_the_surface_stays_what_it_is(mesh: TriangleMesh) -> None:
    fine = refine(mesh, vertices=500)
    assert 500 <= fine.n_vertices < 2100
    assert_allclose(fine.area, mesh.area)
    assert euler_characteristic(fine) == euler_characteristic(mesh)
    assert count_components(fine) == count_components(mesh)
    assert len(boundary_loops(fine)) == len(boundary_loops(mesh))
    assert_array_equal(fine.vertices[: mesh.n_vertices], mesh.vertices)
    signs = np.repeat(mesh.face_normals, fine.n_faces // mesh.n_faces, axis=0) * fine.face_normals
    assert (signs.sum(axis=1) > 0).all()  # every face keeps its winding


def test_it_is_the_midpoint_subdivision() -> None:
    fine, expected = refine(box(), vertices=9), subdivided(box())
    assert_allclose(np.sort(fine.vertices, axis=0), np.sort(expected.vertices, axis=0))
    assert fine.n_faces == expected.n_faces


def test_enough_is_enough() -> None:
    mesh = torus(8, 8)
    assert refine(mesh, vertices=64) is mesh


def test_a_coarse_rectangle_becomes_searchable() -> None:
    fine = refine(rectangle(1, 1, 2.0, 1.0), vertices=1000)
    exact = np.pi**2 * np.array([0.25, 1.0, 1.0, 1.25, 2.0, 2.25])
    assert_allclose(first_eigenvalues(fine, 6), exact, rtol=1e-2)  # discretisation error
