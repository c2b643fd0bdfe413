"""Clusters keep what a grid of cells tells apart, and do not see how a mesh is numbered."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.meshes import (
    box,
    bumpy_sphere,
    cylinder,
    icosphere,
    renumbered,
    rotated,
    scaled,
    subdivided,
    torus,
    translated,
    union,
)
from workers.geometry import simplification
from workers.geometry.arrays import IntArray
from workers.geometry.canonical import (
    canonical_frame,
    order_by_place,
    reordered,
    rounded,
)
from workers.geometry.clustering import CELL_STEPS, Clusters, _distinct, clustered
from workers.geometry.edges import undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.simplification import simplify
from workers.geometry.topology import (
    boundary_loops,
    count_surface_components,
    euler_characteristic,
)

COARSE = 16 * CELL_STEPS  # a side of a cell is 1/26 of a side of the area as a square


def inside(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh in rounded canonical coordinates."""
    frame = canonical_frame(mesh)
    return TriangleMesh(rounded(frame.enter(mesh.vertices)), mesh.faces)


def clusters_of(mesh: TriangleMesh, *, steps: int = COARSE) -> Clusters:
    found = clustered(mesh, undirected_edges(mesh), steps=steps)
    assert found is not None
    return found


@pytest.mark.parametrize(
    "mesh",
    [bumpy_sphere(5), torus(160, 80), cylinder(120, 60), subdivided(box(1, 2, 3), 6)],
    ids=["bumpy", "torus", "cylinder", "box"],
)
def test_clusters_keep_what_makes_the_shape(mesh: TriangleMesh) -> None:
    found = clusters_of(inside(mesh))
    assert found.mesh.n_vertices < mesh.n_vertices / 3
    assert found.lost_area < 0.01
    assert count_surface_components(found.mesh) == count_surface_components(mesh)
    assert len(boundary_loops(found.mesh)) == len(boundary_loops(mesh))
    assert euler_characteristic(found.mesh) == euler_characteristic(mesh)
    assert found.mesh.area == pytest.approx(1.0, rel=0.05)  # a box loses the edges' width


def test_clusters_of_a_renumbered_copy_are_the_same_bit_for_bit() -> None:
    mesh = inside(bumpy_sphere(4))
    copy, _ = renumbered(mesh, np.random.default_rng(3))
    first, second = (clusters_of(m).mesh for m in (mesh, copy))
    first, second = (reordered(m, order_by_place(m)) for m in (first, second))
    assert_array_equal(first.vertices, second.vertices)
    assert_array_equal(first.faces, second.faces)


def sheets(n: int, gap: float) -> TriangleMesh:
    """Front and back of a plate, joined along the rim."""
    flat = subdivided(box(1.0, 1.0, gap), n)
    return inside(flat)


def test_sheets_nearer_than_a_cell_are_not_glued() -> None:
    plate = sheets(6, 0.002)
    found = clusters_of(plate)
    assert count_surface_components(found.mesh) == 1
    assert euler_characteristic(found.mesh) == 2
    assert found.mesh.area == pytest.approx(1.0, rel=0.1)  # glued sheets would have half of it
    near = union(bumpy_sphere(4), translated(bumpy_sphere(4), (0.001, 0.0, 0.0)))
    assert count_surface_components(clusters_of(inside(near)).mesh) == 2


def test_what_is_thinner_than_a_cell_is_told() -> None:
    wire = cylinder(12, 3000, radius=0.002, height=4.0)
    wire = rotated(translated(wire, (0.02, 0.13, 0.0)), np.random.default_rng(1))
    assert clusters_of(inside(union(icosphere(4, radius=0.3), wire))).lost_area > 0.02


