"""Caps close compact loops, leave ragged ones open, and do not depend on the numbering."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    single_triangle,
    union,
)
from workers.geometry.arrays import FloatArray
from workers.geometry.closing import cap, close_loops, isoperimetric_quotient
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import first_eigenvalues
from workers.geometry.topology import (
    boundary_edges,
    boundary_loops,
    count_components,
    directed_edges,
    euler_characteristic,
)


def polygon(n: int, *, stretch: float = 1.0) -> FloatArray:
    angles = 2 * np.pi * np.arange(n) / n
    return np.stack([stretch * np.cos(angles), np.sin(angles), np.zeros(n)], axis=1)


def without_discs(mesh: TriangleMesh, centres: list[int], radius: float) -> TriangleMesh:
    """The mesh without the faces near some of its vertices."""
    middles = mesh.vertices[mesh.faces].mean(axis=1)  # (m, 3)
    near = [np.linalg.norm(middles - mesh.vertices[c], axis=1) < radius for c in centres]
    faces = mesh.faces[~np.any(near, axis=0)]
    used, inverse = np.unique(faces, return_inverse=True)
    return TriangleMesh(mesh.vertices[used], inverse.reshape(-1, 3))


@pytest.mark.parametrize(
    ("points", "quotient"),
    [
        (polygon(2000), 1.0),
        (polygon(4), np.pi / 4),
        (polygon(3), np.pi / np.sqrt(27)),
        (7.0 * polygon(6) + 5.0, np.pi * np.sqrt(3) / 6),
        (np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 0, 0]]), 0.0),
        (np.zeros((5, 3)), 0.0),
    ],
    ids=["circle", "square", "triangle", "hexagon", "slit", "point"],
)
def test_isoperimetric_quotients(points: FloatArray, quotient: float) -> None:
    assert isoperimetric_quotient(points) == pytest.approx(quotient, abs=1e-5)


@pytest.mark.parametrize("n", [3, 4, 5, 6, 9, 17, 40, 200])
@pytest.mark.parametrize("growth", [1.0, 1.2])
def test_a_cap_is_a_disc_that_fills_its_polygon(n: int, growth: float) -> None:
    points = polygon(n)
    inner, triangles = cap(points, growth=growth)
    mesh = TriangleMesh(np.concatenate([points, inner]), triangles)
    assert euler_characteristic(mesh) == 1
    (loop,) = boundary_loops(mesh)
    assert set(loop.tolist()) == set(range(n))
    assert_allclose(mesh.area, 0.5 * n * np.sin(2 * np.pi / n))
    assert (mesh.face_normals[:, 2] < 0).all()  # wound against the loop, none folded


def test_triangles_of_a_cap_are_as_long_as_the_edges_of_the_loop() -> None:
    points = polygon(60)
    inner, triangles = cap(points)
    vertices = np.concatenate([points, inner])
    a, b = vertices[directed_edges(triangles)].transpose(1, 0, 2)
    ratios = np.linalg.norm(b - a, axis=1) / np.linalg.norm(points[1] - points[0])
    assert ratios.min() > 0.5
    assert ratios.max() < 1.6
    assert len(vertices) == pytest.approx(60**2 / (4 * np.pi) * 2 / np.sqrt(3), rel=0.25)


def test_a_cap_of_growing_triangles_has_a_multiple_of_the_loops_vertices() -> None:
    inner, _ = cap(polygon(5000), growth=1.2)
    assert len(inner) < 5 * 5000


def test_a_cylinder_becomes_a_closed_surface_wound_one_way() -> None:
    tube = cylinder(24, 10)
    closed = close_loops(tube)
    assert len(boundary_edges(closed)) == 0
    assert euler_characteristic(closed) == 2
    edges = directed_edges(closed.faces)
    assert len(np.unique(edges, axis=0)) == len(edges)  # each edge once in each direction
    assert_allclose(closed.area, tube.area + 24 * np.sin(2 * np.pi / 24))
    assert_array_equal(closed.vertices[: tube.n_vertices], tube.vertices)
    assert_array_equal(closed.faces[: tube.n_faces], tube.faces)


def test_long_thin_loops_stay_open() -> None:
    strip = rectangle(60, 1, 60.0, 1.0)  # quotient 4π·60 / 122² = 0.05
    assert close_loops(strip) is strip
    assert len(boundary_edges(close_loops(strip, minimum_quotient=0.04))) == 0


def test_a_closed_mesh_is_returned_as_it_is() -> None:
    mesh = icosphere(1)
    assert close_loops(mesh) is mesh


def test_a_hole_of_one_triangle_gets_it_back() -> None:
    mesh = icosphere(1)
    closed = close_loops(TriangleMesh(mesh.vertices, mesh.faces[1:]))
    assert closed.n_vertices == mesh.n_vertices
    assert {frozenset(f) for f in closed.faces.tolist()} == {
        frozenset(f) for f in mesh.faces.tolist()
    }


def test_a_lone_triangle_is_not_covered_by_its_double() -> None:
    mesh = union(icosphere(1), single_triangle())
    assert close_loops(mesh) is mesh


def test_closing_brings_the_spectrum_back() -> None:
    whole = bumpy_sphere(3)
    holed = without_discs(whole, whole.vertices.argmax(axis=0).tolist(), 0.35)
    assert len(boundary_loops(holed)) == 3
    truth, closed, left_open = (
        first_eigenvalues(mesh, 8) * mesh.area for mesh in (whole, close_loops(holed), holed)
    )
    error_closed = np.abs(closed / truth - 1).max()
    error_open = np.abs(left_open / truth - 1).max()
    assert error_closed < 0.02  # flat caps for domes
    assert error_closed < 0.2 * error_open


def test_renumbered_and_rotated_copies_get_the_same_caps() -> None:
    rng = np.random.default_rng(7)
    holed = without_discs(bumpy_sphere(3), bumpy_sphere(3).vertices.argmax(axis=0).tolist(), 0.35)
    expected = close_loops(holed)
    truth = first_eigenvalues(expected, 12) * expected.area
    for _ in range(3):
        copy, _ = renumbered(scaled(rotated(holed, rng), rng.uniform(0.01, 100)), rng)
        closed = close_loops(copy)
        assert_allclose(first_eigenvalues(closed, 12) * closed.area, truth, rtol=1e-9)


def test_touching_holes_are_closed_each() -> None:
    mesh = rectangle(9, 9)
    centres = (mesh.vertices[mesh.faces].mean(axis=1)[:, :2] * 9).astype(int)
    kept = [tuple(c) not in {(3, 3), (4, 4)} for c in centres.tolist()]
    holed = TriangleMesh(mesh.vertices, mesh.faces[kept])
    closed = close_loops(holed, minimum_quotient=0.1)
    assert len(boundary_edges(closed)) == 0
    assert count_components(closed) == 1
