"""Geodesic distances: how far they are from true ones, and points spread by them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from tests.meshes import (
    bumpy_sphere,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    single_triangle,
    tetrahedron,
    translated,
    union,
)
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.geodesics import (
    distances_from,
    farthest_points,
    mutual_distances,
    surface_graph,
)
from workers.geometry.mesh import TriangleMesh

CREATURE = bumpy_sphere(3, seed=1)
ISLANDS = union(icosphere(1), translated(icosphere(2, 0.5), (5.0, 0.0, 0.0)), tetrahedron(0.1))


def lattice(cells: int) -> TriangleMesh:
    """Flat, of equilateral triangles with edges of length 1."""
    square = rectangle(cells, cells, float(cells), float(cells))
    x, y, z = square.vertices.T
    sheared = np.stack([x - 0.5 * y, np.sqrt(0.75) * y, z], axis=1)
    return TriangleMesh(sheared, square.faces)


def edges_alone(mesh: TriangleMesh) -> sparse.csr_array:
    """The graph that has no lines across edges."""
    edges = undirected_edges(mesh)
    ends = np.concatenate([edges, edges[:, ::-1]])
    along = np.tile(edge_lengths(mesh.vertices, edges), 2)
    return sparse.csr_array((along, ends.T), shape=(mesh.n_vertices, mesh.n_vertices))


def all_distances(graph: sparse.csr_array) -> FloatArray:
    found: FloatArray = dijkstra(graph, directed=True)
    return found


def spread_by_full_searches(
    far: FloatArray, count: int, start: int
) -> tuple[IntArray, FloatArray, IntArray]:
    """Farthest points, their distances and the nearest of them, from all distances (n, n)."""
    own = np.where(np.isfinite(far[start]), far[start], -1.0)
    taken = [int(np.argmax(own))]
    while len(taken) < min(count, len(far)):
        taken.append(int(np.argmax(far[taken].min(axis=0))))
    return np.array(taken), far[taken], np.argmin(far[taken], axis=0)


def test_distances_on_a_plane_are_4_percent_off_and_along_edges_alone_15() -> None:
    """Edges have six directions and unfolded diagonals six between: at worst 1 / cos 15°."""
    plane = lattice(20)
    middle = 10 * 21 + 10
    straight = np.linalg.norm(plane.vertices - plane.vertices[middle], axis=1)
    others = straight > 0.0
    for graph, worst in (
        (surface_graph(plane), 1.0 / np.cos(np.pi / 12.0)),  # 1.035
        (edges_alone(plane), 2.0 / np.sqrt(3.0)),  # 1.155
    ):
        ratios = distances_from(graph, np.array([middle]), np.inf)[0, others] / straight[others]
        assert ratios.min() >= 1.0 - 1e-12
        assert ratios.max() == pytest.approx(worst, rel=1e-3)  # 20 cells have not all directions


def test_distances_on_a_sphere_are_within_5_percent_of_great_circles() -> None:
    ball = icosphere(4)
    far = distances_from(surface_graph(ball), np.array([7]), np.inf)[0]
    arcs = np.arccos(np.clip(ball.vertices @ ball.vertices[7], -1.0, 1.0))
    ratios = far[arcs > 0.0] / arcs[arcs > 0.0]
    assert ratios.min() > 0.999  # chords are shorter than arcs
    assert ratios.max() < 1.05
    assert ratios.mean() < 1.02


def test_a_way_across_an_edge_is_the_straight_line_of_the_unfolded_faces() -> None:
    """However the two faces are folded; a line that leaves them is none."""
    for angle in (0.0, 1.0, 3.0):
        tip = [-0.2, -np.cos(angle), np.sin(angle)]
        hinge = TriangleMesh(
            np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.4, 1.0, 0.0], tip]),
            np.array([[0, 1, 2], [1, 0, 3]]),
        )
        assert surface_graph(hinge)[2, 3] == pytest.approx(np.hypot(0.6, 2.0))
    dart = TriangleMesh(
        np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.5, 0.0], [3.0, -0.5, 0.0]]),
        np.array([[0, 1, 2], [1, 0, 3]]),
    )
    graph = surface_graph(dart)
    assert graph[2, 3] == 0.0
    around = distances_from(graph, np.array([2]), np.inf)[0, 3]
    assert around == pytest.approx(2.0 * np.hypot(2.0, 0.5))


def test_no_line_crosses_an_edge_of_three_faces() -> None:
    vertices = np.array([[-1.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0], [0, 0, 1.0]])
    two, third = [[0, 1, 2], [1, 0, 3]], [[0, 1, 4]]
    assert surface_graph(TriangleMesh(vertices[:4], np.array(two)))[2, 3] == pytest.approx(2.0)
    graph = surface_graph(TriangleMesh(vertices, np.array(two + third)))
    assert graph[[2, 2, 3], [3, 4, 4]].tolist() == [0.0, 0.0, 0.0]
    assert distances_from(graph, np.array([2]), np.inf)[0, 3] == pytest.approx(2.0 * np.sqrt(2.0))


def test_of_several_ways_between_two_vertices_the_shortest_counts() -> None:
    """The tips of two faces are the ends of an edge, too: the way around is no way across."""
    corner = tetrahedron()  # every pair of vertices has an edge; unfolded lines are √3 edges long
    graph = surface_graph(corner)
    assert_allclose(graph.toarray(), 1.0 - np.eye(4), atol=1e-12)


def test_vertices_at_one_place_stay_connected() -> None:
    """A length of 0 would be no edge."""
    flat = TriangleMesh(
        np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 1.0, 0]]),
        np.array([[0, 1, 2], [1, 3, 2]]),
    )
    far = distances_from(surface_graph(flat), np.array([3]), np.inf)[0]
    assert far[2] == pytest.approx(0.0, abs=1e-300)
    assert np.isfinite(far).all()


def test_distances_see_neither_position_nor_numbering_and_scale_with_the_mesh() -> None:
    rng = np.random.default_rng(4)
    expected = all_distances(surface_graph(CREATURE))
    copy, order = renumbered(scaled(rotated(CREATURE, rng), 3.0), rng)
    found = all_distances(surface_graph(copy))
    assert_allclose(found, 3.0 * expected[np.ix_(order, order)], rtol=1e-9)


def test_distances_are_those_within_reach() -> None:
    graph = surface_graph(CREATURE)
    far = all_distances(graph)
    some = np.array([5, 17, 5])
    reach = 0.7
    expected = np.where(far[some] <= reach, far[some], np.inf)
    assert_array_equal(distances_from(graph, some, reach), expected)
    assert distances_from(graph, some[:0], reach).shape == (0, CREATURE.n_vertices)


def test_far_distances_lead_by_way_of_near_ones() -> None:
    """A way over points that are 0.15 apart is longer by what it strays from the straight one."""
    graph = surface_graph(CREATURE)
    far = all_distances(graph)
    points = farthest_points(graph, 500, start=0, reach=0.0).vertices
    near = far[np.ix_(points, points)]
    found = mutual_distances(np.where(near < 0.9, near, np.inf), 40)
    assert_array_equal(found, found.T)
    excess = found / np.maximum(near[:40, :40], 1e-9)
    assert excess[near[:40, :40] > 0.0].min() > 1.0 - 1e-12
    assert excess.max() < 1.05
    assert_array_equal(np.diag(found), 0.0)


@pytest.mark.parametrize("mesh", [CREATURE, ISLANDS])
@pytest.mark.parametrize("reach", [0.0, 0.4])
def test_searches_that_end_early_change_nothing(mesh: TriangleMesh, reach: float) -> None:
    graph = surface_graph(mesh)
    far = all_distances(graph)
    found = farthest_points(graph, 40, start=3, reach=reach)
    vertices, distances, cells = spread_by_full_searches(far, 40, 3)
    assert_array_equal(found.vertices, vertices)
    assert_array_equal(found.cells, cells)
    within = distances <= reach
    assert_array_equal(found.distances[within], distances[within])
    known = np.isfinite(found.distances)
    assert_array_equal(found.distances[known], distances[known])  # and none is wrong


def test_points_are_spread_at_every_length_of_the_list() -> None:
    """Each is as far from those before it as any vertex: no two are nearer than the next hole."""
    graph = surface_graph(CREATURE)
    found = farthest_points(graph, 60, start=0, reach=np.inf)
    gaps = [found.distances[:i, found.vertices[i]].min() for i in range(1, 60)]
    assert (np.diff(gaps) <= 0.0).all()
    assert_array_equal(found.cells, found.distances.argmin(axis=0))


def test_every_component_has_a_point_before_any_has_two() -> None:
    graph = surface_graph(ISLANDS)
    found = farthest_points(graph, 3, start=0, reach=np.inf)
    of_island = np.repeat([0, 1, 2], [42, 162, 4])
    assert sorted(of_island[found.vertices]) == [0, 1, 2]
    assert_array_equal(of_island[found.vertices][found.cells], of_island)
    mutual = mutual_distances(found.distances[:, found.vertices], 3)
    assert_array_equal(mutual, np.where(np.eye(3) == 1.0, 0.0, np.inf))


def test_a_mesh_of_few_vertices_has_them_all_as_points() -> None:
    for mesh in (single_triangle(), tetrahedron()):
        found = farthest_points(surface_graph(mesh), 50, start=0, reach=np.inf)
        assert sorted(found.vertices) == list(range(mesh.n_vertices))
        assert_array_equal(found.vertices[found.cells], np.arange(mesh.n_vertices))
