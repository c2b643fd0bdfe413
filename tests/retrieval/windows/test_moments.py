"""Moments of windows: discs, spheres, thin plates, and what must not matter."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from tests.meshes import (
    box,
    bumpy_sphere,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    subdivided,
    translated,
)
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.geodesics import distances_from, surface_graph
from workers.geometry.mesh import TriangleMesh
from workers.retrieval.windows.moments import EdgeMasses, Windows, windows

CREATURE = bumpy_sphere(3, seed=2)
RADII = np.array([0.4, 0.7])


def taken(
    mesh: TriangleMesh, points: IntArray, radii: FloatArray, *, facing: bool = False
) -> Windows:
    """Windows with distances of the graph."""
    distances = distances_from(surface_graph(mesh), points, np.inf)
    return windows(mesh, EdgeMasses.of(mesh), points, distances, radii, facing=facing)


def middle_of(mesh: TriangleMesh, place: tuple[float, float, float]) -> IntArray:
    """The vertex nearest to a place."""
    gaps = np.linalg.norm(mesh.vertices - np.array(place), axis=1)
    return np.array([int(np.argmin(gaps))])


@pytest.mark.parametrize("facing", [False, True])
def test_a_flat_disc_has_the_numbers_of_the_closed_form(facing: bool) -> None:
    """∫(1 - r²/R²)² = πR²/3, and x² has the mean R²/8 under this weight."""
    plane = rectangle(80, 80)
    point = middle_of(plane, (0.5, 0.5, 0.0))
    straight = np.linalg.norm(plane.vertices - plane.vertices[point], axis=1)[None]
    radii = np.array([0.2, 0.3, 0.45])
    masses = EdgeMasses.of(plane)
    found = windows(plane, masses, point, straight, radii, facing=facing)
    spread = 1.0 / np.sqrt(8.0)
    expected = [0.0, 0.0, spread, spread, 0.0, 1.0, 0.0]
    assert_allclose(found.numbers[0], [expected] * 3, atol=2e-3)  # an edge is 1/16 of R
    assert found.truncation.tolist() == [[0.0, 0.0, 0.0]]


def test_a_cap_of_a_sphere_has_the_numbers_of_the_closed_form() -> None:
    ball = icosphere(5)
    radius, point = 0.6, np.array([11])
    arcs = np.arccos(np.clip(ball.vertices @ ball.vertices[11], -1.0, 1.0))[None]
    masses = EdgeMasses.of(ball)
    (found,) = windows(ball, masses, point, arcs, np.array([radius]), facing=False).numbers[0]

    def integral(of: Callable[[float], float]) -> float:
        def weighed(t: float) -> float:
            return float((1.0 - (t / radius) ** 2) ** 2 * np.sin(t) * of(t))

        return 2.0 * np.pi * float(quad(weighed, 0.0, radius)[0])

    mass = integral(lambda _: 1.0)
    height = integral(np.cos) / mass
    across = integral(lambda t: 0.5 * np.sin(t) ** 2) / mass
    along = integral(lambda t: np.cos(t) ** 2) / mass - height**2
    expected = [
        np.log(mass / (np.pi * radius**2 / 3.0)),
        (height - 1.0) / radius,
        *np.sqrt([across, across, along]) / radius,
        height,  # normals are positions
        0.0,
    ]
    assert_allclose(found, expected, atol=2e-3)


def test_a_window_around_a_corner_of_the_boundary_is_cut_and_inside_it_is_not() -> None:
    plane = rectangle(60, 60)
    edge = 1.0 / 60.0
    rim = middle_of(plane, (0.5, 0.0, 0.0))
    inside = middle_of(plane, (0.5, 0.5, 0.0))
    radius = 0.3
    found = taken(plane, np.concatenate([rim, inside]), np.array([radius]))
    nearest = (1.0 - (0.5 * edge / radius) ** 2) ** 2  # the middle of an edge lies half of it off
    assert_allclose(found.truncation[:, 0], [nearest, 0.0], atol=1e-12)
    half = found.numbers[0, 0]
    assert half[0] == pytest.approx(np.log(0.5), abs=0.1)  # edges of the rim have half the mass
    assert half[6] > 0.1  # the centre of mass lies inside


def test_the_other_side_of_a_thin_plate_counts_only_where_all_does() -> None:
    """What faces the same way is what a sheet alone has."""
    plate = subdivided(box(1.0, 1.0, 0.02), 5)
    top = TriangleMesh(
        plate.vertices, plate.faces[(plate.vertices[plate.faces][:, :, 2] == 0.02).all(axis=1)]
    )
    point = middle_of(plate, (0.5, 0.1875, 0.02))
    radii = np.array([0.3])
    around, facing = (taken(plate, point, radii, facing=f).numbers[0, 0] for f in (False, True))
    alone = taken(top, point, radii).numbers[0, 0]
    assert alone[5] == pytest.approx(1.0)
    assert_allclose(facing, alone, atol=0.02)
    assert around[5] < 0.97  # normals of the other side point the other way
    assert around[0] > facing[0] + 0.005


def by_loops(
    mesh: TriangleMesh, point: int, far: FloatArray, radius: float, *, facing: bool
) -> list[float]:
    """The seven numbers of one window, edge by edge."""
    edges: dict[tuple[int, ...], list[int]] = {}
    for number, face in enumerate(mesh.faces.tolist()):
        for i in range(3):
            edges.setdefault(tuple(sorted((face[i], face[i - 1]))), []).append(number)
    found = []
    for ends, faces in edges.items():
        gap = far[list(ends)].mean()
        if gap < radius:
            normal = sum(mesh.face_normals[face] for face in faces) / 6.0
            mass = sum(mesh.face_areas[face] for face in faces) / 3.0
            found.append((mass, mesh.vertices[list(ends)].mean(axis=0), normal, gap))
    mean = np.sum([normal for _, _, normal, gap in found if gap < 0.6 * radius], axis=0)
    mean /= np.linalg.norm(mean)
    total, normals, places, weights = 0.0, np.zeros(3), [], []
    for mass, middle, normal, gap in found:
        weight = (1.0 - (gap / radius) ** 2) ** 2
        if facing:
            cosine = normal @ mean / np.linalg.norm(normal)
            share = min(max((cosine - 0.2) / 0.5, 0.0), 1.0)
            weight *= share * share * (3.0 - 2.0 * share)
        total += weight * mass
        normals += weight * normal
        places.append(middle)
        weights.append(weight * mass)
    covariance = np.cov(np.array(places).T, aweights=weights, bias=True)
    offset = np.average(places, axis=0, weights=weights) - mesh.vertices[point]
    above = float(offset @ mean)
    return [
        np.log(total / (np.pi * radius**2 / 3.0)),
        above / radius,
        *np.sqrt(np.linalg.eigvalsh(covariance)[::-1]) / radius,
        np.linalg.norm(normals) / total,
        np.linalg.norm(offset - above * mean) / radius,
    ]


@pytest.mark.parametrize("facing", [False, True])
def test_windows_are_those_of_a_plain_loop(facing: bool) -> None:
    mesh = bumpy_sphere(2, 2)
    points = np.array([3, 50, 120])
    distances = distances_from(surface_graph(mesh), points, np.inf)
    radii = np.array([0.5, 0.9, 1.6])
    found = windows(mesh, EdgeMasses.of(mesh), points, distances, radii, facing=facing)
    for place, point in enumerate(points.tolist()):
        for number, radius in enumerate(radii.tolist()):
            expected = by_loops(mesh, point, distances[place], radius, facing=facing)
            assert_allclose(found.numbers[place, number], expected, atol=1e-6)


@pytest.mark.parametrize("facing", [False, True])
def test_windows_see_no_rotation_renumbering_or_scale(facing: bool) -> None:
    rng = np.random.default_rng(3)
    points = np.array([3, 50, 200, 601])
    expected = taken(CREATURE, points, RADII, facing=facing)
    copy, order = renumbered(scaled(rotated(CREATURE, rng), 2.5), rng)
    copy = translated(copy, (1.0, -2.0, 0.5))
    found = taken(copy, np.argsort(order)[points], 2.5 * RADII, facing=facing)
    assert_allclose(found.numbers, expected.numbers, atol=1e-6)  # roots of covariances near 0
    assert_allclose(found.truncation, expected.truncation, atol=1e-9)


def test_a_window_is_the_same_whatever_others_are_taken() -> None:
    points = np.array([3, 50, 200])
    together = taken(CREATURE, points, RADII)
    for place, point in enumerate(points):
        for number, radius in enumerate(RADII):
            alone = taken(CREATURE, np.array([point]), np.array([radius]))
            assert_allclose(alone.numbers[0, 0], together.numbers[place, number], atol=1e-9)


def test_no_points_have_no_windows() -> None:
    found = taken(CREATURE, np.empty(0, dtype=np.int64), RADII)
    assert (found.numbers.shape, found.truncation.shape) == ((0, 2, 7), (0, 2))


def test_masses_of_edges_sum_to_the_area_and_normals_to_the_area_vector() -> None:
    for mesh in (CREATURE, rectangle(3, 5, 2.0, 1.0)):
        masses = EdgeMasses.of(mesh)
        assert masses.moments[:, 0].sum() == pytest.approx(mesh.area)
        assert_allclose(masses.normals.sum(axis=0), 0.5 * mesh.face_normals.sum(axis=0), atol=1e-12)
        faces = np.sort(mesh.faces, axis=1)
        for edge in (0, len(masses.ends) // 2):
            adjacent = np.isin(faces, masses.ends[edge]).sum(axis=1) == 2
            assert masses.moments[edge, 0] == pytest.approx(mesh.face_areas[adjacent].sum() / 3.0)
            assert masses.on_boundary[edge] == (adjacent.sum() == 1)
        lengths = np.linalg.norm(masses.directions, axis=1)
        assert_allclose(lengths, 1.0)


def test_mass_does_not_depend_on_the_mesh_as_long_as_it_is_fine() -> None:
    """Edges' midpoints integrate quadratic weights without error: flat windows hardly change."""
    coarse, fine = rectangle(24, 24), subdivided(rectangle(24, 24))
    numbers = []
    for mesh in (coarse, fine):
        point = middle_of(mesh, (0.5, 0.5, 0.0))
        straight = np.linalg.norm(mesh.vertices - mesh.vertices[point], axis=1)[None]
        masses = EdgeMasses.of(mesh)
        found = windows(mesh, masses, point, straight, np.array([0.35]), facing=False)
        numbers.append(found.numbers[0, 0])
    assert_allclose(numbers[0], numbers[1], atol=0.01)
