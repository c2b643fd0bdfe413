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
from workers.geometry.closing import cap, close_loops, double, relative_length
from workers.geometry.edges import directed_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import first_eigenvalues
from workers.geometry.topology import (
    boundary_edges,
    boundary_loops,
    count_components,
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


def loops_of(mesh: TriangleMesh) -> list[float]:
    return sorted(relative_length(mesh, loop) for loop in boundary_loops(mesh))


def test_the_length_of_a_loop_has_no_unit_and_no_pose() -> None:
    tube = cylinder(400, 8, radius=2.0, height=5.0)
    expected = (2 * np.pi * 2.0) ** 2 / (2 * np.pi * 2.0 * 5.0)
    assert_allclose(loops_of(tube), [expected] * 2, rtol=1e-4)
    assert_allclose(loops_of(scaled(tube, 0.01)), [expected] * 2, rtol=1e-4)
    flat, rolled = rectangle(40, 20, 2.0, 1.0), rectangle(40, 20, 2.0, 1.0).vertices.copy()
    rolled[:, 2] = np.sin(rolled[:, 0])
    rolled[:, 0] = 1.0 - np.cos(rolled[:, 0])  # bent along an arc: an isometry
    assert_allclose(loops_of(flat), [18.0])
    assert_allclose(loops_of(TriangleMesh(rolled, flat.faces)), [18.0], rtol=1e-3)


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
    closed = close_loops(tube, longest=30.0)
    assert len(boundary_edges(closed)) == 0
    assert euler_characteristic(closed) == 2
    edges = directed_edges(closed.faces)
    assert len(np.unique(edges, axis=0)) == len(edges)  # each edge once in each direction
    assert_allclose(closed.area, tube.area + 24 * np.sin(2 * np.pi / 24))
    assert_array_equal(closed.vertices[: tube.n_vertices], tube.vertices)
    assert_array_equal(closed.faces[: tube.n_faces], tube.faces)


def test_long_thin_loops_stay_open() -> None:
    strip = rectangle(60, 1, 60.0, 1.0)  # p² / A = 122² / 60 = 248
    assert close_loops(strip, longest=30.0) is strip
    assert len(boundary_edges(close_loops(strip, longest=250.0))) == 0


def test_a_closed_mesh_is_returned_as_it_is() -> None:
    mesh = icosphere(1)
    assert close_loops(mesh, longest=30.0) is mesh


def test_a_hole_of_one_triangle_gets_it_back() -> None:
    mesh = icosphere(1)
    closed = close_loops(TriangleMesh(mesh.vertices, mesh.faces[1:]), longest=30.0)
    assert closed.n_vertices == mesh.n_vertices
    assert {frozenset(f) for f in closed.faces.tolist()} == {
        frozenset(f) for f in mesh.faces.tolist()
    }


def test_a_lone_triangle_is_not_covered_by_its_double() -> None:
    mesh = union(icosphere(1), single_triangle())
    assert close_loops(mesh, longest=30.0) is mesh


def test_closing_brings_the_spectrum_back() -> None:
    whole = bumpy_sphere(3)
    holed = without_discs(whole, whole.vertices.argmax(axis=0).tolist(), 0.35)
    assert len(boundary_loops(holed)) == 3
    truth, closed, left_open = (
        first_eigenvalues(mesh, 8) * mesh.area
        for mesh in (whole, close_loops(holed, longest=30.0), holed)
    )
    error_closed = np.abs(closed / truth - 1).max()
    error_open = np.abs(left_open / truth - 1).max()
    assert error_closed < 0.02  # flat caps for domes
    assert error_closed < 0.2 * error_open


def test_renumbered_and_rotated_copies_get_the_same_caps() -> None:
    rng = np.random.default_rng(7)
    holed = without_discs(bumpy_sphere(3), bumpy_sphere(3).vertices.argmax(axis=0).tolist(), 0.35)
    expected = close_loops(holed, longest=30.0)
    truth = first_eigenvalues(expected, 12) * expected.area
    for _ in range(3):
        copy, _ = renumbered(scaled(rotated(holed, rng), rng.uniform(0.01, 100)), rng)
        closed = close_loops(copy, longest=30.0)
        assert_allclose(first_eigenvalues(closed, 12) * closed.area, truth, rtol=1e-9)


def test_touching_holes_are_closed_each() -> None:
    mesh = rectangle(9, 9)
    centres = (mesh.vertices[mesh.faces].mean(axis=1)[:, :2] * 9).astype(int)
    kept = [tuple(c) not in {(3, 3), (4, 4)} for c in centres.tolist()]
    holed = TriangleMesh(mesh.vertices, mesh.faces[kept])
    closed = close_loops(holed, longest=30.0)
    assert len(boundary_edges(closed)) == 0
    assert count_components(closed) == 1


# -- sheets -----------------------------------------------------------------------------------


def test_a_doubled_sheet_is_closed_and_twice_as_large() -> None:
    inner, triangles = cap(polygon(40, stretch=3.0))
    sheet = TriangleMesh(np.concatenate([polygon(40, stretch=3.0), inner]), triangles)
    doubled = double(sheet, longest=0.0)
    assert len(boundary_edges(doubled)) == 0
    assert euler_characteristic(doubled) == 2
    assert_allclose(doubled.area, 2 * sheet.area)
    assert_array_equal(doubled.vertices[: sheet.n_vertices], sheet.vertices)
    assert_array_equal(doubled.faces[: sheet.n_faces], sheet.faces)
    edges = directed_edges(doubled.faces)
    assert len(np.unique(edges, axis=0)) == len(edges)  # wound one way


def test_a_doubled_hemisphere_has_the_spectrum_of_the_sphere() -> None:
    """Even and odd functions alike, where the open half has the even ones alone."""
    sphere = icosphere(4)
    upper = sphere.faces[(sphere.vertices[sphere.faces].mean(axis=1)[:, 2] > 0)]
    used, inverse = np.unique(upper, return_inverse=True)
    half = TriangleMesh(sphere.vertices[used], inverse.reshape(-1, 3))
    truth = first_eigenvalues(sphere, 8) * sphere.area
    doubled = double(half, longest=0.0)
    assert_allclose(first_eigenvalues(doubled, 8) * doubled.area, truth, rtol=0.05)
    left_open = first_eigenvalues(half, 8) * half.area
    assert np.abs(left_open / truth - 1).max() > 0.4


def test_what_has_no_inside_is_not_doubled() -> None:
    mesh = icosphere(1)
    assert double(mesh, longest=0.0) is mesh
    sheet = rectangle(12, 8)
    assert double(sheet, longest=30.0) is sheet  # p² / A = 16
    eared = double(sheet, longest=0.0)  # at two corners a face has all of its corners on the rim
    assert eared.n_faces == 2 * sheet.n_faces - 2
    assert len(boundary_edges(eared)) == 4
    strip = rectangle(60, 1, 60.0, 1.0)
    assert double(strip, longest=0.0).n_faces == strip.n_faces


def test_a_surface_of_many_holes_is_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    sphere = icosphere(4)
    mesh = TriangleMesh(sphere.vertices, np.delete(sphere.faces, np.arange(0, 5120, 60), axis=0))
    measured: list[int] = []
    areas = vars(TriangleMesh)["face_areas"]

    def counted(mesh: TriangleMesh) -> FloatArray:
        measured.append(mesh.n_faces)
        found: FloatArray = areas.__get__(mesh)
        return found

    monkeypatch.setattr(TriangleMesh, "face_areas", property(counted))
    assert close_loops(mesh, longest=50.0).n_faces > mesh.n_faces + 80
    assert len(measured) <= 3
