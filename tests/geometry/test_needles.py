"""Short edges shrink, long ones are turned: the surface, and its topology, stay."""

import fast_simplification
import numpy as np
import pytest

from tests.meshes import (
    box,
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    subdivided,
    tetrahedron,
    torus,
    union,
)
from workers.geometry.arrays import FloatArray, lengths
from workers.geometry.cleaning import useful_faces
from workers.geometry.decimation import decimate_by_error
from workers.geometry.diagonals import turn_edges
from workers.geometry.edges import undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.needles import merge_needles
from workers.geometry.shared_edges import SharedEdges
from workers.geometry.topology import boundary_loops, euler_characteristic, surface_components


def smallest_angles(mesh: TriangleMesh) -> FloatArray:
    """Smallest angle of each face, (m,), in degrees."""
    corners = mesh.vertices[mesh.faces]
    sides = np.stack([lengths(corners[:, (i + 1) % 3] - corners[:, i]) for i in range(3)], axis=1)
    a, b, c = np.sort(sides, axis=1).T
    angles: FloatArray = np.arccos(np.clip((b * b + c * c - a * a) / (2.0 * b * c), -1.0, 1.0))
    return np.degrees(angles)


def topology(mesh: TriangleMesh) -> tuple[int, int, int]:
    """Components, boundary loops and Euler characteristic."""
    components = int(surface_components(mesh).max(initial=-1)) + 1
    return components, len(boundary_loops(mesh)), euler_characteristic(mesh)


def with_close_pairs(mesh: TriangleMesh, count: int, seed: int = 0) -> TriangleMesh:
    """A mesh some of whose vertices were split: each copy lies in a face of the vertex, near it."""
    rng = np.random.default_rng(seed)
    vertices, faces = mesh.vertices.tolist(), mesh.faces.tolist()
    for number in rng.choice(mesh.n_faces, size=count, replace=False).tolist():
        a, b, c = mesh.faces[number]
        middle = mesh.vertices[[a, b, c]].mean(axis=0)
        vertices.append(mesh.vertices[a] + 1e-4 * (middle - mesh.vertices[a]))
        new = len(vertices) - 1
        faces[number] = [a, b, new]
        faces += [[b, c, new], [c, a, new]]
    return TriangleMesh(np.array(vertices), np.array(faces))


@pytest.mark.parametrize(
    "mesh", [icosphere(3), torus(24, 12), rectangle(9, 7), cylinder(20, 9)], ids=str
)
def test_needles_are_merged_and_the_topology_stays(mesh: TriangleMesh) -> None:
    pricked = with_close_pairs(mesh, 12)
    assert (smallest_angles(pricked) < 0.1).sum() >= 12
    merged, to = merge_needles(pricked)
    assert smallest_angles(merged).min() > 5.0
    assert len(merged.faces) == mesh.n_faces
    assert topology(merged) == topology(mesh)
    assert merged.area == pytest.approx(mesh.area, rel=1e-3)
    moved = lengths(merged.vertices[to] - pricked.vertices)
    assert moved.max() <= 1e-4 * np.ptp(mesh.vertices)


def test_a_mesh_without_needles_is_returned_as_it_is() -> None:
    for mesh in (icosphere(2), torus(24, 12), rectangle(5, 4), tetrahedron()):
        merged, to = merge_needles(mesh)
        assert merged is mesh
        assert np.array_equal(to, np.arange(mesh.n_vertices))


def test_a_thin_tube_is_not_closed_off() -> None:
    # Three vertices around, each edge around far shorter than those along: no pair of them may
    # become one, since the tube would come apart into two.
    tube = cylinder(3, 6, radius=0.01, height=6.0)
    merged, _ = merge_needles(tube)
    assert topology(merged) == topology(tube)
    assert merged.n_faces == tube.n_faces


