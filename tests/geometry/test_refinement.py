"""Refinement gives the vertices asked for and leaves the surface what it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import box, cylinder, icosphere, rectangle, subdivided, torus, union
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.refinement import refine, split_long_edges
from workers.geometry.simplification import simplify
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


@pytest.mark.parametrize("mesh", [box(2.0, 1.0, 0.5), rectangle(2, 3), torus(12, 6)])
def test_long_edges_are_halved_and_the_surface_stays(mesh: TriangleMesh) -> None:
    finer = split_long_edges(mesh, longest=0.3, most=10_000)
    assert edge_lengths(finer.vertices, undirected_edges(finer)).max() <= 0.3
    assert finer.area == pytest.approx(mesh.area)
    assert euler_characteristic(finer) == euler_characteristic(mesh)
    assert len(boundary_loops(finer)) == len(boundary_loops(mesh))
    assert np.array_equal(finer.vertices[: mesh.n_vertices], mesh.vertices)


def test_faces_keep_their_winding_when_edges_are_halved() -> None:
    finer = split_long_edges(box(2.0, 1.0, 0.5), longest=0.4, most=10_000)
    outwards = finer.vertices[finer.faces].mean(axis=1) - finer.vertices.mean(axis=0)
    assert ((finer.face_normals * outwards).sum(axis=1) > 0.0).all()


def test_the_longest_edges_are_halved_where_few_vertices_may_be_added() -> None:
    sheet = rectangle(3, 3, 4.0, 1.0)
    finer = split_long_edges(sheet, longest=0.1, most=7)
    assert finer.n_vertices == sheet.n_vertices + 7
    long, short = (edge_lengths(m.vertices, undirected_edges(m)).max() for m in (sheet, finer))
    assert short < long


def test_a_mesh_without_long_edges_is_returned_as_it_is() -> None:
    mesh = icosphere(2)
    assert split_long_edges(mesh, longest=1.0, most=100) is mesh
    assert split_long_edges(mesh, longest=0.1, most=0) is mesh


def test_flat_pieces_of_a_simplified_box_have_vertices_for_its_functions() -> None:
    fine = subdivided(box(1.0, 0.7, 0.3), 6)
    coarse = simplify(fine, vertices=2500).mesh
    assert coarse.n_vertices <= 1.25 * 2500
    own = first_eigenvalues(coarse, 30) * coarse.area
    assert own == pytest.approx(first_eigenvalues(fine, 30) * fine.area, rel=0.04)
