"""Edges: counted, measured and joined as the closed forms of a triangle and a tetrahedron say."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from tests.meshes import icosphere, rectangle, single_triangle, tetrahedron, union
from workers.geometry.edges import (
    component_labels,
    directed_edges,
    edge_keys,
    edge_lengths,
    length_graph,
    single_edges,
    symmetric_graph,
    undirected_edges,
)
from workers.geometry.mesh import TriangleMesh
from workers.transformations.metric import geodesic_distances

FIRST = np.array([0])


def test_edges_of_one_triangle() -> None:
    mesh = single_triangle()
    assert_array_equal(directed_edges(mesh.faces), [[0, 1], [1, 2], [2, 0]])
    assert_array_equal(undirected_edges(mesh), [[0, 1], [0, 2], [1, 2]])
    lengths = edge_lengths(mesh.vertices, undirected_edges(mesh))
    assert_allclose(lengths, [1.0, 1.0, np.sqrt(2.0)], rtol=1e-15)


def test_every_edge_of_a_closed_mesh_comes_once_in_each_direction() -> None:
    mesh = icosphere(1)
    halves = {tuple(edge) for edge in directed_edges(mesh.faces).tolist()}
    assert len(halves) == 3 * mesh.n_faces
    assert halves == {(j, i) for i, j in halves}
    assert len(undirected_edges(mesh)) == 3 * mesh.n_faces // 2


def test_a_mesh_without_faces_has_no_edges() -> None:
    empty = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    assert undirected_edges(empty).shape == (0, 2)
    assert component_labels(undirected_edges(empty), 3).tolist() == [0, 1, 2]


def test_keys_do_not_see_the_direction_and_ascend_with_sorted_edges() -> None:
    edges = undirected_edges(icosphere(2))
    keys = edge_keys(edges, 162)
    assert (np.diff(keys) > 0).all()
    assert_array_equal(edge_keys(edges[:, ::-1], 162), keys)


def test_weights_of_an_edge_add_up_and_the_graph_is_symmetric_to_the_bit() -> None:
    edges = np.array([[0, 1], [0, 1], [1, 2]])
    matrix = symmetric_graph(edges, np.array([0.1, 0.2, 0.7]), 4).toarray()
    expected = np.zeros((4, 4))
    expected[0, 1] = expected[1, 0] = 0.1 + 0.2
    expected[1, 2] = expected[2, 1] = 0.7
    assert_array_equal(matrix, expected)


def test_paths_along_the_graph_of_lengths_are_sums_of_edges() -> None:
    mesh = rectangle(5, 1, 5.0, 1.0)
    distances = geodesic_distances(length_graph(mesh, undirected_edges(mesh)), FIRST)[0]
    assert_allclose(distances[:7], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 1.0], rtol=1e-15)


def test_an_edge_of_no_length_still_connects() -> None:
    places = np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0]])
    mesh = TriangleMesh(places, np.array([[0, 1, 2]]))
    graph = length_graph(mesh, undirected_edges(mesh))
    assert graph.nnz == 6
    assert_allclose(geodesic_distances(graph, FIRST)[0], [0.0, 0.0, 1.0], atol=1e-300)


def test_components_are_labelled_by_their_first_vertex() -> None:
    mesh = union(tetrahedron(), tetrahedron())
    labels = component_labels(undirected_edges(mesh), mesh.n_vertices + 1)
    assert_array_equal(labels, [0] * 4 + [1] * 4 + [2])


@pytest.mark.parametrize("seed", range(10))
def test_labels_of_random_graphs_are_those_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 400))
    edges = rng.integers(0, n, size=(int(rng.integers(0, 2 * n)), 2))
    ones = np.ones(len(edges))
    graph = sparse.coo_array((ones, tuple(edges.T)), shape=(n, n)).tocsr()
    _, expected = connected_components(graph, directed=False)
    assert_array_equal(component_labels(edges, n), expected)


def test_a_long_path_is_one_component_in_whatever_order() -> None:
    n = 5000
    names = np.random.default_rng(0).permutation(n)
    edges = np.stack([names[:-1], names[1:]], axis=1)
    assert component_labels(edges, n).max() == 0
    assert component_labels(edges[::-1, ::-1], n).max() == 0


@pytest.mark.parametrize("seed", range(10))
def test_edges_of_random_faces_are_those_that_counting_gives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, 12, size=(15, 3))
    counts: dict[tuple[int, int], int] = {}
    for start, end in directed_edges(faces).tolist():
        key = (min(start, end), max(start, end))
        counts[key] = counts.get(key, 0) + 1
    assert_array_equal(undirected_edges(TriangleMesh(np.zeros((12, 3)), faces)), sorted(counts))
    corners, own = single_edges(faces, 12)
    found = np.stack([faces[own, corners], faces[own, (corners + 1) % 3]], axis=1).tolist()
    expected = [
        [a, b] for a, b in directed_edges(faces).tolist() if counts[min(a, b), max(a, b)] == 1
    ]
    assert found == expected


def test_a_star_of_many_edges_is_one_component() -> None:
    """Its middle has the largest number: whoever joins two at a time takes the square of it."""
    n = 300_000
    spokes = np.stack([np.arange(n - 1), np.full(n - 1, n - 1)], axis=1)
    assert not component_labels(spokes, n).any()