def test_the_rim_stays_where_it_is() -> None:
    sheet = rectangle(6, 6)
    near = sheet.vertices.copy()
    rim = set(np.concatenate(boundary_loops(sheet)).tolist())
    edges = undirected_edges(sheet)
    inner = next(b for a, b in edges.tolist() if a in rim and b not in rim)
    outer = next(a for a, b in edges.tolist() if b == inner and a in rim)
    near[inner] = near[outer] + 1e-3 * (near[inner] - near[outer])
    merged, to = merge_needles(TriangleMesh(near, sheet.faces))
    assert to[inner] == to[outer]
    assert np.array_equal(merged.vertices[to[outer]], near[outer])
    assert merged.area == pytest.approx(1.0)


def test_edges_of_a_plane_are_turned_to_delaunay() -> None:
    rng = np.random.default_rng(3)
    flat = rectangle(12, 12)
    inner = np.setdiff1d(np.arange(flat.n_vertices), np.concatenate(boundary_loops(flat)))
    moved = flat.vertices.copy()
    moved[inner, :2] += 0.03 * rng.uniform(-1.0, 1.0, size=(len(inner), 2))
    mesh = TriangleMesh(moved, flat.faces)
    turned = turn_edges(mesh)
    assert sums_of_angles(mesh).max() > 185.0
    assert sums_of_angles(turned).max() <= 181.0
    assert topology(turned) == topology(mesh)
    assert turned.area == pytest.approx(mesh.area)
    assert (turned.face_normals[:, 2] * mesh.face_normals[0, 2] > 0.0).all()


def sums_of_angles(mesh: TriangleMesh) -> FloatArray:
    """Sums of the two angles that face each shared edge, (e,), in degrees."""
    shared = SharedEdges.of(mesh.faces, mesh.n_vertices)
    found = np.zeros(len(shared.ends))
    for side in range(2):
        tip = mesh.vertices[shared.tips[:, side]]
        one, two = mesh.vertices[shared.ends[:, 0]] - tip, mesh.vertices[shared.ends[:, 1]] - tip
        cosines = (one * two).sum(axis=1) / (lengths(one) * lengths(two))
        found += np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    return found


def test_a_face_without_height_on_the_edge_of_a_box_is_turned_and_no_hole_opens() -> None:
    cube = subdivided(box(), 2)
    a, b, c = cube.faces[0]
    corners = cube.vertices.tolist()
    corners.append((0.5 * (cube.vertices[a] + cube.vertices[b])).tolist())  # on the edge itself
    new = len(corners) - 1
    faces = [[a, b, new], [b, c, new], [c, a, new], *cube.faces[1:].tolist()]
    mesh = TriangleMesh(np.array(corners), np.array(faces))
    assert len(useful_faces(mesh)) == mesh.n_faces - 1
    turned = turn_edges(mesh)
    assert len(useful_faces(turned)) == turned.n_faces
    assert topology(turned) == (1, 0, 2)
    assert turned.area == pytest.approx(cube.area)


def test_edges_between_faces_that_meet_at_an_angle_stay() -> None:
    for mesh in (box(), tetrahedron(), icosphere(1)):
        assert turn_edges(mesh) is mesh


@pytest.mark.parametrize("seed", range(3))
def test_flat_pieces_keep_their_topology_where_the_simplifier_leaves_needles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    faceted = union(subdivided(bumpy_sphere(3, seed=seed), 2), subdivided(torus(20, 8, 3.0), 2))
    mesh, _ = renumbered(rotated(faceted, rng), rng)
    points, triangles = fast_simplification.simplify(
        mesh.vertices.copy(), mesh.faces.astype(np.int32), target_count=8000
    )
    rough = TriangleMesh(points.astype(np.float64), triangles.astype(np.int64))
    needles = (smallest_angles(rough) < 1.0).sum()
    assert needles > 200
    shaped = turn_edges(merge_needles(rough)[0])
    assert (smallest_angles(shaped) < 1.0).sum() < 0.02 * needles
    assert topology(shaped) == topology(mesh) == (2, 0, 2)
    coarse = decimate_by_error(mesh, 4000, 7.0, keep_border=False, shaken=True).mesh
    assert topology(coarse) == topology(mesh)
    assert coarse.area == pytest.approx(mesh.area, rel=0.02)
