"""Laws of the creatures: closed surfaces, nearly isometric poses, individuals that differ."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import icosphere
from workers.creatures import SPECIES, Creature, make_creature, make_uneven_creature
from workers.creatures.builder import SkeletonBuilder, X, Y, Z
from workers.creatures.clearance import Clearance
from workers.creatures.figure import draw_species
from workers.creatures.implicit import evaluate, extract_surface
from workers.creatures.relaxation import relax
from workers.creatures.skinning import blend, bone_motions
from workers.creatures.slivers import drop_slivers, triangle_quality
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import first_eigenvalues
from workers.geometry.topology import count_components, euler_characteristic
from workers.rendering.render import render
from workers.transformations import transform

SEVERAL = ("human", "horse", "spider", "octopus", "fish", "hand", "chair", "snake")


@cache
def creature_of(species: str, seed: int = 0) -> Creature:
    """A small individual, made once."""
    return make_creature(species, seed=seed, vertices=2500)


@cache
def fine_creature(species: str, *, seed: int, vertices: int) -> Creature:
    """What an uneven creature is simplified from, made once."""
    return make_creature(species, seed=seed, vertices=vertices)


def edge_lengths(mesh: TriangleMesh) -> FloatArray:
    """Lengths of the three edges of each face, (m, 3)."""
    corners = mesh.vertices[mesh.faces]
    lengths: FloatArray = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    return lengths


def unevenness(mesh: TriangleMesh) -> float:
    """Standard deviation of the lengths of edges, as a share of their mean."""
    lengths = edge_lengths(mesh)
    return float(lengths.std() / lengths.mean())


def signed_volume(mesh: TriangleMesh) -> float:
    """Volume inside a closed surface that is wound outwards."""
    return float(np.linalg.det(mesh.vertices[mesh.faces]).sum() / 6.0)


def assert_closed(faces: IntArray) -> None:
    """Each edge has two faces, which run along it in opposite directions."""
    halves = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(halves, axis=0)) == len(halves)
    assert_array_equal(np.unique(halves, axis=0), np.unique(halves[:, ::-1], axis=0))


def one_limb(radii: tuple[float, float], length: float = 1.0) -> SkeletonBuilder:
    """A single capsule along x."""
    body = SkeletonBuilder(np.random.default_rng(0), (0.0, 0.0, 0.0))
    body.limb("limb", "root", [(0, 0, 0), (length, 0, 0)], radii, jitter=0.0)
    return body


def test_there_are_many_species() -> None:
    assert len(set(SPECIES)) == len(SPECIES) >= 28


@pytest.mark.parametrize("species", SPECIES)
def test_every_species_is_one_closed_surface_without_handles(species: str) -> None:
    mesh = creature_of(species).rest
    assert_closed(mesh.faces)
    assert count_components(mesh) == 1
    assert euler_characteristic(mesh) == 2  # limbs that had fused would be handles
    assert signed_volume(mesh) > 0
    assert_array_equal(np.unique(mesh.faces), np.arange(mesh.n_vertices))


@pytest.mark.parametrize("species", SEVERAL)
def test_an_uneven_creature_is_the_same_surface_in_uneven_triangles(
    species: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workers.creatures.uneven.make_creature", fine_creature)
    fine = fine_creature(species, seed=1, vertices=10_000)  # whose thin limbs are as thin
    uneven = make_uneven_creature(species, seed=1, vertices=2500)
    mesh = uneven.rest
    assert_closed(mesh.faces)
    assert count_components(mesh) == 1
    assert euler_characteristic(mesh) == 2
    assert mesh.n_vertices == pytest.approx(2500, rel=0.02)
    assert mesh.area == pytest.approx(fine.rest.area, rel=0.03)
    assert unevenness(mesh) > 0.4 > 0.3 > unevenness(fine.rest)
    assert_array_equal(uneven.posed(3).faces, mesh.faces)
    assert uneven.posed(3).area == pytest.approx(fine.posed(3).area, rel=0.03)


def test_the_same_arguments_give_the_same_uneven_creature() -> None:
    first, again = (make_uneven_creature("human", seed=2, vertices=2000) for _ in range(2))
    assert first.rest.vertices.tobytes() == again.rest.vertices.tobytes()
    assert first.rest.faces.tobytes() == again.rest.faces.tobytes()
    assert first.weights.tobytes() == again.weights.tobytes()


@pytest.mark.parametrize("species", SPECIES)
def test_triangles_are_decent(species: str) -> None:
    mesh = creature_of(species).rest
    quality = triangle_quality(mesh.vertices, mesh.faces)
    assert quality.min() > 0.1  # 1 is equilateral, 0 has no area
    assert np.quantile(quality, 0.01) > 0.5
    assert np.median(quality) > 0.85


@pytest.mark.parametrize("species", SPECIES)
def test_poses_move_the_vertices_and_share_the_faces(species: str) -> None:
    creature = creature_of(species)
    first, second = creature.posed(1), creature.posed(2)
    assert_array_equal(first.faces, creature.rest.faces)
    assert np.isfinite(first.vertices).all()
    size = np.ptp(creature.rest.vertices, axis=0).max()
    for a, b in ((first, creature.rest), (first, second)):
        assert np.linalg.norm(a.vertices - b.vertices, axis=1).max() > 0.03 * size


@pytest.mark.parametrize("species", SPECIES)
def test_poses_keep_lengths_and_area(species: str) -> None:
    creature = creature_of(species)
    for seed in (1, 2):
        pose = creature.posed(seed)
        stretch = edge_lengths(pose) / edge_lengths(creature.rest)
        assert np.median(np.abs(stretch - 1.0)) < 0.06
        assert np.quantile(np.abs(np.log(stretch)), 0.9) < 0.3  # joints fold and stretch
        assert_allclose(pose.area, creature.rest.area, rtol=0.08)
        assert signed_volume(pose) > 0.85 * signed_volume(creature.rest)  # nothing collapses


@pytest.mark.parametrize("species", SEVERAL)
def test_poses_keep_the_first_eigenvalues(species: str) -> None:
    creature = creature_of(species)
    pose = creature.posed(3)
    at_rest = first_eigenvalues(creature.rest, 10) * creature.rest.area
    in_pose = first_eigenvalues(pose, 10) * pose.area
    assert np.median(np.abs(in_pose / at_rest - 1.0)) < 0.04


@pytest.mark.parametrize("species", SEVERAL)
def test_individuals_of_a_species_differ_but_not_by_much(species: str) -> None:
    first, second = creature_of(species), creature_of(species, 1)
    values = [first_eigenvalues(c.rest, 10) * c.rest.area for c in (first, second)]
    differences = np.abs(values[1] / values[0] - 1.0)
    assert differences.max() > 0.002
    assert np.median(differences) < 0.5


@pytest.mark.parametrize("species", ["giraffe", "starfish"])
def test_the_same_seeds_give_the_same_bytes(species: str) -> None:
    first, again = (make_creature(species, seed=5, vertices=2000) for _ in range(2))
    assert first.rest.vertices.tobytes() == again.rest.vertices.tobytes()
    assert first.rest.faces.tobytes() == again.rest.faces.tobytes()
    assert first.posed(3).vertices.tobytes() == again.posed(3).vertices.tobytes()


def test_another_seed_gives_another_pose_and_strength_goes_down_to_rest() -> None:
    creature = creature_of("lizard")
    assert not np.array_equal(creature.posed(0).vertices, creature.posed(1).vertices)
    assert_allclose(creature.posed(0, strength=0.0).vertices, creature.rest.vertices, atol=1e-12)
    moved = [
        np.linalg.norm(creature.posed(0, strength=s).vertices - creature.rest.vertices)
        for s in (0.1, 0.3, 1.0)
    ]
    assert moved == sorted(moved)


@pytest.mark.parametrize("vertices", [2000, 4000, pytest.param(20000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("species", ["dog", "table", "squid"])
def test_the_number_of_vertices_is_about_what_was_asked_for(species: str, vertices: int) -> None:
    mesh = make_creature(species, seed=1, vertices=vertices).rest
    assert_allclose(mesh.n_vertices, vertices, rtol=0.1)
    assert euler_characteristic(mesh) == 2


def test_what_cannot_be_made_is_refused() -> None:
    with pytest.raises(InvalidRequestError, match=r"'unicorn' is unknown.*human.*chair"):
        make_creature("unicorn", seed=0)
    for vertices in (1999, 20001):
        with pytest.raises(InvalidRequestError, match="2000 to 20000"):
            make_creature("dog", seed=0, vertices=vertices)
    with pytest.raises(InvalidRequestError, match="seed is -1"):
        make_creature("dog", seed=-1)
    creature = creature_of("table")
    with pytest.raises(InvalidRequestError, match="seed is -2"):
        creature.posed(-2)
    for strength in (-1.0, np.nan, np.inf):
        with pytest.raises(InvalidRequestError, match="strength"):
            creature.posed(0, strength=strength)


def test_arrays_of_a_creature_are_read_only() -> None:
    creature = creature_of("human")
    for array in (creature.weights, creature.rest.vertices, creature.skeleton.heads):
        assert not array.flags.writeable


@pytest.mark.parametrize("species", SEVERAL)
def test_weights_are_shares(species: str) -> None:
    weights = creature_of(species).weights
    assert weights.min() >= 0.0
    assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)


def test_a_leg_does_not_move_the_other_leg() -> None:
    creature = creature_of("horse")
    feet = creature.rest.vertices[:, 1] < np.quantile(creature.rest.vertices[:, 1], 0.02)
    assert (creature.weights[feet].max(axis=1) > 0.9).all()


@pytest.mark.parametrize("radii", [(0.3, 0.3), (0.2, 0.4)])
def test_a_capsule_has_its_distance_and_area(radii: tuple[float, float]) -> None:
    capsules = one_limb(radii).skeleton().capsules
    sine = radii[0] - radii[1]  # of the cone's slope, over a length of 1
    cosine = np.sqrt(1 - sine**2)
    middle = np.array([[0.5 + 0.5 * sum(radii) * sine, 0.5 * sum(radii) * cosine, 0.0]])
    assert_allclose(evaluate(capsules, middle), 0.0, atol=1e-12)
    assert_allclose(evaluate(capsules, 2 * middle - [[0.5, 0, 0]]), 0.5 * sum(radii), atol=1e-9)
    vertices, faces, spacing = extract_surface(capsules, 3000)
    mesh = TriangleMesh(relax(vertices, faces, lambda p: evaluate(capsules, p), spacing), faces)
    a, b = radii
    caps = 2 * np.pi * (a**2 * (1 + sine) + b**2 * (1 - sine))
    side = np.pi * (a + b) * cosine * cosine
    assert_allclose(mesh.area, caps + side, rtol=0.01)
    assert np.abs(evaluate(capsules, mesh.vertices)).max() < 1e-3


def test_an_ellipsoid_lies_between_its_radii_and_a_box_fills_its_corners() -> None:
    for power, volume in ((2.0, 4 / 3 * np.pi), (8.0, 8.0)):
        body = SkeletonBuilder(np.random.default_rng(0), (0.0, 0.0, 0.0))
        body.blob("root", (1.0, 2.0, 3.0), (0.5, 0.3, 0.2), power=power, jitter=0.0)
        vertices, faces, _ = extract_surface(body.skeleton().capsules, 3000)
        mesh = TriangleMesh(vertices - [1.0, 2.0, 3.0], faces)
        assert_allclose(np.abs(mesh.vertices).max(axis=0), [0.5, 0.3, 0.2], rtol=0.02)
        assert_allclose(signed_volume(mesh), volume * 0.5 * 0.3 * 0.2, rtol=0.07)


def test_a_fin_is_as_thick_as_its_ratio_says_up_to_its_rim() -> None:
    body = SkeletonBuilder(np.random.default_rng(0), (0.0, 0.0, 0.0))
    body.limb("fin", "root", [(0, 0, 0), (1, 0, 0)], (0.4, 0.4), flat=Y, ratio=0.2, jitter=0.0)
    capsules = body.skeleton().capsules
    on_surface = np.array([[0.5, 0.08, 0.0], [0.5, 0.08, 0.31], [0.5, 0.0, 0.4], [1.4, 0.0, 0.0]])
    assert_allclose(evaluate(capsules, on_surface), 0.0, atol=1e-12)


def test_mirrored_bodies_are_symmetric() -> None:
    body = one_limb((0.3, 0.2))
    body.limb("leg", "limb.0", [(0.2, 0, 0.1), (0.3, -0.8, 0.5)], (0.1, 0.08), mirrored=True)
    body.blob("leg.0", (0.3, -0.8, 0.6), (0.3, 0.1, 0.2), mirrored=True, yaw=25, pitch=10, roll=5)
    capsules = body.skeleton().capsules
    places = np.random.default_rng(1).uniform(-1, 1, size=(200, 3))
    mirrored = evaluate(capsules, places * [1, 1, -1])
    assert_allclose(evaluate(capsules, places), mirrored, atol=1e-12)


def test_a_turn_about_a_joint_is_a_rotation_about_its_head() -> None:
    body = one_limb((0.2, 0.2))
    body.limb("tail", "limb.0", [(1, 0, 0), (2, 0, 0)], (0.2, 0.2))
    body.move("tail.0", Z, 0, 90)
    skeleton = body.skeleton()
    motions = bone_motions(skeleton, np.array([np.pi / 2]))
    places = np.array([[2.0, 0.0, 0.0], [0.5, 0.1, 0.0]])
    weights = np.eye(3)[[2, 1]]
    moved = blend(places, weights, motions)
    assert_allclose(moved, [[1.0, 1.0, 0.0], [0.5, 0.1, 0.0]], atol=1e-12)
    halfway = blend(places[:1], np.array([[0.0, 0.5, 0.5]]), motions)
    assert_allclose(np.linalg.norm(halfway[0] - [1, 0, 0]), 1.0, atol=1e-12)  # no shrinking


def test_children_follow_their_parents() -> None:
    body = one_limb((0.2, 0.2))
    body.limb("tail", "limb.0", [(1, 0, 0), (2, 0, 0), (3, 0, 0)], (0.2, 0.2, 0.2))
    body.curl("tail", Y, -180, 180)
    moved = bone_motions(body.skeleton(), np.array([np.pi]))
    tip = blend(np.array([[3.0, 0.0, 0.0]]), np.eye(4)[[3]], moved)
    assert_allclose(tip, [[0.0, 0.0, -1.0]], atol=1e-12)  # two right angles about +y


def test_limbs_that_would_run_into_each_other_are_noticed() -> None:
    body = one_limb((0.1, 0.1))
    body.limb("arm", "root", [(0, 0, 0.2), (0, 0, 1.0)], (0.1, 0.1))
    body.limb("other", "root", [(0.9, 0, 0.6), (0.9, 0, 1.0)], (0.1, 0.1))
    body.move("arm.0", Y, 0, 90)
    body.move("other.0", X, 0, 1)
    skeleton = body.skeleton()
    clearance = Clearance(skeleton)
    assert not clearance.offenders(bone_motions(skeleton, np.zeros(2))).any()
    crossing = clearance.offenders(bone_motions(skeleton, np.array([np.radians(65), 0.0])))
    assert_array_equal(crossing, [False, False, True, True])


@pytest.mark.parametrize("species", ["human", "elephant", "octopus"])
def test_limbs_meet_in_touching_poses(species: str) -> None:
    creature = creature_of(species)
    touching = creature.touching(1)
    assert_array_equal(touching.vertices, creature.touching(1).vertices)
    assert_array_equal(touching.faces, creature.rest.faces)
    welds = [
        2 - euler_characteristic(transform(creature.rest, "topology", 5, seed=0, pose=pose).mesh)
        for pose in (creature.posed(1), touching)
    ]
    assert welds[1] > welds[0]  # two for each: a pair of faces taken out makes one handle


def test_relaxing_a_sphere_keeps_it_and_evens_its_triangles() -> None:
    mesh = icosphere(3)
    rng = np.random.default_rng(3)
    noisy = mesh.vertices + rng.normal(scale=0.01, size=mesh.vertices.shape)

    def distance(places: FloatArray) -> FloatArray:
        length: FloatArray = np.linalg.norm(places, axis=1)
        return length - 1.0

    relaxed = relax(noisy, mesh.faces, distance, 0.15)
    assert np.abs(distance(relaxed)).max() < 1e-3
    before, after = (edge_lengths(TriangleMesh(v, mesh.faces)).std() for v in (noisy, relaxed))
    assert after < before


def test_all_poses_are_drawn_from_the_same_side() -> None:
    creature = creature_of("human")
    for seed in range(3):
        picture = render(creature.posed(seed, strength=0.5), size=60)
        rows = np.flatnonzero(picture[:, :, 3].any(axis=1))
        width = [(picture[row, :, 3] > 0).sum() for row in (rows[2], rows[len(rows) // 3])]
        assert width[0] < width[1]  # a head above shoulders


def test_the_figure_shows_each_species_twice_with_its_name() -> None:
    sheet = draw_species(("table", "lamp", "chair"), size=64, columns=2)
    assert sheet.shape[1] == 2 * 2 * 64
    assert sheet.shape[0] > 2 * 64
    shown = (sheet.min(axis=2) < 200)[:64].reshape(64, 4, 64).mean(axis=(0, 2))
    assert (shown > 0.05).all()
    assert (sheet[64:, 128:].min(axis=2) < 128).any()  # names


def test_slivers_go_and_nothing_else_does() -> None:
    mesh = icosphere(3)
    points = mesh.vertices.copy()
    first, second = mesh.faces[100, :2]
    points[first] = 0.97 * points[second] + 0.03 * points[first]  # two needles at this edge
    points[first] /= np.linalg.norm(points[first])
    assert triangle_quality(points, mesh.faces).min() < 0.1
    vertices, faces = drop_slivers(points, mesh.faces)
    assert len(vertices) == mesh.n_vertices - 1
    assert len(faces) == mesh.n_faces - 2
    assert_closed(faces)
    assert triangle_quality(vertices, faces).min() > 0.2
    again = drop_slivers(mesh.vertices, mesh.faces)
    assert_array_equal(again[0], mesh.vertices)
    assert_array_equal(again[1], mesh.faces)
