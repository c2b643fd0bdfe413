"""A few broken coordinates cost a few faces, not the whole file."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from tests.meshes import bumpy_sphere, icosphere, renumbered, scaled, translated, union
from workers.errors import InvalidMeshError
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import count_components

BODY = bumpy_sphere(2)


def with_face(mesh: TriangleMesh, corners: list[list[float]]) -> TriangleMesh:
    """The mesh and one more face with corners of its own."""
    face = np.arange(3) + mesh.n_vertices
    return TriangleMesh(np.concatenate([mesh.vertices, corners]), np.append(mesh.faces, face))


def with_vertex(mesh: TriangleMesh, vertex: int, place: list[float]) -> TriangleMesh:
    """The mesh with one of its vertices moved."""
    vertices = mesh.vertices.copy()
    vertices[vertex] = place
    return TriangleMesh(vertices, mesh.faces)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_face_that_is_not_finite_is_left_out(value: float) -> None:
    cleaned = clean(with_face(BODY, [[0, 0, 0], [value, 0, 0], [0, 1, 0]]))
    assert cleaned.repairs == ("left out 1 face (0.31 % of all) at vertices that are not finite",)
    assert_array_equal(cleaned.mesh.vertices, BODY.vertices)
    assert_array_equal(cleaned.mesh.faces, BODY.faces)


def test_what_hangs_on_a_vertex_that_is_not_finite_is_left_out() -> None:
    cleaned = clean(with_vertex(BODY, 40, [np.nan, 0, 0]))
    degree = int((BODY.faces == 40).sum())
    assert cleaned.mesh.n_faces == BODY.n_faces - degree
    assert cleaned.mesh.n_vertices == BODY.n_vertices - 1
    assert cleaned.repairs[0].startswith(f"left out {degree} faces")


def test_vertices_without_faces_may_be_anything() -> None:
    strange = np.array([[np.nan] * 3, [np.inf] * 3, [1e300, 0, 0]])
    cleaned = clean(TriangleMesh(np.concatenate([BODY.vertices, strange]), BODY.faces))
    assert cleaned.repairs == ("dropped 3 unreferenced vertices",)
    assert_array_equal(cleaned.mesh.vertices, BODY.vertices)


def test_more_than_a_tenth_that_is_not_finite_is_refused_with_counts() -> None:
    vertices = BODY.vertices.copy()
    vertices[::10] = np.nan
    hanging = np.isnan(vertices[BODY.faces]).any(axis=(1, 2)).sum()
    with pytest.raises(InvalidMeshError, match=rf"{hanging} of 320 faces have corners that are"):
        clean(TriangleMesh(vertices, BODY.faces))


@pytest.mark.parametrize("distance", [1e6, 1e9, 3.4e37, 1e300])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e5])
def test_a_far_face_of_any_size_is_left_out(distance: float, size: float) -> None:
    corners = distance + size * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    cleaned = clean(with_face(BODY, corners.tolist()))
    assert cleaned.repairs == (
        "left out 1 face (0.31 % of all) 10,000 times as far away as the rest",
    )
    assert_array_equal(cleaned.mesh.faces, BODY.faces)
    assert_array_equal(cleaned.mesh.vertices, BODY.vertices)


def test_faces_with_one_far_corner_are_left_out() -> None:
    cleaned = clean(with_vertex(BODY, 40, [0, -1e9, 0]))
    assert cleaned.mesh.n_vertices == BODY.n_vertices - 1
    assert np.abs(cleaned.mesh.vertices).max() < 10


def test_strays_in_several_places_are_all_left_out() -> None:
    mesh = BODY
    for place in (1e7, -1e12, 1e30):
        mesh = with_face(mesh, [[place, 0, 0], [place, place, 0], [place, 0, 2 * place]])
    assert_array_equal(clean(mesh).mesh.faces, BODY.faces)


@pytest.mark.parametrize("subdivisions", [0, 2, 3])
@pytest.mark.parametrize("size", [1.0, 100.0])
def test_bodies_a_thousand_sizes_apart_stay(subdivisions: int, size: float) -> None:
    other = translated(scaled(icosphere(subdivisions), size), (1000.0, 0, 0))
    cleaned = clean(union(scaled(BODY, size), other))
    assert cleaned.repairs == ()
    assert count_components(cleaned.mesh) == 2


def test_a_shape_far_from_the_origin_stays() -> None:
    mesh = translated(BODY, (4.5e5, 5.2e6, 1e7))
    assert clean(mesh).mesh is mesh


def test_a_fine_part_of_a_coarse_shape_stays() -> None:
    """Most vertices within a ten-thousandth of the size; sizes in between leave no gap."""
    parts = [scaled(icosphere(3 if size < 1e-3 else 1), size) for size in np.logspace(-4, 0, 5)]
    cleaned = clean(union(*[translated(part, (0, 3 * i, 0)) for i, part in enumerate(parts)]))
    assert not any("far away" in repair for repair in cleaned.repairs)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(exponent=st.integers(-60, 60), seed=st.integers(0, 1000), share=st.floats(0.0, 0.01))
def test_neither_unit_nor_numbering_matter(exponent: int, seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    vertices = BODY.vertices.copy()
    broken = rng.random(len(vertices)) < share
    vertices[broken] = rng.choice([np.nan, np.inf, 1e15, -1e12], size=(broken.sum(), 3))
    mesh = TriangleMesh(vertices, BODY.faces)
    other, _ = renumbered(scaled(mesh, 2.0**exponent), rng)
    first, second = clean(mesh), clean(other)
    assert first.repairs == second.repairs
    assert first.mesh.n_faces == second.mesh.n_faces
    assert clean(first.mesh).mesh is first.mesh
