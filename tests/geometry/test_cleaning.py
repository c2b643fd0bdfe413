"""Cleaning repairs what it says it repairs, in any unit, and nothing else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bumpy_sphere,
    icosphere,
    octahedron,
    rectangle,
    renumbered,
    scaled,
    tetrahedron,
    translated,
    triangle_soup,
    union,
)
from workers.errors import InvalidMeshError
from workers.geometry import cleaning, degenerate
from workers.geometry import mesh as mesh_module
from workers.geometry.cleaning import (
    _merged_soup,
    _merged_vertices,
    clean,
    without_useless_faces,
)
from workers.geometry.degenerate import degenerate_faces
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import count_components, euler_characteristic


def with_extra(
    mesh: TriangleMesh, vertices: list[list[float]], faces: list[list[int]]
) -> TriangleMesh:
    return TriangleMesh(
        np.concatenate([mesh.vertices, np.reshape(vertices, (-1, 3))]),
        np.concatenate([mesh.faces, np.reshape(faces, (-1, 3))]).astype(np.int64),
    )


def test_a_clean_mesh_is_returned_as_it_is() -> None:
    mesh = bumpy_sphere(2)
    cleaned = clean(mesh)
    assert cleaned.mesh is mesh
    assert cleaned.repairs == ()


def test_a_soup_becomes_the_mesh_it_came_from() -> None:
    mesh = icosphere(2)
    cleaned = clean(triangle_soup(mesh))
    assert cleaned.repairs == (f"merged {3 * 320 - 162:,} duplicate vertices",)
    assert euler_characteristic(cleaned.mesh) == 2
    assert_array_equal(cleaned.mesh.vertices[cleaned.mesh.faces], mesh.vertices[mesh.faces])


@settings(max_examples=25, deadline=None)
@given(exponent=st.floats(-30, 30), seed=st.integers(0, 1000))
def test_vertices_in_nearly_the_same_place_are_merged_in_any_unit(
    exponent: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    soup = triangle_soup(icosphere(1))
    noisy = TriangleMesh(soup.vertices + 1e-11 * rng.normal(size=soup.vertices.shape), soup.faces)
    cleaned = clean(scaled(noisy, 10.0**exponent))
    assert cleaned.mesh.n_vertices == 42


def test_vertices_a_millionth_apart_are_not_merged() -> None:
    mesh = union(octahedron(), translated(octahedron(0.5), (1.5 + 1e-6, 0, 0)))
    assert clean(mesh).mesh.n_vertices == 12


def test_a_far_unreferenced_vertex_does_not_coarsen_the_merging() -> None:
    cleaned = clean(with_extra(octahedron(), [[1e12, 0, 0]], []))
    assert cleaned.repairs == ("dropped 1 unreferenced vertex",)
    assert cleaned.mesh.n_vertices == 6


def test_faces_without_area_are_dropped() -> None:
    bad = with_extra(octahedron(), [[2, 0, 0], [0.5, 0.5, 0.0]], [[0, 0, 2], [0, 1, 6], [0, 2, 7]])
    cleaned = clean(bad)
    assert cleaned.repairs == ("dropped 3 zero-area faces",)
    assert_array_equal(cleaned.mesh.faces, octahedron().faces)


def test_a_needle_too_thin_for_its_cotangents_is_dropped_and_a_thicker_one_kept() -> None:
    for height, n_faces in ((1e-8, 8), (1e-4, 9)):
        needle = with_extra(octahedron(), [[0.5, 0.5, height]], [[0, 2, 6]])
        assert clean(needle).mesh.n_faces == n_faces


def test_repeated_faces_of_either_winding_are_dropped() -> None:
    first = octahedron().faces[0]
    bad = with_extra(
        octahedron(), [], [first.tolist(), first[::-1].tolist(), np.roll(first, 1).tolist()]
    )
    cleaned = clean(bad)
    assert cleaned.repairs == ("dropped 3 duplicate faces",)
    assert_array_equal(cleaned.mesh.faces, octahedron().faces)


def test_debris_below_a_ten_thousandth_is_left_out_and_its_share_named() -> None:
    ball = icosphere(2)
    for size, n_components in ((0.009, 1), (0.012, 2)):  # areas of 0.008 % and 0.014 %
        cleaned = clean(union(ball, translated(scaled(ball, size), (5, 0, 0))))
        assert count_components(cleaned.mesh) == n_components
        said = ("left out 1 fragment, less than 0.01% of the area together",)
        assert cleaned.repairs == (said if n_components == 1 else ())


def test_specks_that_are_one_per_cent_together_are_no_debris() -> None:
    for count, kept in ((100, 1), (400, 401)):  # about 0.5 % and 2 % of the area
        specks = [translated(scaled(octahedron(), 0.012), (3, 0, 0.1 * i)) for i in range(count)]
        cleaned = clean(union(icosphere(2), *specks))
        assert count_components(cleaned.mesh) == kept
        assert clean(cleaned.mesh).mesh is cleaned.mesh


def test_equal_parts_are_all_kept() -> None:
    balls = [translated(octahedron(), (3.0 * i, 0, 0)) for i in range(300)]
    assert clean(union(*balls)).mesh.n_faces == 300 * 8


def test_all_repairs_are_said_in_their_order() -> None:
    soup = triangle_soup(icosphere(1))
    speck = translated(scaled(tetrahedron(), 0.001), (3, 0, 0))
    bad = with_extra(union(soup, speck), [[9, 9, 9]], [[0, 0, 1], [0, 1, 2]])
    assert clean(bad).repairs == (
        "dropped 1 unreferenced vertex",
        "merged 198 duplicate vertices",
        "dropped 1 zero-area face",
        "dropped 1 duplicate face",
        "left out 1 fragment, less than 0.01% of the area together",
    )


def test_cleaning_twice_changes_nothing() -> None:
    once = clean(union(triangle_soup(bumpy_sphere(1)), octahedron())).mesh
    assert clean(once).mesh is once


def test_the_numbering_does_not_matter() -> None:
    mesh = union(triangle_soup(bumpy_sphere(1)), translated(octahedron(), (9, 0, 0)))
    copy, _ = renumbered(mesh, np.random.default_rng(3))
    first, second = clean(mesh), clean(copy)
    assert first.repairs == second.repairs
    assert_allclose(first.mesh.area, second.mesh.area, rtol=1e-12)


def test_the_order_of_vertices_and_faces_is_kept() -> None:
    mesh = rectangle(3, 3)  # its first face is 0 1 5
    doubled = with_extra(mesh, [mesh.vertices[0].tolist()], [[16, 1, 5]])
    cleaned = clean(doubled)
    assert cleaned.repairs == ("merged 1 duplicate vertex", "dropped 1 duplicate face")
    assert_array_equal(cleaned.mesh.vertices, mesh.vertices)
    assert_array_equal(cleaned.mesh.faces, mesh.faces)


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ([[0, 1, 99]], "face 0 refers to vertex 99, but the mesh has 6 vertices"),
        ([[0, 1, 2], [-1, 1, 2]], "face 1 refers to vertex -1, but the mesh has 6 vertices"),
        ([], r"the mesh has no faces \(6 points\)"),
        ([[0, 2, 4]] * 9, "1 face left after cleaning, but a shape needs at least 4"),
        ([[0, 0, 4]] * 9, "0 faces left after cleaning"),
    ],
)
def test_what_cannot_be_repaired_is_refused(faces: list[list[int]], message: str) -> None:
    mesh = TriangleMesh(octahedron().vertices, np.reshape(faces, (-1, 3)).astype(np.int64))
    with pytest.raises(InvalidMeshError, match=message):
        clean(mesh)


def test_a_mesh_in_one_point_is_refused() -> None:
    with pytest.raises(InvalidMeshError, match="all 6 vertices lie in one point"):
        clean(TriangleMesh(np.ones((6, 3)), octahedron().faces))


def test_useless_faces_of_a_step_are_removed_with_their_vertices() -> None:
    bad = with_extra(octahedron(), [[0.5, 0.5, 0.0]], [[0, 2, 6], [4, 2, 0]])
    assert_array_equal(without_useless_faces(bad).faces, octahedron().faces)
    assert without_useless_faces(bad).n_vertices == 6
    mesh = octahedron()
    assert without_useless_faces(mesh) is mesh


@st.composite
def dirty_meshes(draw: st.DrawFn) -> TriangleMesh:
    """Meshes with vertices in the same or nearly the same place, needles, repeats and specks."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(st.integers(5, 60))
    vertices = rng.integers(0, draw(st.integers(1, 8)), size=(n, 3)).astype(np.float64)
    noise = draw(st.sampled_from([0.0, 1e-10, 1e-9, 1e-8, 1e-6, 1e-5]))
    vertices += noise * rng.normal(size=(n, 3))
    vertices[: n // 4] *= draw(st.sampled_from([1.0, 1e-3, 1e3]))
    faces = rng.integers(0, n, size=(draw(st.integers(5, 150)), 3))
    return TriangleMesh(vertices, faces)


@settings(max_examples=300, deadline=None)
@given(mesh=dirty_meshes())
def test_cleaning_again_changes_nothing_whatever_was_wrong(mesh: TriangleMesh) -> None:
    try:
        once = clean(mesh).mesh
    except InvalidMeshError:
        return
    again = clean(once)
    assert again.mesh is once
    assert again.repairs == ()


@settings(max_examples=100, deadline=None)
@given(mesh=dirty_meshes(), exponent=st.integers(-100, 100))
def test_the_unit_does_not_matter_to_the_last_bit(mesh: TriangleMesh, exponent: int) -> None:
    """A power of two changes no digit of the coordinates, so it changes no decision."""
    unit = 2.0**exponent
    try:
        expected = clean(mesh)
    except InvalidMeshError:
        with pytest.raises(InvalidMeshError):
            clean(scaled(mesh, unit))
        return
    found = clean(scaled(mesh, unit))
    assert found.repairs == expected.repairs
    assert_array_equal(found.mesh.vertices, unit * expected.mesh.vertices)
    assert_array_equal(found.mesh.faces, expected.mesh.faces)


def faces_as_a_set(mesh: TriangleMesh) -> set[frozenset[tuple[float, ...]]]:
    """Each face as the places of its corners, whatever their order and numbers."""
    return {frozenset(map(tuple, corners)) for corners in mesh.vertices[mesh.faces].tolist()}


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32), size=st.integers(2, 9))
def test_no_numbering_leaves_other_faces(seed: int, size: int) -> None:
    """On a grid, so that vertices in one place are in exactly one place."""
    rng = np.random.default_rng(seed)
    vertices = rng.integers(0, size, size=(60, 3)).astype(np.float64)
    faces = rng.integers(0, 60, size=(90, 3))
    # Corners in the order of their places: of repeated faces of two windings the first is kept.
    order = np.argsort(np.einsum("mik,k->mi", vertices[faces], [100.0, 10.0, 1.0]), axis=1)
    mesh = TriangleMesh(vertices, np.take_along_axis(faces, order, axis=1))
    shuffled, _ = renumbered(mesh, rng)
    first, second = clean(mesh), clean(shuffled)
    assert first.repairs == second.repairs
    assert faces_as_a_set(first.mesh) == faces_as_a_set(second.mesh)


