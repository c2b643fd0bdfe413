"""Copies of a mesh agree on a frame and an order, symmetric meshes as well."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bent_rectangle,
    box,
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    subdivided,
    torus,
    translated,
)
from workers.geometry import canonical
from workers.geometry.canonical import (
    canonical_frame,
    canonical_order,
    order_by_place,
    reordered,
    rounded,
)
from workers.geometry.edges import directed_edges
from workers.geometry.mesh import TriangleMesh

MESHES = {
    "bumpy": bumpy_sphere(3),
    "sphere": icosphere(3),
    "torus": torus(30, 12),
    "box": subdivided(box(1, 2, 3), 3),
    "cube": subdivided(box(), 3),
    "cylinder": cylinder(24, 12),
    "rectangle": rectangle(16, 12),
    "bent": bent_rectangle(16, 12),
}


def canonical_form(mesh: TriangleMesh) -> TriangleMesh:
    frame = canonical_frame(mesh)
    inside = TriangleMesh(rounded(frame.enter(mesh.vertices)), mesh.faces)
    return reordered(inside, canonical_order(mesh, frame), mirrored=frame.mirrored)


@pytest.mark.parametrize("name", MESHES)
def test_copies_have_the_same_canonical_form_bit_for_bit(name: str) -> None:
    rng = np.random.default_rng(11)
    expected = canonical_form(MESHES[name])
    for _ in range(5):
        copy = rotated(scaled(MESHES[name], 10 ** rng.uniform(-4, 4)), rng)
        copy, _ = renumbered(translated(copy, tuple(copy.vertices[0] * 3)), rng)
        found = canonical_form(copy)
        assert_array_equal(found.vertices, expected.vertices)
        assert_array_equal(found.faces, expected.faces)


@pytest.mark.parametrize("name", ["bumpy", "box", "bent"])
def test_a_mirrored_copy_has_the_same_canonical_form(name: str) -> None:
    mesh = MESHES[name]
    mirrored = TriangleMesh(mesh.vertices * [-1.0, 1.0, 1.0], mesh.faces[:, ::-1])
    expected, found = canonical_form(mesh), canonical_form(mirrored)
    assert_array_equal(found.vertices, expected.vertices)
    assert_array_equal(found.faces, expected.faces)


@pytest.mark.parametrize("name", MESHES)
def test_the_frame_is_a_similarity_to_unit_area(name: str) -> None:
    mesh = MESHES[name]
    frame = canonical_frame(mesh)
    assert_allclose(frame.axes @ frame.axes.T, np.eye(3), atol=1e-12)
    inside = TriangleMesh(frame.enter(mesh.vertices), mesh.faces)
    assert inside.area == pytest.approx(1.0)
    assert_allclose(frame.leave(inside.vertices), mesh.vertices, atol=1e-12)


def test_reordering_keeps_the_surface_and_its_winding() -> None:
    mesh = bumpy_sphere(1)
    order = np.random.default_rng(0).permutation(mesh.n_vertices)
    copy = reordered(mesh, order)
    assert_array_equal(copy.vertices, mesh.vertices[order])
    assert_allclose(copy.face_normals.sum(axis=0), mesh.face_normals.sum(axis=0), atol=1e-12)
    assert np.einsum("ij,ij->", copy.face_normals, copy.vertices[copy.faces[:, 0]]) > 0
    turned = reordered(mesh, order, mirrored=True)
    assert np.einsum("ij,ij->", turned.face_normals, turned.vertices[turned.faces[:, 0]]) < 0


@pytest.mark.parametrize("steps", [2, 5, 1000])
def test_the_order_is_that_of_all_coordinates_and_all_neighbours(steps: int) -> None:
    rng = np.random.default_rng(steps)
    points = rng.integers(0, steps, size=(60, 3)) / 1024.0  # of few steps, many in one place
    mesh = TriangleMesh(points, rng.integers(0, 60, size=(80, 3)))
    neighbours: dict[int, set[int]] = {i: set() for i in range(60)}
    for start, end in directed_edges(mesh.faces).tolist():
        neighbours[start].add(end)
        neighbours[end].add(start)
    # A vertex that is its own neighbour counts twice, as both ends of the edge.
    around = [
        sum(((1 + (j == i)) * points[j] for j in neighbours[i]), np.zeros(3)) for i in range(60)
    ]
    expected = sorted(range(60), key=lambda i: (*points[i], *around[i], i))
    assert order_by_place(mesh).tolist() == expected


@pytest.mark.parametrize("largest", [canonical.LARGEST_KEY, 0])
@pytest.mark.parametrize("mirrored", [False, True])
def test_faces_are_sorted_from_their_smallest_corner(
    largest: int, mirrored: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(canonical, "LARGEST_KEY", largest)  # 0 as for a huge mesh
    mesh = bumpy_sphere(2)
    order = np.random.default_rng(1).permutation(mesh.n_vertices)
    place = {vertex: number for number, vertex in enumerate(order.tolist())}
    faces = []
    for a, b, c in mesh.faces.tolist():
        new = [place[a], place[c], place[b]] if mirrored else [place[a], place[b], place[c]]
        first = new.index(min(new))
        faces.append(new[first:] + new[:first])
    assert_array_equal(reordered(mesh, order, mirrored=mirrored).faces, sorted(faces))
