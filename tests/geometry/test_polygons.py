"""Polygons keep their area, their winding and all their sides, whatever their shape and size."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import random_rotation
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats import parse
from workers.geometry.formats.surfaces.triangulation import triangulate
from workers.geometry.formats.text.tokens import Polygons
from workers.geometry.mesh import TriangleMesh


def star(n: int) -> FloatArray:
    """Every second corner half as far from the middle."""
    angle = 2 * np.pi * np.arange(n) / n
    radius = np.where(np.arange(n) % 2, 1.0, 0.5)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def comb(n: int) -> FloatArray:
    """Teeth up from a bar; the ends of the gaps between them lie in a line."""
    i = np.arange(n // 4, dtype=np.float64)[::-1]
    height = np.full(len(i), 1.0 + len(i))
    tooth = [
        (2 * i + 2, 1 + 0 * i),
        (2 * i + 2, height),
        (2 * i + 1, height),
        (2 * i + 1, 1 + 0 * i),
    ]
    teeth = np.stack([np.stack(corner, axis=1) for corner in tooth], axis=1).reshape(-1, 2)
    return np.concatenate([[[0.0, 0.0], [2.0 * len(i) + 3, 0.0]], teeth])


def ring(n: int) -> FloatArray:
    """A disk with a hole, which a slit of no width joins to the outer side."""
    angle = 2 * np.pi * np.arange(n // 2) / (n // 2 - 1)
    outer = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outer[-1] = outer[0]
    return np.concatenate([outer, 0.5 * outer[::-1]])


def sieve(n: int) -> FloatArray:
    """A sheet with many holes, each joined to the lower side by a slit."""
    corners = [[0.0, 0.0]]
    for i in range(n // 6):
        x, y = 3.0 * i + 1, 1.0 + i % 7
        corners += [[x, 0], [x, y], [x + 0.5, y + 1], [x + 1, y], [x, y], [x, 0]]
    return np.array([*corners, [n / 2 + 1.0, 0], [n / 2 + 1.0, 20], [0, 20]])


def spiral(n: int) -> FloatArray:
    """A band wound up twenty times, or as often as its corners allow."""
    angle = np.linspace(0.0, 2 * np.pi * min(20, n / 20), n // 2)
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([(10 + angle)[:, None] * outward, ((7 + angle)[:, None] * outward)[::-1]])


def nearly_flat(n: int) -> FloatArray:
    """A comb of teeth a million times thinner than it is long."""
    flat: FloatArray = comb(n) * [1.0, 1e-6]
    return flat


def repeated(n: int) -> FloatArray:
    """A star whose corners all come three times."""
    return np.repeat(star(n // 3), 3, axis=0)


SHAPES = {f.__name__: f for f in (star, comb, ring, sieve, spiral, nearly_flat, repeated)}


def vector_area(corners: FloatArray) -> FloatArray:
    """Half the sum of the cross products of neighbours, (3,): the area and the direction."""
    area: FloatArray = 0.5 * np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return area


def cut(corners: FloatArray) -> TriangleMesh:
    """Triangles of one polygon."""
    alone = Polygons(np.array([len(corners)]), np.arange(len(corners)))
    return TriangleMesh(corners, triangulate(corners, alone))


def in_space(flat: FloatArray, seed: int) -> FloatArray:
    """The polygon in a random plane."""
    rng = np.random.default_rng(seed)
    turned: FloatArray = np.c_[flat, np.zeros(len(flat))] @ random_rotation(rng).T
    return turned + rng.normal(size=3)


def unshared_sides(faces: IntArray) -> set[tuple[int, int]]:
    """Directed sides of triangles that no other triangle has the other way round."""
    ways = Counter(
        (int(face[i]), int(face[j])) for face in faces for i, j in ((0, 1), (1, 2), (2, 0))
    )
    assert max(ways.values()) == 1
    return {(a, b) for a, b in ways if (b, a) not in ways}


def require_sound(corners: FloatArray) -> None:
    """Area and direction are the polygon's, and its sides are those of the triangles."""
    n = len(corners)
    mesh = cut(corners)
    expected = vector_area(corners - corners.mean(axis=0))
    size = float(np.linalg.norm(expected))
    assert_allclose(mesh.area, size, rtol=1e-6)
    assert_allclose(0.5 * mesh.face_normals.sum(axis=0), expected, atol=1e-9 * size)
    assert mesh.n_faces == n - 2
    assert unshared_sides(mesh.faces) == {(i, (i + 1) % n) for i in range(n)}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("size", [14, 60, 300, 3000])
