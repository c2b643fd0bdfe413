"""Regions: discs on a sphere, the whole of a shape, and what must not matter."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.sparse.csgraph import dijkstra

from tests.meshes import bumpy_sphere, icosphere, octahedron, rectangle, torus
from workers.errors import InvalidRequestError
from workers.geometry.geodesics import surface_graph
from workers.geometry.mesh import TriangleMesh
from workers.geometry.regions import cut_disc, cut_vertices
from workers.geometry.topology import boundary_loops, count_components, euler_characteristic

BALL = icosphere(4)
CREATURE = bumpy_sphere(3, seed=1)


def same(first: TriangleMesh, second: TriangleMesh) -> bool:
    return np.array_equal(first.vertices, second.vertices) and np.array_equal(
        first.faces, second.faces
    )


@pytest.mark.parametrize("radius", [0.5, 1.0, 2.0, 3.0])
def test_a_disc_on_a_sphere_has_the_area_of_a_cap(radius: float) -> None:
    """2π(1 - cos r), less about half an edge along its rim; paths are up to 4 % too long."""
    edge = np.sqrt(BALL.area / BALL.n_faces * 4.0 / np.sqrt(3.0))
    caps = [2.0 * np.pi * (1.0 - np.cos(min(r, np.pi))) for r in (0.96 * radius - edge, radius)]
    disc = cut_disc(BALL, 7, radius)
    assert caps[0] < disc.area < caps[1]
    assert euler_characteristic(disc) == 1
    assert len(boundary_loops(disc)) == 1


def test_a_disc_on_a_plane_is_round() -> None:
    """Unfolded diagonals are paths, so it is no square as paths along edges would have it."""
    plane = rectangle(40, 40)
    center = 20 * 41 + 20
    disc = cut_disc(plane, center, 0.4)
    far = np.linalg.norm(disc.vertices - plane.vertices[center], axis=1)
    assert far.max() <= 0.4 + 1e-12
    assert 0.85 * np.pi * 0.4**2 < disc.area < np.pi * 0.4**2


@settings(max_examples=25, deadline=None)
@given(center=st.integers(0, CREATURE.n_vertices - 1), radius=st.floats(0.8, 4.0))
def test_a_disc_is_what_a_search_of_the_whole_graph_finds(center: int, radius: float) -> None:
    """Only a ball around the center is searched, and no distance changes by that."""
    far = dijkstra(surface_graph(CREATURE), directed=True, indices=[center])[0]
    expected = cut_vertices(CREATURE, np.flatnonzero(far <= radius))
    assert same(cut_disc(CREATURE, center, radius), expected)


def two_fans(*more: list[int]) -> TriangleMesh:
    """Four faces around each tip of two long faces, whose common edge ends far away.

    Vertices 0 and 1 are the ends of the edge, 2 and 3 the tips, 4 lies aside.
    """
    tips = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]
    vertices = [[-5.0, 0.0, 0.0], [5.0, 0.0, 0.0], *tips, [0.0, 0.0, 9.0]]
    faces = [[0, 1, 2], [1, 0, 3], *more]
    for tip, (x, y, _) in enumerate(tips, start=2):
        first = len(vertices)
        angles = np.pi * np.arange(5) / 4.0
        vertices += [[x + 0.1 * np.cos(a), y, 0.1 * np.sin(a)] for a in angles]
        faces += [[tip, first + i, first + i + 1] for i in range(4)]
    return TriangleMesh(np.array(vertices), np.array(faces))


def test_a_way_across_an_edge_counts_though_its_ends_are_far() -> None:
    open_way, closed_way = two_fans(), two_fans([0, 1, 4])  # an edge of three faces is not crossed
    assert [cut_disc(open_way, 2, radius).n_faces for radius in (1.9, 2.2)] == [4, 8]
    assert [cut_disc(closed_way, 2, radius).n_faces for radius in (1.9, 2.2)] == [4, 4]


def test_all_vertices_are_the_shape_itself() -> None:
    assert cut_vertices(CREATURE, np.arange(CREATURE.n_vertices)) is CREATURE
    assert cut_disc(CREATURE, 0, 1e3) is CREATURE
    assert cut_disc(CREATURE, 0, 1e308) is CREATURE


def test_the_order_of_the_vertices_does_not_matter() -> None:
    rng = np.random.default_rng(20260301)
    vertices = np.flatnonzero(CREATURE.vertices[:, 2] > 0.1)
    region = cut_vertices(CREATURE, vertices)
    assert same(cut_vertices(CREATURE, rng.permutation(vertices)), region)
    assert same(cut_vertices(CREATURE, np.repeat(vertices, 3)), region)


def test_faces_keep_their_order_and_their_winding() -> None:
    vertices = np.flatnonzero(CREATURE.vertices[:, 0] > 0.0)
    region = cut_vertices(CREATURE, vertices)
    kept = np.isin(CREATURE.faces, vertices).all(axis=1)
    assert_array_equal(
        region.vertices[region.faces], CREATURE.vertices[CREATURE.faces[kept]]
    )  # corner by corner
    assert_array_equal(region.face_normals, CREATURE.face_normals[kept])


def test_a_region_and_the_rest_meet_in_no_face() -> None:
    above = CREATURE.vertices[:, 2] > 0.0
    parts = [cut_vertices(CREATURE, np.flatnonzero(side)) for side in (above, ~above)]
    cut_through = above[CREATURE.faces].any(axis=1) & ~above[CREATURE.faces].all(axis=1)
    whole = sum(part.area for part in parts) + CREATURE.face_areas[cut_through].sum()
    assert whole == pytest.approx(CREATURE.area, rel=1e-12)


def test_scale_and_renumbering_change_nothing() -> None:
    rng = np.random.default_rng(20260301)
    ring = torus(24, 12)
    disc = cut_disc(ring, 5, 0.8)
    larger = TriangleMesh(8.0 * ring.vertices, ring.faces)
    assert_array_equal(cut_disc(larger, 5, 6.4).faces, disc.faces)
    order = rng.permutation(ring.n_vertices)
    renumbered = TriangleMesh(ring.vertices[order], np.argsort(order)[ring.faces])
    again = cut_disc(renumbered, int(np.flatnonzero(order == 5)[0]), 0.8)
    assert_array_equal(again.vertices[again.faces], disc.vertices[disc.faces])


def test_a_region_may_have_several_pieces() -> None:
    both = np.flatnonzero(np.abs(CREATURE.vertices[:, 2]) > 0.6)
    assert count_components(cut_vertices(CREATURE, both)) == 2


def test_a_disc_stays_on_its_component() -> None:
    two = TriangleMesh(
        np.vstack([BALL.vertices, BALL.vertices + np.array([2.01, 0.0, 0.0])]),
        np.vstack([BALL.faces, BALL.faces + BALL.n_vertices]),
    )
    assert same(cut_disc(two, 0, 100.0), BALL)


@pytest.mark.parametrize(
    ("vertices", "reason"),
    [
        ([0, 1, 162], "no vertex 162, expected 0 to 161"),
        ([0, -1], "no vertex -1, expected 0 to 161"),
        ([], "vertices: 0, .* among them: 0; expected at least 4"),
        ([0, 80, 161], "vertices: 3, .* among them: 0; expected at least 4"),
    ],
)
def test_what_is_no_region_says_what_was_found(vertices: list[int], reason: str) -> None:
    with pytest.raises(InvalidRequestError, match=reason):
        cut_vertices(icosphere(2), np.array(vertices, dtype=np.int64))


def test_a_radius_that_reaches_no_face_says_how_long_edges_are() -> None:
    with pytest.raises(InvalidRequestError, match=r"within 0.1 of vertex 0: 0; .* 1.414 long"):
        cut_disc(octahedron(), 0, 0.1)
    with pytest.raises(InvalidRequestError, match="no vertex 6, expected 0 to 5"):
        cut_disc(octahedron(), 6, 1.0)


def test_a_disc_of_as_few_faces_as_may_be_is_one() -> None:
    assert cut_disc(octahedron(), 0, 1.5).n_faces == 4
