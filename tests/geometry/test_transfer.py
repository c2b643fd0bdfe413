"""Fields carried from mesh to mesh: exact where they are linear, close where they are smooth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bumpy_sphere,
    icosphere,
    rectangle,
    renumbered,
    scaled,
    single_triangle,
    subdivided,
    translated,
    union,
)
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


def point_beside_a_large_triangle() -> tuple[TriangleMesh, np.ndarray]:
    """A floor of two large triangles and a small ball beside them, and a point over the floor.

    The point is 0.05 above the floor, and farther than that from every vertex and every centre.
    """
    floor = TriangleMesh(
        np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    ball = translated(icosphere(2, 0.1), (5.0, 4.0, 0.4))
    return union(floor, ball), np.array([[5.0, 4.0, 0.05], [5.0, 3.7, 0.0]])


def test_a_large_triangle_beside_small_ones_is_found() -> None:
    mesh, positions = point_beside_a_large_triangle()
    found = closest_points(mesh, positions)
    assert_allclose(np.sqrt(found.squared_distances), [0.05, 0.0], atol=1e-15)


def compared_with_every_face(
    mesh: TriangleMesh, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Face, weights and squared distance by comparison with every face, the first of the best."""
    corners = mesh.vertices[mesh.faces]
    rows = []
    for position in positions:
        points = np.broadcast_to(position, (mesh.n_faces, 3))
        weights = closest_barycentric(points, corners)
        closest = sum(weights[:, i, None] * corners[:, i] for i in range(3))
        gap = closest - points
        squared = gap[:, 0] ** 2 + gap[:, 2] ** 2 + gap[:, 1] ** 2
        face = int(np.argmin(squared))
        rows.append((mesh.faces[face], weights[face], squared[face]))
    faces, coordinates, distances = zip(*rows, strict=True)
    return np.array(faces), np.array(coordinates), np.array(distances)


@st.composite
def triangles_of_every_size(draw: st.DrawFn) -> TriangleMesh:
    """Loose triangles: huge, tiny, needles, caps, segments and points, some of them repeated."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(st.integers(1, 200))
    smallest = draw(st.sampled_from([0.0, -1.0, -4.0]))
    sizes = 10.0 ** rng.uniform(smallest, 1.0, n)  # (n,)
    widths = 10.0 ** rng.uniform(draw(st.sampled_from([0.0, -6.0])), 0.0, n)
    sides = rng.normal(size=(n, 2, 3)) * sizes[:, None, None]
    apex = rng.uniform(0.0, 1.0, (n, 1)) * sides[:, 0] + widths[:, None] * sides[:, 1]
    first = rng.normal(size=(n, 3)) * 10.0 ** rng.uniform(-2.0, 1.0)
    corners = np.stack([first, first + sides[:, 0], first + apex], axis=1)  # (n, 3, 3)
    for row in rng.integers(n, size=draw(st.integers(0, 3))):
        corners[row, 2] = corners[row, rng.integers(2)]  # a segment
    corners = corners[rng.integers(n, size=n)] if draw(st.booleans()) else corners
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def positions_around(mesh: TriangleMesh, rng: np.random.Generator, count: int) -> np.ndarray:
    """Positions far from a mesh, near it, on its faces and at its vertices."""
    faces = mesh.vertices[mesh.faces[rng.integers(mesh.n_faces, size=count)]]
    weights = rng.dirichlet(np.ones(3), size=count)
    on_faces = (weights[:, :, None] * faces).sum(axis=1)
    kind = rng.integers(4, size=count)
    offsets = np.array([0.0, 1e-3, 1.0, 0.0])[kind][:, None] * rng.normal(size=(count, 3))
    return np.where((kind == 3)[:, None], faces[:, 0], on_faces) + offsets


@settings(max_examples=60, deadline=None)
@given(mesh=triangles_of_every_size(), seed=st.integers(0, 1000))
def test_no_face_is_closer_than_the_one_that_is_found(mesh: TriangleMesh, seed: int) -> None:
    positions = positions_around(mesh, np.random.default_rng(seed), 40)
    corners, weights, squared = compared_with_every_face(mesh, positions)
    found = closest_points(mesh, positions)
    assert_array_equal(found.squared_distances, squared)
    assert_array_equal(found.corners, corners)
    assert_array_equal(found.weights, weights)


@settings(max_examples=20, deadline=None)
@given(mesh=triangles_of_every_size(), seed=st.integers(0, 1000))
def test_other_positions_and_their_order_do_not_matter(mesh: TriangleMesh, seed: int) -> None:
    rng = np.random.default_rng(seed)
    positions = positions_around(mesh, rng, 30)
    order = rng.permutation(30)[:11]
    all_at_once, some = closest_points(mesh, positions), closest_points(mesh, positions[order])
    assert_array_equal(some.corners, all_at_once.corners[order])
    assert_array_equal(some.weights, all_at_once.weights[order])


def distance_to_triangle(point: np.ndarray, corners: np.ndarray) -> float:
    """Distance by a second way: to the plane where the foot is inside, else to a side."""
    a, b, c = corners.astype(np.longdouble)
    p = point.astype(np.longdouble)
    distances = []
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        length = side @ side
        along = min(max((p - start) @ side / length, 0.0), 1.0) if length > 0 else 0.0
        gap = start + along * side - p
        distances.append(np.sqrt(gap @ gap))
    normal = np.cross(b - a, c - a)
    if normal @ normal > 0:
        turns = [np.cross(e - s, p - s) @ normal for s, e in ((a, b), (b, c), (c, a))]
        if min(turns) >= 0:
            distances.append(abs((p - a) @ normal) / np.sqrt(normal @ normal))
    return float(min(distances))


@settings(max_examples=40, deadline=None)
@given(mesh=triangles_of_every_size(), seed=st.integers(0, 1000))
def test_the_distance_is_that_of_a_second_way(mesh: TriangleMesh, seed: int) -> None:
    positions = positions_around(mesh, np.random.default_rng(seed), 3)
    found = np.sqrt(closest_points(mesh, positions).squared_distances)
    corners = mesh.vertices[mesh.faces]
    expected = [min(distance_to_triangle(p, t) for t in corners) for p in positions]
    # The normal of a needle of aspect 1e6 is known to 1e-10, so a foot far away to as much.
    assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("exponent", [-300, -100, 100, 300])
def test_no_unit_is_too_large_or_too_small(exponent: int) -> None:
    mesh, positions = point_beside_a_large_triangle()
    unit = 2.0**exponent
    found = closest_points(scaled(mesh, unit), unit * positions)
    expected = closest_points(mesh, positions)
    assert_array_equal(found.weights, expected.weights)
    assert_array_equal(found.corners, expected.corners)


def test_as_close_to_every_face_is_no_trouble() -> None:
    mesh = icosphere(4)
    found = closest_points(mesh, np.zeros((3, 3)))
    assert_array_equal(found.corners, compared_with_every_face(mesh, np.zeros((1, 3)))[0][[0] * 3])
