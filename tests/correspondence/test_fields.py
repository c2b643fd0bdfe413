"""Stretch, bending and precise points against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import (
    bent_rectangle,
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    scaled,
    single_triangle,
)
from workers.correspondence.fields import Images, bending, mean_curvature, stretch
from workers.correspondence.functional_map import nearest_rows
from workers.correspondence.handedness import handedness, orientation
from workers.correspondence.precise import points_on_faces
from workers.correspondence.surface import Surface
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum


def surface(mesh: TriangleMesh, pairs: int = 100) -> Surface:
    return Surface.of(Solution(mesh, compute_spectrum(mesh, n_eigenpairs=pairs)), 64)


def same_vertices(mesh: TriangleMesh) -> Images:
    """The images of a map that takes each vertex to the vertex of its number."""
    faces = np.zeros(mesh.n_vertices, dtype=np.int64)
    weights = np.zeros((mesh.n_vertices, 3))
    for corner in range(3):
        faces[mesh.faces[:, corner]] = np.arange(mesh.n_faces)
    for corner in range(3):
        weights[mesh.faces[faces, corner] == np.arange(mesh.n_vertices), corner] = 1.0
    return Images(faces, weights)


def test_a_scaled_sphere_is_neither_stretched_nor_bent() -> None:
    small, large = surface(icosphere(3)), surface(icosphere(3, 5.0))
    images = same_vertices(small.mesh)
    assert_allclose(stretch(small, large, images, 1.0), 0.0, atol=1e-9)
    assert_allclose(bending(small, large, images, 1.0), 0.0, atol=1e-9)


def test_the_mean_curvature_of_a_sphere_is_one_over_its_radius() -> None:
    sphere = surface(icosphere(4))
    radius = 1.0 / np.sqrt(4.0 * np.pi)  # of area 1
    curvature = mean_curvature(sphere, 0.002)
    assert_allclose(curvature, 1.0 / radius, rtol=0.01)  # of this mesh


def test_the_mean_curvature_of_a_cylinder_is_half_of_one_over_its_radius() -> None:
    tube = cylinder(60, 60, 1.0, 6.0)
    middle = np.abs(tube.vertices[:, 2] - 3.0) < 1.5  # away from the ends
    curvature = mean_curvature(surface(tube), 0.002) / np.sqrt(tube.area)
    assert_allclose(curvature[middle], 0.5, rtol=0.01)


@pytest.mark.parametrize("angle", [0.5, 2.0])
def test_a_rolled_up_plane_is_bent_but_not_stretched(angle: float) -> None:
    flat, bent = rectangle(40, 30, 1.5, 1.0), bent_rectangle(40, 30, 1.5, 1.0, angle=angle)
    one, other = surface(flat), surface(bent)
    images = same_vertices(flat)
    assert_allclose(stretch(one, other, images, 1.0), 0.0, atol=1e-9)
    middle = np.abs(flat.vertices[:, :2] - [0.75, 0.5]).max(axis=1) < 0.25
    found = bending(one, other, images, 1.0)[middle]
    radius = 1.5 / angle
    size = np.sqrt(1.5)
    assert_allclose(np.abs(found), size / (2.0 * radius), rtol=0.02)
    assert len(np.unique(np.sign(found))) == 1


def test_the_side_of_a_plane_that_it_is_rolled_to_gives_the_sign() -> None:
    flat, bent = rectangle(20, 15, 1.5, 1.0), bent_rectangle(20, 15, 1.5, 1.0)
    turned = [TriangleMesh(mesh.vertices, mesh.faces[:, ::-1]) for mesh in (flat, bent)]
    one = bending(surface(flat), surface(bent), same_vertices(flat), 1.0)
    other = bending(surface(turned[0]), surface(turned[1]), same_vertices(turned[0]), 1.0)
    assert_allclose(one, -other, atol=1e-6)


def test_stretch_is_the_logarithm_of_the_ratio_of_areas() -> None:
    flat = rectangle(40, 20, 2.0, 1.0)
    x = flat.vertices[:, 0]
    wider = np.where(x > 1.0, 1.0 + 3.0 * (x - 1.0), x)  # one half three times as wide
    images = same_vertices(flat)
    one = surface(flat)
    other = surface(TriangleMesh(np.column_stack([wider, flat.vertices[:, 1:]]), flat.faces))
    found = stretch(one, other, images, 1.0)
    difference = found[np.isclose(x, 1.8)].mean() - found[np.isclose(x, 0.2)].mean()
    assert_allclose(difference, np.log(3.0), rtol=0.03)
    both_sides = found[np.isclose(x, 0.2)].mean()
    assert_allclose(both_sides, np.log(0.5), atol=0.02)  # of twice the area, a half keeps its own


def test_stretch_does_not_see_the_unit() -> None:
    mesh = bumpy_sphere()
    images = same_vertices(mesh)
    one = stretch(surface(mesh), surface(scaled(mesh, 7.0)), images, 1.0)
    assert_allclose(one, 0.0, atol=1e-9)


def test_points_on_faces_are_found_again() -> None:
    rng = np.random.default_rng(1)
    mesh = bumpy_sphere()
    faces = rng.integers(mesh.n_faces, size=200)
    weights = rng.dirichlet([1.0, 1.0, 1.0], size=200)
    rows = np.einsum("nc,nci->ni", weights, mesh.vertices[mesh.faces[faces]])
    lifted = [np.hstack([one, 0.5 * one, -one]) for one in (rows, mesh.vertices)]
    nearest = nearest_rows(*lifted)
    near = np.any(mesh.faces[faces] == nearest[:, None], axis=1)
    found, where = points_on_faces(lifted[0], lifted[1], mesh, nearest)
    again = np.einsum("nc,nci->ni", where, mesh.vertices[mesh.faces[found]])
    assert near.mean() > 0.9  # the nearest vertex need not be one of the face
    assert_allclose(again[near], rows[near], atol=1e-9)


def test_a_point_outside_goes_to_the_nearest_edge() -> None:
    mesh = single_triangle()
    rows = np.array([[0.5, -1.0, 2.0], [2.0, 2.0, 0.0]])
    found, where = points_on_faces(rows, mesh.vertices, mesh, np.array([0, 1]))
    assert found.tolist() == [0, 0]
    assert_allclose(where, [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5]])


def test_handedness_changes_its_sign_in_a_mirror() -> None:
    mesh = bumpy_sphere()
    mirror = TriangleMesh(mesh.vertices * [1.0, 1.0, -1.0], mesh.faces[:, ::-1])
    one = handedness(surface(mesh), 1.0, is_local=False)
    other = handedness(surface(mirror), 1.0, is_local=False)
    assert_allclose(one, -other, atol=1e-6)
    assert np.abs(one).mean() > 0.1


def test_orientation_is_one_of_a_copy_and_less_one_of_a_mirror() -> None:
    mesh = bumpy_sphere()
    mirror = TriangleMesh(mesh.vertices * [1.0, 1.0, -1.0], mesh.faces[:, ::-1])
    same = np.arange(mesh.n_vertices)
    one = surface(mesh)
    assert orientation(one, one, same) == pytest.approx(1.0)
    assert orientation(one, surface(mirror), same) == pytest.approx(-1.0)


def test_orientation_leaves_out_faces_without_an_image() -> None:
    one = surface(bumpy_sphere())
    images = np.arange(one.mesh.n_vertices)
    around = one.mesh.faces[(one.mesh.faces == 0).any(axis=1)]
    images[around.ravel()] = 0  # a star shrinks to its middle
    assert orientation(one, one, images) == pytest.approx(1.0)
    assert orientation(one, one, np.zeros_like(images)) == 0.0