@pytest.mark.parametrize("steps", [2, 6, 10**9])
def test_equal_vertices_are_merged_first_with_the_same_result(steps: int) -> None:
    rng = np.random.default_rng(steps)
    points = rng.integers(-steps, steps, size=(500, 3)) / 7.0
    vertices = np.concatenate([points, points[::3], points + 1e-12, -0.0 * points[:4]])
    vertices = vertices[rng.permutation(len(vertices))]
    for found, expected in zip(
        _merged_soup(vertices, 1e-9), _merged_vertices(vertices, 1e-9), strict=True
    ):
        assert_array_equal(found, expected)


def test_vertices_that_share_a_number_by_chance_are_not_merged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cleaning, "MIXER", np.uint64(0))  # all have the same number
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 1, 0], [1, 0, 0]])
    merged, representatives = _merged_soup(points, 1e-9)
    assert merged.tolist() == [0, 1, 0, 2, 1]
    assert representatives.tolist() == [0, 1, 3]


def test_a_soup_is_cleaned_to_the_mesh_that_it_was() -> None:
    mesh = bumpy_sphere(3)
    cleaned = clean(triangle_soup(mesh)).mesh
    assert cleaned.n_vertices == mesh.n_vertices
    assert_array_equal(cleaned.vertices[cleaned.faces], mesh.vertices[mesh.faces])


def test_areas_do_not_depend_on_how_many_faces_are_measured_at_a_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mesh = bumpy_sphere(3)
    flat = mesh.vertices.copy()
    flat[::2, 1:] *= 1e-7  # every other vertex near one line
    thin = TriangleMesh(flat, mesh.faces)
    expected = thin.face_areas, thin.face_normals, degenerate_faces(thin.vertices, thin.faces)
    for module in (degenerate, mesh_module):
        monkeypatch.setattr(module, "AT_A_TIME", 100)
    found = thin.face_areas, thin.face_normals, degenerate_faces(thin.vertices, thin.faces)
    for one, other in zip(found, expected, strict=True):
        assert_array_equal(one, other)
    assert 0 < expected[2].sum() < mesh.n_faces
