"""A scan sees one side of a surface, near it, and joins no two depths."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    box,
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    single_triangle,
    tetrahedron,
    torus,
    translated,
    union,
)
from workers.creatures import make_creature
from workers.geometry.arrays import BoolArray, FloatArray, lengths
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import count_surface_components
from workers.geometry.transfer import closest_points
from workers.transformations import STRENGTHS, TRANSFORMATIONS, transform
from workers.transformations.scanning import Scanner, range_image, scan_from
from workers.transformations.strengths import TABLE
from workers.transformations.transformed import FEWEST_FACES, TransformedMesh

ABOVE = np.array([0.0, 0.0, 1.0])
EXACT = Scanner(samples=4000, grazing_degrees=80, rim_loss=0.0, noise=0.0, quantum=1e-12)
ROUGH = Scanner(samples=4000, grazing_degrees=75, rim_loss=0.25, noise=0.003, quantum=0.0008)
SHAPES = {
    "flat plate": rectangle(4, 4),
    "two triangles": rectangle(1, 1),
    "one triangle": single_triangle(),
    "four faces": tetrahedron(),
    "box": box(),
    "several components": union(
        bumpy_sphere(2), translated(torus(20, 10), (3, 0, 0)), translated(box(), (0, 3, 0))
    ),
    "open": cylinder(20, 10),
    "reversed": TriangleMesh(torus(20, 10).vertices, torus(20, 10).faces[:, ::-1]),
    "thin wire": box(1.0, 1e-5, 1e-5),
    "thin blade": box(1.0, 0.05, 1e-4),
    "far away": translated(box(), (1e6, -1e6, 1e6)),
}


@cache
def human() -> TriangleMesh:
    """A small creature with limbs before its body, made once."""
    return make_creature("human", seed=0, vertices=2000).posed(1)


def scanned(mesh: TriangleMesh, scanner: Scanner, direction: FloatArray = ABOVE) -> TransformedMesh:
    """Scan from a direction with the same random numbers."""
    return scan_from(mesh, direction, scanner, rng=np.random.default_rng(0))


def is_hidden(mesh: TriangleMesh, points: FloatArray, eye: FloatArray, gap: float) -> BoolArray:
    """Whether a face lies more than a gap before points (q, 3), by Möller, Trumbore 1997, (q,)."""
    start = mesh.vertices[mesh.faces[:, 0]]  # (m, 3)
    one, two = (mesh.vertices[mesh.faces[:, i]] - start for i in (1, 2))
    moved = eye - start  # (m, 3)
    turned = np.cross(moved, one)
    hidden = np.zeros(len(points), dtype=np.bool_)
    for number, point in enumerate(points):
        length = np.linalg.norm(point - eye)
        ray = (point - eye) / length
        across = np.cross(ray, two)
        scale = (one * across).sum(axis=1)
        scale = np.where(np.abs(scale) < 1e-15, np.inf, scale)
        first, second = (moved * across).sum(axis=1) / scale, turned @ ray / scale
        away = (two * turned).sum(axis=1) / scale
        inside = (first >= 0) & (second >= 0) & (first + second <= 1) & np.isfinite(scale)
        hidden[number] = (inside & (away > 0) & (away < length - gap)).any()
    return hidden


def test_a_scan_of_a_sphere_is_the_cap_that_is_not_grazing() -> None:
    ball = icosphere(5)
    found = scanned(ball, EXACT).mesh
    assert_allclose(lengths(found.vertices), 1.0, atol=1e-3)  # the sagitta of a face
    # Seen from d radii, the angle a of the normal and the angle g of the ray meet in
    # sin(g - a) = sin(g) / d; the cap of angle a has the area 2π(1 - cos a).
    grazing = np.radians(EXACT.grazing_degrees)
    cap = grazing - np.arcsin(np.sin(grazing) / 4.0)
    step = 4.0 * range_image(ball, ABOVE, EXACT.samples).pitch  # deepest extent of a face
    assert found.vertices[:, 2].min() >= np.cos(cap) - step
    assert_allclose(found.area, 2.0 * np.pi * (1.0 - np.cos(cap)), rtol=0.05)
    assert count_surface_components(found) == 1


def test_a_scan_of_a_plate_is_the_plate() -> None:
    plate = rectangle(4, 4)
    found = scanned(plate, EXACT).mesh
    assert_allclose(found.vertices[:, 2], 0.0, atol=1e-9)
    assert_allclose(found.n_vertices, EXACT.samples, rtol=0.05)
    assert_allclose(found.area, 1.0, rtol=0.05)  # less half a pixel at each side
    assert (found.face_normals[:, 2] > 0).all()
    edge_on = scanned(plate, EXACT, np.array([1.0, 0.0, 0.0]))
    assert edge_on.mesh.n_faces == 0


def test_vertices_lie_on_the_surface_but_for_the_noise() -> None:
    mesh = human()
    unit = np.sqrt(mesh.area)
    for scanner in (EXACT, ROUGH):
        found = scanned(mesh, scanner).mesh
        gaps = np.sqrt(closest_points(mesh, found.vertices).squared_distances)
        # three standard deviations and half a step of depth, along a ray at most 14° off the axis
        farthest = (3.0 * scanner.noise + 0.5 * scanner.quantum) * unit / np.cos(np.radians(15))
        assert gaps.max() <= farthest + 1e-7 * unit
    assert gaps.std() > 0.1 * ROUGH.noise * unit


def test_noise_is_as_large_as_was_asked_for_and_alike_at_neighbours() -> None:
    plate = rectangle(4, 4)
    found = scanned(plate, Scanner(10000, 80, 0.0, 0.002, 1e-9)).mesh
    height = found.vertices[:, 2]
    assert_allclose(height.std(), 0.002, rtol=0.1)  # neighbours are alike: 10,000 count for less
    one, two = height[found.faces[:, 0]], height[found.faces[:, 1]]
    assert 0.3 < np.corrcoef(one, two)[0, 1] < 0.8


def test_depths_are_multiples_of_the_step() -> None:
    plate = rectangle(4, 4)
    found = scanned(plate, Scanner(5000, 80, 0.0, 0.002, 0.001)).mesh
    levels = np.unique(np.round(found.vertices[:, 2], 9))
    assert len(levels) <= 2 * 6 + 2  # three standard deviations of two steps each
    assert_allclose(np.diff(levels), 0.001, rtol=1e-6)


def test_nothing_hidden_is_seen() -> None:
    mesh = human()
    for direction in (ABOVE, np.array([0.6, 0.0, 0.8])):
        image = range_image(mesh, direction, EXACT.samples)
        found = scanned(mesh, EXACT, direction).mesh
        some = found.vertices[:: max(1, found.n_vertices // 500)]
        assert not is_hidden(mesh, some, image.eye, 1e-6).any()
    behind = union(rectangle(4, 4), translated(rectangle(4, 4, 0.5, 0.5), (0.25, 0.25, -1.0)))
    assert_allclose(scanned(behind, EXACT).mesh.vertices[:, 2], 0.0, atol=1e-9)


def test_no_face_spans_a_step_of_depth_and_what_is_hidden_is_a_gap() -> None:
    before, behind = rectangle(4, 4, 0.3, 1.0), rectangle(8, 8)
    mesh = union(translated(before, (0.35, 0.0, 0.2)), behind)
    image = range_image(mesh, ABOVE, ROUGH.samples)
    found = scanned(mesh, ROUGH).mesh
    middle = found.vertices[:, 2] > 0.1
    assert middle.any()
    assert not middle.all()
    assert_array_equal(middle[found.faces].all(axis=1), middle[found.faces].any(axis=1))
    assert count_surface_components(found) == 3  # the one before, and both sides of it
    for shape in (human(), bumpy_sphere(4)):
        found = scanned(shape, ROUGH).mesh
        image = range_image(shape, ABOVE, ROUGH.samples)
        away = (image.eye - found.vertices[found.faces]) @ ABOVE  # (m, 3)
        spread = 2.0 * (3.0 * ROUGH.noise + 0.5 * ROUGH.quantum) * np.sqrt(shape.area)
        assert np.ptp(away, axis=1).max() <= 4.0 * image.pitch + spread


def test_grazing_faces_are_missing_and_faces_look_at_the_scanner() -> None:
    mesh = bumpy_sphere(4)
    eye = range_image(mesh, ABOVE, EXACT.samples).eye
    found = scanned(mesh, EXACT).mesh
    sight = eye - found.vertices[found.faces].mean(axis=1)
    cosines = (found.face_normals * sight).sum(axis=1)
    cosines /= lengths(found.face_normals) * lengths(sight)
    assert cosines.min() >= np.cos(np.radians(EXACT.grazing_degrees)) - 1e-9


def test_rims_are_ragged_and_islands_are_dropped() -> None:
    ball = icosphere(4)
    smooth = scanned(ball, EXACT).mesh
    ragged = scanned(ball, Scanner(4000, 80, 0.3, 0.0, 1e-12)).mesh
    assert ragged.n_faces < smooth.n_faces
    inner = smooth.vertices[smooth.vertices[:, 2] > 0.7]  # five pixels from the border
    assert np.isin(inner[:, 0], ragged.vertices[:, 0]).all()
    speck = union(rectangle(4, 4), translated(rectangle(1, 1, 0.03, 0.03), (1.05, 0.5, 0.0)))
    assert count_surface_components(scanned(speck, EXACT).mesh) == 1
    piece = union(rectangle(4, 4), translated(rectangle(1, 1, 0.3, 0.3), (1.05, 0.5, 0.0)))
    assert count_surface_components(scanned(piece, EXACT).mesh) == 2


def test_an_origin_is_the_nearest_corner_of_the_face_that_is_seen() -> None:
    mesh = box()
    found = scanned(mesh, EXACT)
    ends = lengths(mesh.vertices[found.origin] - found.mesh.vertices)
    assert ends.max() <= np.sqrt(0.5) + 1e-6  # the middle of a square is that far from its corners
    assert (mesh.vertices[found.origin, 2] > mesh.vertices[:, 2].mean()).all()
    # a finer mesh than the scanner's: the corner is as near as its faces are small
    fine = icosphere(5)
    found = scanned(fine, ROUGH)
    ends = lengths(fine.vertices[found.origin] - found.mesh.vertices)
    assert ends.max() <= 0.05 + (3 * ROUGH.noise + ROUGH.quantum) * np.sqrt(fine.area)


def test_winding_does_not_matter() -> None:
    mesh = torus(40, 20)
    turned = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    one, two = (scanned(m, ROUGH).mesh for m in (mesh, turned))
    assert_allclose(one.area, two.area, rtol=1e-3)  # a pixel at an edge may see the other face
    assert_allclose(one.n_faces, two.n_faces, rtol=1e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_whatever_is_scanned_leaves_fifty_faces_or_the_whole(name: str) -> None:
    mesh = SHAPES[name]
    for strength in STRENGTHS:
        for seed in range(2):
            found = transform(mesh, "scan", strength, seed=seed)
            assert np.isfinite(found.mesh.vertices).all()
            assert_array_equal(np.unique(found.mesh.faces), np.arange(found.mesh.n_vertices))
            assert found.origin.shape == (found.mesh.n_vertices,)
            assert found.origin.min() >= 0
            assert found.origin.max() < mesh.n_vertices
            if found.mesh.n_faces < FEWEST_FACES:
                assert_array_equal(found.mesh.faces, mesh.faces)
    assert (found.mesh.n_faces < FEWEST_FACES) == (name == "thin wire")


def test_stronger_scans_have_fewer_samples_and_see_less() -> None:
    found = [
        [transform(human(), "scan", strength, seed=seed).mesh for seed in range(3)]
        for strength in STRENGTHS
    ]
    counts = [np.mean([mesh.n_vertices for mesh in row]) for row in found]
    areas = [np.mean([mesh.area for mesh in row]) / human().area for row in found]
    assert (np.diff(counts) < 0).all()
    assert (np.array(counts) <= 1.05 * np.array(TABLE["scan"]["samples"])).all()
    assert 0.5 > areas[0] > areas[4] > 0.05  # of three seeds


def test_a_scan_is_of_the_pose_and_its_origins_are_vertices_of_the_shape() -> None:
    creature = make_creature("human", seed=0, vertices=2000)
    found = transform(creature.rest, "scan", 1, seed=0, pose=creature.posed(1))
    again = transform(creature.posed(1), "scan", 1, seed=0)
    assert_array_equal(found.mesh.vertices, again.mesh.vertices)
    assert_array_equal(found.origin, again.origin)


def test_scan_stands_last_so_that_the_others_keep_their_seeds() -> None:
    assert TRANSFORMATIONS[-1] == "scan"
