"""Components, boundaries and Euler characteristics of surfaces where they are known."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.meshes import (
    box,
    cylinder,
    icosphere,
    octahedron,
    rectangle,
    renumbered,
    single_triangle,
    tetrahedron,
    torus,
    translated,
    union,
)
from workers.geometry import topology
from workers.geometry.arrays import IntArray
from workers.geometry.edges import component_labels, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import (
    boundary_edges,
    boundary_loops,
    count_components,
    count_surface_components,
    euler_characteristic,
    face_components,
    is_closed,
    pass_on,
    surface_components,
    vertex_components,
)


@pytest.mark.parametrize(
    ("mesh", "components", "loops", "euler"),
    [
        (tetrahedron(), 1, 0, 2),
        (icosphere(2), 1, 0, 2),
        (torus(12, 8), 1, 0, 0),
        (rectangle(4, 3), 1, 1, 1),
        (cylinder(7, 3), 1, 2, 0),
        (union(box(), torus(9, 7), rectangle(2, 2)), 3, 1, 3),
    ],
    ids=["tetrahedron", "sphere", "torus", "rectangle", "cylinder", "three"],
)
def test_known_surfaces(mesh: TriangleMesh, components: int, loops: int, euler: int) -> None:
    assert count_components(mesh) == components
    assert len(boundary_loops(mesh)) == loops
    assert euler_characteristic(mesh) == euler


def test_euler_characteristic_does_not_count_unreferenced_vertices() -> None:
    mesh = octahedron()
    padded = TriangleMesh(np.concatenate([mesh.vertices, np.ones((5, 3))]), mesh.faces)
    assert euler_characteristic(padded) == 2
    assert count_components(padded) == 1
    assert len(np.unique(vertex_components(padded))) == 6


def test_components_of_faces_are_those_of_their_vertices() -> None:
    mesh = union(octahedron(), tetrahedron())
    assert_array_equal(face_components(mesh), [0] * 8 + [1] * 4)
    assert_array_equal(vertex_components(mesh), [0] * 6 + [1] * 4)


def test_bodies_that_touch_in_a_vertex_are_two_surfaces() -> None:
    upper = TriangleMesh(octahedron().vertices, octahedron().faces)
    touching = union(upper, translated(octahedron(), (2, 0, 0)))
    merged = np.arange(12)
    where = np.flatnonzero((touching.vertices == [1, 0, 0]).all(axis=1))
    merged[where] = where[0]
    pinched = TriangleMesh(touching.vertices, merged[touching.faces])
    assert count_components(pinched) == 1
    assert count_surface_components(pinched) == 2
    assert_array_equal(surface_components(pinched), [0] * 8 + [1] * 8)
    assert count_surface_components(TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))) == 0


def test_every_edge_is_there_once() -> None:
    assert_array_equal(undirected_edges(single_triangle()), [[0, 1], [0, 2], [1, 2]])
    assert len(undirected_edges(icosphere(1))) == 120


def test_boundary_edges_keep_the_winding_of_their_face() -> None:
    assert_array_equal(boundary_edges(single_triangle()), [[0, 1], [2, 0], [1, 2]])


def test_a_loop_runs_with_the_winding_of_its_faces() -> None:
    (loop,) = boundary_loops(rectangle(5, 4))
    points = rectangle(5, 4).vertices[loop][:, :2]
    following = np.roll(points, -1, axis=0)
    area = 0.5 * (points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]).sum()
    assert area == pytest.approx(1.0)  # counter-clockwise round the unit square
    assert len(loop) == 18


def _as_sets(loops: list[IntArray]) -> set[frozenset[int]]:
    return {frozenset(loop.tolist()) for loop in loops}


def test_loops_do_not_depend_on_the_numbering() -> None:
    mesh = union(cylinder(7, 3), rectangle(3, 2))
    copy, order = renumbered(mesh, np.random.default_rng(5))
    back = [order[loop] for loop in boundary_loops(copy)]
    assert _as_sets(back) == _as_sets(boundary_loops(mesh))


def test_two_triangles_that_touch_in_a_vertex_have_two_loops() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    mesh = TriangleMesh(vertices, np.array([[0, 1, 2], [0, 3, 4]]))
    assert _as_sets(boundary_loops(mesh)) == {frozenset({0, 1, 2}), frozenset({0, 3, 4})}


def test_two_holes_that_touch_in_a_vertex_are_two_loops() -> None:
    mesh = rectangle(5, 5)
    corner = 2 * 6 + 2  # an inner vertex of the grid of 6 × 6
    cells = {(1, 1), (2, 2)}  # the two cells that meet there, diagonally
    centres = (mesh.vertices[mesh.faces].mean(axis=1)[:, :2] * 5).astype(int)  # (m, 2)
    kept = [tuple(centre) not in cells for centre in centres.tolist()]
    loops = boundary_loops(TriangleMesh(mesh.vertices, mesh.faces[kept]))
    assert sorted(len(loop) for loop in loops) == [4, 4, 20]
    assert sum(corner in loop for loop in loops) == 2
    assert all(len(set(loop.tolist())) == len(loop) for loop in loops)


def test_a_loop_is_found_where_faces_are_wound_against_each_other() -> None:
    mesh = rectangle(4, 4)
    faces = mesh.faces.copy()
    faces[::3] = faces[::3, ::-1]
    (loop,) = boundary_loops(TriangleMesh(mesh.vertices, faces))
    assert len(loop) == 16


def test_boundary_that_ends_at_an_edge_of_three_faces_is_no_loop() -> None:
    box_with_fin = union(box(), translated(single_triangle(), (3, 0, 0)))
    faces = box_with_fin.faces.copy()
    faces[-1, :2] = [0, 1]  # the fin stands on an edge of the box
    mesh = TriangleMesh(box_with_fin.vertices, faces)
    assert len(boundary_edges(mesh)) == 2
    assert boundary_loops(mesh) == []


def test_arguments_are_not_written_to() -> None:
    mesh = cylinder(5, 2)
    assert not mesh.faces.flags.writeable
    boundary_loops(mesh)
    face_components(mesh)


@pytest.mark.parametrize("seed", range(10))
def test_surfaces_of_random_faces_are_those_of_their_pairs(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(seed)
    mesh = TriangleMesh(np.zeros((30, 3)), rng.integers(0, 30, size=(25, 3)))
    edges = [{frozenset((face[i], face[i - 1])) for i in range(3)} for face in mesh.faces.tolist()]
    pairs = [(i, j) for i in range(25) for j in range(i) if edges[i] & edges[j]]
    expected = component_labels(np.array(pairs, dtype=np.int64).reshape(-1, 2), 25)
    assert_array_equal(surface_components(mesh), expected)
    monkeypatch.setattr(topology, "LARGEST_NUMBER", 0)  # as for numbers beyond 64 bits
    again = TriangleMesh(mesh.vertices, mesh.faces)
    assert_array_equal(surface_components(again), expected)
    assert euler_characteristic(again) == euler_characteristic(mesh)


def test_what_is_known_of_a_mesh_is_known_of_its_copy() -> None:
    mesh = union(rectangle(3, 2), icosphere(1))
    labels = surface_components(mesh)
    copy = translated(mesh, (1, 0, 0))
    pass_on(mesh, copy)
    assert surface_components(copy) is labels
    assert not labels.flags.writeable
    assert not is_closed(copy)
    assert is_closed(icosphere(1))
    pass_on(icosphere(1), copy)  # of which nothing is known
    assert surface_components(copy) is labels
    assert boundary_edges(icosphere(1)).shape == (0, 2)
