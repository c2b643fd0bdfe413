"""Seams are closed where two edges were one, and nothing else is sewn."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    box,
    bumpy_sphere,
    cylinder,
    rectangle,
    renumbered,
    rotated,
    scaled,
    tetrahedron,
    torus,
    translated,
    triangle_soup,
    union,
)
from workers.geometry.arrays import BoolArray
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import boundary_edges, boundary_loops, count_components

BODY = bumpy_sphere(3)
SIZE = float(np.linalg.norm(np.ptp(BODY.vertices, axis=0)))


def cut(mesh: TriangleMesh, first: BoolArray) -> TriangleMesh:
    """Some faces and the others, without common vertices."""
    parts = [TriangleMesh(mesh.vertices, mesh.faces[chosen]) for chosen in (first, ~first)]
    return union(*[triangle_set(part) for part in parts])


def triangle_set(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh without vertices that no face has."""
    used, faces = np.unique(mesh.faces, return_inverse=True)
    return TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3))


def in_two(gap: float) -> TriangleMesh:
    """The body, cut in two parts that are some share of its size apart."""
    first = BODY.vertices[BODY.faces].mean(axis=1)[:, 0] > 0.1
    halves = cut(BODY, first)
    upper = np.arange(halves.n_vertices) <= halves.faces[: first.sum()].max()
    vertices = halves.vertices.copy()
    vertices[upper] += gap * SIZE * np.array([0.6, 0.0, 0.8])
    return TriangleMesh(vertices, halves.faces)


def jittered(mesh: TriangleMesh, share: float, seed: int = 5) -> TriangleMesh:
    """Separate triangles, each corner moved by up to a share of the body's size."""
    soup = triangle_soup(mesh)
    noise = np.random.default_rng(seed).uniform(-1.0, 1.0, soup.vertices.shape) / np.sqrt(3.0)
    return TriangleMesh(soup.vertices + share * SIZE * noise, soup.faces)


def with_lips(width: float, *, taper: bool) -> TriangleMesh:
    """A flat sheet with a slit of some width in its middle, pointed or as wide all along."""
    sheet = rectangle(20, 20)
    columns, rows = np.divmod(np.arange(21 * 21), 21)[::-1]
    lips = np.flatnonzero((rows == 10) & (columns > 4) & (columns < 16))
    vertices = np.concatenate([sheet.vertices, sheet.vertices[lips]])
    faces = sheet.faces.copy()
    upper = sheet.vertices[faces].mean(axis=1)[:, 1] > 0.5
    to = np.arange(len(sheet.vertices))
    to[lips] = len(sheet.vertices) + np.arange(len(lips))
    faces[upper] = to[faces[upper]]
    profile = 1.0 - (2.0 * vertices[lips, 0] - 1.0) ** 2 * 3.0 if taper else 1.0
    vertices[to[lips], 1] += width * np.sqrt(2.0) * profile
    return TriangleMesh(vertices, faces)


@pytest.mark.parametrize("gap", [3e-9, 2e-8, 1e-7, 3e-6, 1e-5, 5e-5, 9e-5])
def test_a_seam_between_two_parts_is_welded(gap: float) -> None:
    cleaned = clean(in_two(gap))
    assert cleaned.mesh.n_vertices == BODY.n_vertices
    assert cleaned.mesh.n_faces == BODY.n_faces
    assert boundary_loops(cleaned.mesh) == []
    assert count_components(cleaned.mesh) == 1
    assert len(cleaned.repairs) == 1
    assert f"at most {gap:.0e} of the size apart" in cleaned.repairs[0]


def test_parts_farther_apart_stay_two() -> None:
    mesh = in_two(1e-3)
    assert clean(mesh).mesh is mesh


