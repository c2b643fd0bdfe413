"""The law of each family of transformations, and the numbers of the table."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse.csgraph import dijkstra

from tests.meshes import bumpy_sphere, icosphere, torus, translated, union
from workers.creatures import make_creature
from workers.geometry.arrays import FloatArray
from workers.geometry.edges import length_graph, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import compute_spectrum, first_eigenvalues
from workers.geometry.topology import (
    boundary_edges,
    boundary_loops,
    count_components,
    euler_characteristic,
)
from workers.rendering.rasterising import rasterise
from workers.transformations import STRENGTHS, elasticity, transform
from workers.transformations.elasticity import ElasticSurface
from workers.transformations.metric import mean_edge
from workers.transformations.resampling import decimated
from workers.transformations.strengths import TABLE
from workers.transformations.visibility import seen_faces


@cache
def human() -> TriangleMesh:
    """A small creature with limbs, made once."""
    return make_creature("human", seed=0, vertices=2000).rest


def lengths(mesh: TriangleMesh) -> FloatArray:
    """Lengths of all edges, (e,)."""
    ends = mesh.vertices[undirected_edges(mesh)]
    return np.asarray(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1), dtype=np.float64)


def test_bending_keeps_lengths_and_moves_farther_with_strength() -> None:
    mesh = human()
    moved, strains = [], []
    for strength in STRENGTHS:
        bent = [transform(mesh, "isometry", strength, seed=seed).mesh for seed in range(3)]
        strains += [np.abs(lengths(one) / lengths(mesh) - 1.0) for one in bent]
        moved.append(
            np.mean([np.linalg.norm(b.vertices - mesh.vertices, axis=1).max() for b in bent])
        )
    assert max(np.median(strain) for strain in strains) <= 0.03
    assert max(np.percentile(strain, 90) for strain in strains) <= 0.15
    assert moved[0] < moved[2] < moved[4]  # of three seeds; the angles are drawn
    assert moved[4] > 0.15 * np.sqrt(mesh.area)


def test_bending_keeps_the_spectrum_and_folds_nothing() -> None:
    mesh = human()
    bent = transform(mesh, "isometry", 5, seed=1).mesh
    assert_allclose(first_eigenvalues(bent, 8), first_eigenvalues(mesh, 8), rtol=0.05)
    assert bent.face_areas.min() > 0.1 * mesh.face_areas.min()


def test_bending_takes_all_components_along() -> None:
    ball = icosphere(2, radius=0.05)
    head = human().vertices[np.argmax(human().vertices[:, 1])]
    mesh = union(human(), translated(ball, tuple(head + np.array([0.0, 0.06, 0.0]))))
    bent = transform(mesh, "isometry", 5, seed=2).mesh
    gap = mesh.vertices[human().n_vertices :].mean(axis=0) - head
    now = bent.vertices[human().n_vertices :].mean(axis=0)
    now = now - bent.vertices[np.argmax(human().vertices[:, 1])]
    assert_allclose(np.linalg.norm(now), np.linalg.norm(gap), rtol=0.2)


def test_a_large_mesh_follows_a_coarse_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(elasticity, "LARGEST_SOLVED", 3_000)
    monkeypatch.setattr(elasticity, "COARSE", 1_500)
    mesh = torus(100, 40)  # 4,000 vertices
    for name in ("isometry", "local-scale"):
        found = transform(mesh, name, 2, seed=0).mesh
        assert found.n_vertices == mesh.n_vertices
        jump = lengths(found) / lengths(mesh)
        assert 0.4 < jump.min() < jump.max() < 2.5


def test_an_elastic_surface_takes_up_what_can_be_had() -> None:
    mesh = bumpy_sphere(3)
    surface = ElasticSurface(mesh)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn[:, 0] *= np.linalg.det(turn)
    for linear in (turn, 2.5 * np.eye(3)):
        places = surface.positions(np.tile(linear, (mesh.n_vertices, 1, 1)))
        centred = mesh.vertices - mesh.vertices.mean(axis=0)
        assert_allclose(places - places.mean(axis=0), centred @ linear.T, atol=1e-9)
    rotations = surface.rotations(mesh.vertices @ turn.T)
    assert_allclose(rotations, np.tile(turn, (mesh.n_vertices, 1, 1)), atol=1e-9)


def test_welding_makes_handles_and_keeps_the_area() -> None:
    for mesh in (human(), bumpy_sphere(3), torus(40, 20)):
        before = []
        for strength in STRENGTHS:
            welded = transform(mesh, "topology", strength, seed=0)
            change = euler_characteristic(mesh) - euler_characteristic(welded.mesh)
            handles = change // 2
            assert change == 2 * handles > 0
            assert welded.mesh.n_vertices == mesh.n_vertices - 3 * handles
            assert welded.mesh.n_faces == mesh.n_faces - 2 * handles
            assert len(boundary_edges(welded.mesh)) == 0
            assert_allclose(welded.mesh.area, mesh.area, rtol=0.15)
            before.append(handles)
        assert before[4] >= before[0]
        assert before[4] >= TABLE["topology"]["fewest welds"][4]


def test_parts_that_touch_are_welded_first() -> None:
    mesh = union(icosphere(3), translated(icosphere(3), (2.02, 0.0, 0.0)))
    welded = transform(mesh, "topology", 1, seed=0)
    assert count_components(welded.mesh) == 1
    moved = np.linalg.norm(welded.mesh.vertices - mesh.vertices[welded.origin], axis=1)
    assert_allclose(welded.mesh.vertices[moved > 0, 0], 1.01, atol=0.02)


def test_holes_leave_the_area_of_the_table() -> None:
    for mesh in (human(), bumpy_sphere(4)):
        for name in ("holes", "micro-holes", "partial"):
            for strength in STRENGTHS:
                left = transform(mesh, name, strength, seed=3).mesh.area / mesh.area
                tolerance = 0.025 if name == "partial" else 0.005  # a plane meets it nearly
                assert_allclose(left, TABLE[name]["area left"][strength - 1], atol=tolerance)


def test_holes_are_as_many_as_discs_and_micro_holes_more() -> None:
    mesh = bumpy_sphere(5)  # 20,480 faces
    holes = transform(mesh, "holes", 1, seed=0).mesh
    tiny = transform(mesh, "micro-holes", 5, seed=0).mesh
    assert 20 <= len(boundary_loops(holes)) <= 40
    assert 150 <= len(boundary_loops(tiny)) <= 260  # 200 discs, whose rims may touch
    assert count_components(tiny) == 1


def test_partial_keeps_one_connected_part() -> None:
    for seed in range(6):
        for strength in (1, 5):
            assert count_components(transform(human(), "partial", strength, seed=seed).mesh) == 1


def test_scaling_multiplies_lengths_and_divides_eigenvalues() -> None:
    mesh = human()
    spectrum = compute_spectrum(mesh, n_eigenpairs=5)
    seen = set()
    for seed in range(8):
        found = transform(mesh, "scale", 4, seed=seed)
        factor = float(np.sqrt(found.mesh.area / mesh.area))
        seen.add(round(factor, 6))
        assert_allclose(found.mesh.vertices, factor * mesh.vertices[found.origin], rtol=1e-12)
        values = compute_spectrum(found.mesh, n_eigenpairs=5).eigenvalues
        assert_allclose(values, spectrum.eigenvalues / factor**2, rtol=1e-6)
    largest = TABLE["scale"]["factor or its inverse"][3]
    assert seen == {round(largest, 6), round(1.0 / largest, 6)}


def test_local_scaling_stays_within_the_factor_and_turns_nothing_over() -> None:
    mesh = human()
    for strength in (1, 3, 5):
        factor = TABLE["local-scale"]["largest local factor or its inverse"][strength - 1]
        found = transform(mesh, "local-scale", strength, seed=0).mesh
        ratios = lengths(found) / lengths(mesh)
        assert np.percentile(ratios, 99) <= 1.1 * factor
        assert np.percentile(ratios, 1) >= 0.9 / factor
        assert np.percentile(ratios, 99) - np.percentile(ratios, 1) > 0.5 * (factor - 1.0)
        turned = np.einsum("ij,ij->i", found.face_normals, mesh.face_normals)
        assert np.mean(turned > 0) > 0.99


def test_affine_maps_are_linear_and_keep_volume() -> None:
    mesh = human()
    for strength in STRENGTHS:
        found = transform(mesh, "affine", strength, seed=1).mesh
        centred, now = (m.vertices - m.vertices.mean(axis=0) for m in (mesh, found))
        linear = np.linalg.lstsq(centred, now, rcond=None)[0]
        assert_allclose(centred @ linear, now, atol=1e-9)
        stretches = np.linalg.svd(linear)[1]
        expected = TABLE["affine"]["longest over shortest axis"][strength - 1]
        assert_allclose([stretches[0] / stretches[2], stretches.prod()], [expected, 1.0])


def test_sampling_leaves_the_share_of_faces_but_about_a_hundred() -> None:
    mesh = bumpy_sphere(5)
    for strength in STRENGTHS:
        share = TABLE["sampling"]["faces left"][strength - 1]
        found = transform(mesh, "sampling", strength, seed=0).mesh
        assert_allclose(found.n_faces, share * mesh.n_faces, rtol=0.05)
        assert_allclose(found.area, mesh.area, rtol=0.02)
    small = transform(bumpy_sphere(3), "sampling", 5, seed=0).mesh  # 2 % would be 26
    assert 80 <= small.n_faces <= 120


def test_a_simplified_vertex_is_near_the_one_it_comes_from() -> None:
    mesh = human()
    found = decimated(mesh, 600)
    gaps = np.linalg.norm(found.mesh.vertices - mesh.vertices[found.origin], axis=1)
    assert gaps.max() < 1.0 * mean_edge(found.mesh)
    graph = length_graph(mesh, undirected_edges(mesh))
    ways = dijkstra(graph, directed=False, indices=found.origin)[:, found.origin]
    ends = undirected_edges(found.mesh)
    ratio = ways[ends[:, 0], ends[:, 1]] / lengths(found.mesh)
    assert np.percentile(ratio, 99) < 2.5  # neighbours come from near along the surface


def test_noise_makes_the_area_grow_alike_at_any_resolution() -> None:
    for mesh in (human(), bumpy_sphere(2), bumpy_sphere(4)):
        for strength in STRENGTHS:
            found = transform(mesh, "noise", strength, seed=0).mesh
            growth = TABLE["noise"]["growth of area"][strength - 1]
            assert_allclose(found.area / mesh.area, growth, rtol=1e-6)
    shifts = transform(human(), "noise", 5, seed=0).mesh.vertices - human().vertices
    assert 0.5 * mean_edge(human()) < shifts.std() < 3.0 * mean_edge(human())


def test_shots_move_few_vertices_far_along_their_normals() -> None:
    mesh = bumpy_sphere(4)  # 2,562 vertices
    for strength in STRENGTHS:
        found = transform(mesh, "shot-noise", strength, seed=0).mesh
        gaps = np.linalg.norm(found.vertices - mesh.vertices, axis=1)
        share = TABLE["shot-noise"]["vertices displaced"][strength - 1]
        farthest = TABLE["shot-noise"]["farthest displacement, √A"][strength - 1]
        farthest *= np.sqrt(mesh.area)
        assert_allclose(np.count_nonzero(gaps), share * mesh.n_vertices, rtol=0.1, atol=1)
        assert gaps.max() <= farthest
        assert gaps[gaps > 0].min() >= 0.5 * farthest


def test_a_view_of_a_ball_is_the_half_in_front() -> None:
    ball = icosphere(4)
    for seed in range(3):
        seen = transform(ball, "view", 1, seed=seed).mesh
        middle = seen.vertices.mean(axis=0)
        direction = middle / np.linalg.norm(middle)
        grazing = np.cos(np.radians(TABLE["view"]["most grazing angle, degrees"][0]))
        assert (seen.vertices @ direction).min() > grazing - 0.15
        assert_allclose(seen.area / ball.area, 0.5 * (1.0 - grazing), atol=0.03)


def test_a_view_leaves_out_what_something_hides() -> None:
    near, far = icosphere(3), translated(icosphere(3, radius=0.5), (0.0, 0.0, -3.0))
    pair = union(near, far)
    from_above = seen_faces(pair, np.array([0.0, 0.0, 1.0]))
    from_below = seen_faces(pair, np.array([0.0, 0.0, -1.0]))
    assert not from_above[near.n_faces :].any()
    assert_allclose(np.mean(from_below[near.n_faces :]), 0.5, atol=0.05)
    half, rest = np.mean(from_above[: near.n_faces]), np.mean(from_below[: near.n_faces])
    assert_allclose([half, rest], [0.5, 0.5 - 0.067], atol=0.05)  # less the cap that is hidden


def test_a_picture_from_the_same_side_shows_no_face_that_was_left_out() -> None:
    ball = icosphere(3)
    half = transform(ball, "view", 1, seed=0)
    direction = half.mesh.vertices.mean(axis=0)
    direction = direction / np.linalg.norm(direction)
    right = np.linalg.svd(direction[None])[2][1]
    axes = np.stack([right, np.cross(direction, right), direction], axis=1)
    screen = 100.0 + 90.0 * ball.vertices @ axes
    nearest, _ = rasterise(screen, ball.faces, 200)
    shown = np.unique(nearest[nearest >= 0])
    kept = {tuple(face) for face in half.origin[half.mesh.faces].tolist()}
    steep = np.abs(ball.face_normals[shown] @ direction) > 0.3 * np.linalg.norm(
        ball.face_normals[shown], axis=1
    )
    assert {tuple(face) for face in ball.faces[shown[steep]].tolist()} <= kept


@pytest.mark.parametrize("name", ["holes", "noise", "topology", "isometry"])
def test_arguments_are_never_changed(name: str) -> None:
    mesh = bumpy_sphere(3)
    vertices, faces = mesh.vertices.copy(), mesh.faces.copy()
    transform(mesh, name, 5, seed=0)
    assert_array_equal(mesh.vertices, vertices)
    assert_array_equal(mesh.faces, faces)
