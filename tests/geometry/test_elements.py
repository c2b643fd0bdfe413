"""Cotangents and areas of single triangles, by closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import box, tetrahedron
from workers.geometry.elements import corner_cotangents, double_areas, lumped_areas


@pytest.mark.parametrize("in_order", [False, True])
def test_cotangents_of_the_triangle_of_thirty_sixty_and_ninety_degrees(in_order: bool) -> None:
    corners = np.array([[[0.0, 0.0], [np.sqrt(3.0), 0.0], [0.0, 1.0]]])  # 90°, 30°, 60°
    doubled = double_areas(corners)
    assert_allclose(doubled, [np.sqrt(3.0)], rtol=1e-15)
    cotangents = corner_cotangents(corners, doubled, in_order=in_order)
    assert_allclose(cotangents, [[0.0, np.sqrt(3.0), 1.0 / np.sqrt(3.0)]], atol=1e-15)


def test_the_cotangents_of_a_triangle_obey_their_law() -> None:
    # cot a cot b + cot b cot c + cot c cot a = 1, since the angles sum to π
    corners = np.random.default_rng(0).normal(size=(200, 3, 5))
    a, b, c = corner_cotangents(corners, double_areas(corners)).T
    assert_allclose(a * b + b * c + c * a, 1.0, rtol=1e-8)


@pytest.mark.parametrize("dimension", [2, 3, 7])
def test_areas_do_not_depend_on_the_space_around(dimension: int) -> None:
    flat = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 2.0]])
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(dimension, dimension)))[0]
    corners = np.zeros((1, 3, dimension))
    corners[0, :, :2] = flat
    assert_allclose(double_areas(corners @ turn), [6.0], rtol=1e-14)


@pytest.mark.parametrize("height", [1e-3, 1e-8, 1e-12])
def test_a_needle_keeps_its_area(height: float) -> None:
    corners = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.4, height, 0.0]]])
    for turn in range(3):
        assert_allclose(double_areas(np.roll(corners, turn, axis=1)), [height], rtol=1e-14)


def test_every_corner_gets_a_third_of_its_faces() -> None:
    mesh = tetrahedron(2.0)
    areas = lumped_areas(mesh.faces, mesh.face_areas, mesh.n_vertices + 1)
    assert_allclose(areas, [np.sqrt(3.0)] * 4 + [0.0], rtol=1e-15)
    cuboid = box(1, 2, 3)
    assert_allclose(lumped_areas(cuboid.faces, cuboid.face_areas, 8).sum(), 22.0, rtol=1e-15)