@pytest.mark.parametrize("share", [1e-8, 2e-7, 2e-6, 2e-5])
def test_triangles_with_corners_of_their_own_become_the_surface(share: float) -> None:
    cleaned = clean(jittered(BODY, share))
    assert cleaned.mesh.n_vertices == BODY.n_vertices
    assert boundary_loops(cleaned.mesh) == []
    assert_allclose(cleaned.mesh.area, BODY.area, rtol=1e-3)


@pytest.mark.parametrize("share", [0.02, 0.5, 1.0])
@pytest.mark.parametrize("offset", [0.0, 100.0, 10_000.0])
def test_corners_one_step_of_single_precision_off_are_welded(share: float, offset: float) -> None:
    soup = triangle_soup(translated(BODY, (offset, -offset, 0.5 * offset)))
    rng = np.random.default_rng(7)
    single = soup.vertices.astype(np.float32)
    off = rng.random(single.shape) < share
    single[off] = np.nextafter(single[off], np.float32(rng.choice([-np.inf, np.inf])))
    cleaned = clean(TriangleMesh(single.astype(np.float64), soup.faces))
    assert cleaned.mesh.n_vertices == BODY.n_vertices
    assert boundary_loops(cleaned.mesh) == []


@pytest.mark.parametrize("decimals", [3, 4, 5])
def test_the_last_decimal_may_differ(decimals: int) -> None:
    soup = triangle_soup(BODY)
    rng = np.random.default_rng(7)
    rounded = np.round(soup.vertices, decimals)
    off = rng.random(len(rounded)) < 0.02
    rounded[off] += 10.0**-decimals * rng.choice([-1.0, 0.0, 1.0], size=(off.sum(), 3))
    cleaned = clean(TriangleMesh(np.round(rounded, decimals), soup.faces))
    assert cleaned.mesh.n_vertices == BODY.n_vertices
    assert boundary_loops(cleaned.mesh) == []


def test_a_seam_that_ends_in_a_boundary_is_welded() -> None:
    tube = cylinder(24, 12)
    halves = cut(tube, tube.vertices[tube.faces].mean(axis=1)[:, 0] > 0.1)
    vertices = halves.vertices + 1e-6 * (np.arange(halves.n_vertices) % 3)[:, None]
    mesh = clean(TriangleMesh(vertices, halves.faces)).mesh
    assert mesh.n_vertices == tube.n_vertices
    assert len(boundary_loops(mesh)) == 2


@pytest.mark.parametrize("width", [3e-5, 1e-4, 3e-4, 1e-3])
@pytest.mark.parametrize("taper", [False, True])
def test_lips_are_not_sewn(width: float, taper: bool) -> None:
    mesh = with_lips(width, taper=taper)
    cleaned = clean(mesh)
    assert cleaned.mesh is mesh
    assert len(boundary_loops(mesh)) == 2


@pytest.mark.parametrize("gap", [1e-7, 1e-6, 1e-5, 1e-4])
def test_sheets_on_each_other_are_not_sewn(gap: float) -> None:
    lower = rectangle(6, 6)
    upper = translated(lower, (0.0, 0.0, gap))
    for faces in (upper.faces, upper.faces[:, ::-1]):
        mesh = union(lower, TriangleMesh(upper.vertices, faces))
        assert len(boundary_edges(clean(mesh).mesh)) in (24, 48)  # one of both, or both


@pytest.mark.parametrize("gap", [1e-7, 1e-6, 1e-5, 1e-4])
def test_a_folded_sheet_is_not_sewn(gap: float) -> None:
    sheet = rectangle(20, 10, 2.0, 1.0)
    x, y, _ = sheet.vertices.T
    folded = np.stack([1.0 - np.abs(1.0 - x), y, gap * np.maximum(x - 1.0, 0.0)], axis=1)
    mesh = TriangleMesh(folded, sheet.faces)
    cleaned = clean(mesh)
    assert not any("welded" in repair for repair in cleaned.repairs)