@pytest.mark.parametrize("turned", [False, True])
def test_a_polygon_keeps_its_area_and_its_sides(shape: str, size: int, *, turned: bool) -> None:
    flat = SHAPES[shape](size)
    require_sound(in_space(flat, 1) if turned else np.c_[flat, np.zeros(len(flat))])


@pytest.mark.parametrize("shape", SHAPES)
def test_a_polygon_of_a_hundred_thousand_corners_keeps_its_area(shape: str) -> None:
    corners = in_space(SHAPES[shape](100_000), 2)
    mesh = cut(corners)
    expected = np.linalg.norm(vector_area(corners - corners.mean(axis=0)))
    assert mesh.n_faces == len(corners) - 2
    assert_allclose(mesh.area, expected, rtol=1e-6)


@settings(max_examples=100, deadline=None)
@given(
    radii=st.lists(st.floats(1e-3, 1.0), min_size=5, max_size=150),
    shift=st.integers(0, 200),
    seed=st.integers(0, 1000),
)
def test_any_polygon_around_a_point_keeps_its_area(
    radii: list[float], shift: int, seed: int
) -> None:
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    flat = np.array(radii)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    require_sound(in_space(np.roll(flat, shift, axis=0), seed))


@settings(max_examples=60, deadline=None)
@given(
    corners=st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=5, max_size=90),
    height=st.sampled_from([0.0, 1.0]),
)
def test_crossing_sides_are_cut_all_the_same(corners: list[tuple[int, int]], height: float) -> None:
    flat = np.array(corners, dtype=np.float64)
    rng = np.random.default_rng(len(corners))
    mesh = cut(np.c_[flat, height * rng.normal(size=len(flat))])
    n = len(corners)
    assert mesh.n_faces == n - 2
    assert unshared_sides(mesh.faces) == {(i, (i + 1) % n) for i in range(n)}


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300, -1e308])
def test_coordinates_that_are_no_numbers_are_left_to_cleaning(bad: float) -> None:
    corners = np.c_[star(20), np.zeros(20)]
    corners[3, 0] = bad
    assert cut(corners).n_faces == 18


@pytest.mark.parametrize("turns", [10, 400])
def test_a_triangle_gone_round_many_times_takes_no_time(turns: int) -> None:
    corners = np.tile(np.eye(3), (turns, 1))
    assert cut(corners).n_faces == 3 * turns - 2  # ear clipping takes the cube: 100 s for 4000


def test_polygons_stay_in_the_order_of_the_file() -> None:
    """Polygons of many sizes, mixed: each is cut as it is alone."""
    rng = np.random.default_rng(5)
    flats = [SHAPES["star"](int(n)) for n in rng.integers(3, 30, size=40)]
    counts = np.array([len(flat) for flat in flats])
    vertices = np.c_[np.concatenate(flats), np.zeros(counts.sum())]
    together = triangulate(vertices, Polygons(counts, np.arange(counts.sum())))
    starts = np.cumsum(counts) - counts
    alone = [
        cut(vertices[start : start + count]).faces + start
        for start, count in zip(starts, counts, strict=True)
    ]
    assert_array_equal(together, np.concatenate(alone))


def test_a_file_with_one_polygon_of_many_corners_is_read() -> None:
    corners = comb(2000)
    rows = [f"v {x} {y} 0" for x, y in corners]
    text = "\n".join([*rows, "f " + " ".join(str(i + 1) for i in range(len(corners)))])
    assert_allclose(
        parse(text.encode()).mesh.area,
        np.linalg.norm(vector_area(np.c_[corners, 0 * corners[:, 0]])),
    )