def plain_faces(labels: IntArray, faces: IntArray) -> set[tuple[int, ...]]:
    """Faces between clusters, counted one by one, each from its smallest corner."""
    sides: dict[tuple[int, ...], int] = {}
    for corners in labels[faces].tolist():
        if len(set(corners)) == 3:
            first = corners.index(min(corners))
            turned = tuple(corners[first:] + corners[:first])
            key = tuple(sorted(corners))
            sides[key] = sides.get(key, 0) + (1 if turned == key else -1)
    return {
        (low, middle, high) if side > 0 else (low, high, middle)
        for (low, middle, high), side in sides.items()
        if side
    }


@pytest.mark.parametrize("seed", range(20))
def test_faces_between_clusters_are_those_that_counting_gives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, 7, size=40)
    faces = rng.integers(0, 40, size=(60, 3))
    found = [tuple(face) for face in _distinct(labels, faces).tolist()]
    assert set(found) == plain_faces(labels, faces)
    assert len(found) == len(set(found))


def test_a_mesh_too_long_for_the_grid_has_no_clusters() -> None:
    long = cylinder(3, 4, radius=1e-6, height=1e3)
    mesh = inside(long)
    assert clustered(mesh, undirected_edges(mesh), steps=1) is None


@pytest.fixture
def clustering_early(monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes of a few thousand vertices are treated as those of half a million are."""
    monkeypatch.setattr(simplification, "FINEST", 5_000)
    monkeypatch.setattr(simplification, "LARGEST_CHECKED", 2_000)

    def coarsely(mesh: TriangleMesh, edges: IntArray) -> Clusters | None:
        return clustered(mesh, edges, steps=8 * CELL_STEPS)

    monkeypatch.setattr(simplification, "clustered", coarsely)


@pytest.mark.usefixtures("clustering_early")
def test_copies_of_a_very_fine_mesh_get_the_same_working_mesh() -> None:
    mesh = bumpy_sphere(5)
    rng = np.random.default_rng(7)
    expected = simplify(mesh, vertices=1000).mesh
    copy, _ = renumbered(scaled(rotated(mesh, rng), 12.0), rng)
    found = simplify(copy, vertices=1000).mesh
    assert found.n_vertices == expected.n_vertices == pytest.approx(1000, rel=0.03)
    assert found.area / copy.area == pytest.approx(expected.area / mesh.area, rel=1e-9)


@pytest.mark.usefixtures("clustering_early")
@pytest.mark.parametrize("mesh", [bumpy_sphere(5), torus(160, 80)], ids=["bumpy", "torus"])
def test_a_very_fine_mesh_keeps_what_makes_the_shape(mesh: TriangleMesh) -> None:
    simplified = simplify(mesh, vertices=1000)
    assert simplified.checked == ()
    assert euler_characteristic(simplified.mesh) == euler_characteristic(mesh)
    assert simplified.mesh.area == pytest.approx(mesh.area, rel=0.02)
    volume = np.einsum(
        "ij,ij->",
        simplified.mesh.face_normals,
        simplified.mesh.vertices[simplified.mesh.faces[:, 0]],
    )
    assert volume > 0  # still wound outward


@pytest.mark.usefixtures("clustering_early")
def test_clusters_that_would_change_the_shape_are_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken: list[bool] = []
    at_once = simplification._sound_clusters

    def watched(mesh: TriangleMesh, edges: IntArray) -> TriangleMesh | None:
        found = at_once(mesh, edges)
        taken.append(found is not None)
        return found

    monkeypatch.setattr(simplification, "_sound_clusters", watched)
    tube = cylinder(16, 400, radius=1.0, height=8.0)
    z = tube.vertices[:, 2]
    neck = (1.0 - 0.998 * np.exp(-(((z - 4.0) / 1.0) ** 4)))[:, None]
    waisted = TriangleMesh(np.concatenate([neck, neck, neck**0], 1) * tube.vertices, tube.faces)
    wire = rotated(cylinder(8, 800, radius=0.01, height=9.0), np.random.default_rng(1))
    for mesh in (waisted, union(bumpy_sphere(3), translated(wire, (1.0, 2.0, 3.0)))):
        simplify(mesh, vertices=1000)
    simplify(bumpy_sphere(5), vertices=1000)
    assert taken == [False, False, True]