@pytest.mark.parametrize("gap", [1e-7, 1e-6, 1e-5, 1e-4])
def test_walls_beside_each_other_are_not_sewn(gap: float) -> None:
    """Open boxes: their rims run against each other, and the walls lie on each other."""
    tub = TriangleMesh(box().vertices, box().faces[[0, 1, 4, 5, 6, 7, 8, 9, 10, 11]])
    both = union(tub, translated(tub, (1.0 + gap, 0.0, 0.0)))
    cleaned = clean(both)
    assert count_components(cleaned.mesh) == 2
    assert cleaned.mesh is both


@pytest.mark.parametrize("gap", [1e-7, 1e-6, 1e-5])
def test_corners_that_touch_are_not_sewn(gap: float) -> None:
    one = rectangle(5, 5)
    both = union(one, translated(one, (1.0 + gap, 1.0 + gap, 0.0)))
    assert clean(both).mesh is both


def test_closed_bodies_beside_each_other_are_left_alone() -> None:
    both = union(box(), translated(box(), (1.0 + 1e-7, 0.0, 0.0)))
    assert clean(both).mesh is both


@pytest.mark.parametrize("seed", range(5))
def test_tiny_faces_do_not_collapse(seed: int) -> None:
    """Open patches of the size of the gaps: welding would make points of them."""
    rng = np.random.default_rng(seed)
    dust = [translated(scaled(rectangle(2, 2), 1e-5), tuple(rng.random(3))) for _ in range(5)]
    mesh = union(rectangle(10, 10), *dust)
    cleaned = clean(mesh)
    assert not any("welded" in repair for repair in cleaned.repairs)


def with_junctions(mesh: TriangleMesh, share: float, chain: int, seed: int = 1) -> TriangleMesh:
    """The mesh with vertices inserted in one of the two faces of some edges, at least of one."""
    rng = np.random.default_rng(seed)
    vertices, faces = list(mesh.vertices), []
    for a, b, c in mesh.faces.tolist():
        if rng.random() >= share and (a, b, c) != tuple(mesh.faces[2]):
            faces.append([a, b, c])
            continue
        places = np.sort(rng.uniform(0.05, 0.95, chain))
        path = [a, *range(len(vertices), len(vertices) + chain), b]
        vertices += [(1 - t) * mesh.vertices[a] + t * mesh.vertices[b] for t in places]
        faces += [[path[i], path[i + 1], c] for i in range(chain + 1)]
    return TriangleMesh(np.array(vertices), np.array(faces))


def sorted_faces(mesh: TriangleMesh) -> list[list[list[float]]]:
    """The corners' positions of each face."""
    return sorted(sorted(corners) for corners in mesh.vertices[mesh.faces].tolist())


@pytest.mark.parametrize("chain", [1, 2, 5])
@pytest.mark.parametrize("share", [0.002, 0.05, 0.3, 1.0])
def test_vertices_that_only_divide_an_edge_are_taken_out(share: float, chain: int) -> None:
    mesh = with_junctions(BODY, share, chain)
    cleaned = clean(mesh)
    assert boundary_loops(cleaned.mesh) == []
    assert_allclose(cleaned.mesh.area, BODY.area, rtol=1e-9)
    assert cleaned.mesh.n_vertices == BODY.n_vertices
    assert sorted_faces(cleaned.mesh) == sorted_faces(BODY)
    n_taken = mesh.n_vertices - BODY.n_vertices
    assert cleaned.repairs[0].startswith(f"took out {n_taken:,} ")
    assert clean(cleaned.mesh).mesh is cleaned.mesh


def test_edges_are_split_where_a_vertex_has_three_faces() -> None:
    """A coarse sheet beside a fine one: two vertices of the fine one lie on edges of the coarse."""
    coarse, fine = rectangle(3, 1), rectangle(6, 2)
    mesh = clean(union(coarse, translated(fine, (0.0, 1.0, 0.0)))).mesh
    assert mesh.n_vertices == coarse.n_vertices + fine.n_vertices - 4
    assert len(boundary_loops(mesh)) == 1
    assert clean(mesh).mesh is mesh


def test_junctions_of_separate_triangles_in_single_precision_are_closed() -> None:
    mesh = with_junctions(BODY, 0.3, 2)
    soup = triangle_soup(TriangleMesh(mesh.vertices.astype(np.float32), mesh.faces))
    assert boundary_loops(clean(soup).mesh) == []


def test_bricks_are_split_on_both_sides() -> None:
    """Rows of other widths: vertices of either side lie on edges of the other."""
    rows = [translated(rectangle(n, 1, 6.0, 1.0), (0, i, 0)) for i, n in enumerate((2, 3, 4, 1))]
    wall = union(*rows)
    mesh = clean(wall).mesh
    assert count_components(mesh) == 1
    assert len(boundary_loops(mesh)) == 1
    assert_allclose(mesh.area, 24.0)


def test_a_thousand_vertices_on_one_edge() -> None:
    long, fine = rectangle(1, 1), rectangle(1000, 1)
    mesh = clean(union(long, translated(fine, (0.0, 1.0, 0.0)))).mesh
    assert count_components(mesh) == 1
    assert len(boundary_loops(mesh)) == 1


def test_vertices_on_a_boundary_that_nothing_continues_are_left_alone() -> None:
    one = rectangle(2, 2)
    flag = translated(rectangle(3, 2, 0.5, 0.5), (1.0 + 1e-8, 0.2, 0.0))
    mesh = union(one, flag)
    assert clean(mesh).mesh is mesh


def broken(seed: int) -> TriangleMesh:
    """The body, or part of it, in a few parts, some corners moved, some edges split."""
    rng = np.random.default_rng(seed)
    base = (BODY, torus(16, 10), cylinder(12, 8), tetrahedron())[seed % 4]
    mesh = with_junctions(base, rng.choice([0.0, 0.03, 0.3]), int(rng.integers(1, 4)), seed)
    soup = triangle_soup(mesh)
    moved = rng.random(soup.n_vertices) < rng.choice([0.02, 0.5, 1.0])
    vertices = soup.vertices.copy()
    noise = 10.0 ** rng.uniform(-9.0, -4.5)
    vertices[moved] += noise * rng.normal(size=(moved.sum(), 3))
    return TriangleMesh(vertices, soup.faces)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_cleaning_again_changes_nothing(seed: int) -> None:
    once = clean(broken(seed)).mesh
    assert clean(once).mesh is once


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), exponent=st.integers(-80, 80))
def test_a_power_of_two_changes_no_decision(seed: int, exponent: int) -> None:
    mesh = broken(seed)
    first, second = clean(mesh), clean(scaled(mesh, 2.0**exponent))
    assert first.repairs == second.repairs
    assert_array_equal(second.mesh.vertices, 2.0**exponent * first.mesh.vertices)
    assert_array_equal(second.mesh.faces, first.mesh.faces)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_numbering_changes_no_decision(seed: int) -> None:
    """But for the positions of vertices that were merged: the first one's, of any nearly alike."""
    mesh = broken(seed)
    copy, _ = renumbered(mesh, np.random.default_rng(seed))
    first, second = clean(mesh), clean(copy)
    assert [said.split()[:3] for said in first.repairs] == [
        said.split()[:3] for said in second.repairs
    ]
    assert first.mesh.n_vertices == second.mesh.n_vertices
    assert len(boundary_edges(first.mesh)) == len(boundary_edges(second.mesh))
    assert_allclose(first.mesh.area, second.mesh.area, rtol=1e-8)


@pytest.mark.parametrize("seed", range(6))
def test_rotation_changes_no_seam(seed: int) -> None:
    mesh = in_two(10.0 ** -(4.5 + 0.5 * seed))
    turned = rotated(scaled(mesh, 3.7), np.random.default_rng(seed))
    assert clean(mesh).repairs == clean(turned).repairs
