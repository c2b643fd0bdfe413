"""Signatures and their rows: sizes, bytes, what is lost in them, and odd meshes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bumpy_sphere,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    single_triangle,
    subdivided,
    tetrahedron,
    translated,
    union,
)
from tests.retrieval.windows.shapes import asked, asked_bumpy, stored, stored_bumpy
from workers.geometry.mesh import TriangleMesh
from workers.geometry.smoothing import median_angle
from workers.retrieval.windows.rows import (
    PREFIX_BYTES,
    PREFIX_POINTS,
    ROW_BYTES,
    read_prefixes,
    read_row,
    write_row,
)
from workers.retrieval.windows.signature import (
    CUT,
    FACING_RADII,
    FAR_POINTS,
    KINDS,
    LOST,
    PART_SCALES,
    QUERY_POINTS,
    RADII,
    SHEET,
    SHEET_POINTS,
    SHEET_SCALES,
    STEP,
    STORED_POINTS,
    WHOLE,
    Signature,
    query_signature,
    signature_at,
    signature_of,
    window_surface,
)

HALF_A_CODE = np.array([7.0, 2.0, 0.6, 0.6, 0.6, 1.0, 0.6]) / 255.0 / 2.0
"""Of the range of each number of a window."""

LOWEST, HIGHEST = [-5.0, -1.0, 0, 0, 0, 0, 0], [2.0, 1.0, 0.6, 0.6, 0.6, 1.0, 0.6]
ISLANDS = union(bumpy_sphere(2, 4), translated(icosphere(2, 0.5), (9.0, 0.0, 0.0)))
TINY = subdivided(tetrahedron())  # 10 vertices


def as_array(row: bytes) -> np.ndarray[tuple[int], np.dtype[np.uint8]]:
    return np.frombuffer(row, dtype=np.uint8)


def assert_same(found: Signature, expected: Signature) -> None:
    for name, value in vars(expected).items():
        assert_array_equal(getattr(found, name), value, err_msg=name)


def test_a_row_has_less_than_20_kilobytes_and_whole_numbers_of_four() -> None:
    """Indexes keep it as numbers of four bytes."""
    assert ROW_BYTES <= 20_000
    assert ROW_BYTES % 4 == 0
    for mesh in (bumpy_sphere(3, 1), ISLANDS, TINY, rectangle(9, 9), single_triangle()):
        assert len(write_row(stored(mesh))) == ROW_BYTES


def test_what_is_read_is_what_was_written_within_half_a_code() -> None:
    written = stored_bumpy(1)
    found = read_row(as_array(write_row(written)))
    assert (written.n_points, written.n_scales) == (STORED_POINTS, 1)
    clipped = np.clip(written.numbers, LOWEST, HIGHEST)
    assert (np.abs(found.numbers - clipped) <= HALF_A_CODE + 1e-6).all()
    assert_array_equal(found.reaches, written.reaches)
    assert_allclose(found.areas, written.areas, rtol=1e-3)  # half precision
    assert found.areas.sum() == pytest.approx(1.0)
    top = written.mutual.max()
    assert (np.abs(found.mutual - written.mutual) <= top / 254.0 / 2.0 + 1e-6).all()
    assert found.mutual.shape == (FAR_POINTS, FAR_POINTS)
    assert found.boundary == pytest.approx(written.boundary)
    assert found.roughness == pytest.approx(written.roughness)
    assert found.n_vertices == 642


def test_what_was_read_is_written_as_the_same_bytes() -> None:
    for mesh in (bumpy_sphere(3, 1), ISLANDS, TINY):
        row = write_row(stored(mesh))
        assert write_row(read_row(as_array(row))) == row
    query = asked_bumpy(1)
    assert_same(Signature.from_arrays(query.to_arrays()), query)


def test_the_same_mesh_has_the_same_bytes() -> None:
    one, other = (write_row(stored(bumpy_sphere(3, 1))) for _ in range(2))
    assert one == other
    assert write_row(stored_bumpy(2)) != one


def test_a_copy_has_the_same_signature() -> None:
    """Points are the same vertices, so numbers agree but for rounding."""
    rng = np.random.default_rng(5)
    mesh = bumpy_sphere(3, 1)
    copy, _ = renumbered(scaled(rotated(mesh, rng), 7.0), rng)
    expected, found = stored_bumpy(1), stored(copy)
    assert_allclose(found.numbers, expected.numbers, atol=1e-5)
    assert_array_equal(found.reaches, expected.reaches)
    assert_allclose(found.areas, expected.areas, atol=1e-6)
    assert_allclose(found.mutual, expected.mutual, atol=1e-6)


def test_the_beginning_of_a_row_is_what_a_short_look_reads() -> None:
    row = as_array(write_row(stored_bumpy(1)))
    windows = np.array([1, 5])
    for given in (row, row[:PREFIX_BYTES]):
        (found,) = read_prefixes(given[None], windows)
        assert_array_equal(found, read_row(row).numbers[0, :PREFIX_POINTS, windows].swapaxes(0, 1))


def test_a_tiny_mesh_has_its_points_again_and_these_have_no_area() -> None:
    written = stored(TINY)
    assert written.n_points == TINY.n_vertices == 10
    found = read_row(as_array(write_row(written)))
    assert found.n_points == STORED_POINTS
    again = np.arange(STORED_POINTS) % 10
    assert_array_equal(found.numbers[0], found.numbers[0, again])
    assert_array_equal(found.areas[10:], 0.0)
    assert_allclose(found.areas[:10], written.areas, rtol=1e-3)
    far = np.arange(FAR_POINTS) % 10
    assert_array_equal(found.mutual, found.mutual[:10, :10][np.ix_(far, far)])


def test_islands_have_points_each_and_no_way_between_them() -> None:
    found = read_row(as_array(write_row(stored(ISLANDS))))
    apart = ~np.isfinite(found.mutual)
    of_first = np.isfinite(found.mutual[0])
    assert 0 < of_first.sum() < FAR_POINTS
    assert_array_equal(apart, of_first[:, None] != of_first)
    assert np.isfinite(found.numbers).all()
    query = asked(ISLANDS)
    assert np.isinf(query.mutual).any()
    assert np.isfinite(query.numbers).all()


def test_a_query_has_more_scales_the_longer_its_boundary_and_a_sheet_more_points() -> None:
    """A strip of 1 by 16 has a boundary of 34 / 4 = 8.5 √A."""
    sheet = rectangle(160, 10, 16.0, 1.0)
    for mesh, boundary, points, scales in (
        (bumpy_sphere(3, 1), 0.0, QUERY_POINTS, PART_SCALES),
        (rectangle(20, 20, 3.0, 3.0), 4.0, QUERY_POINTS, PART_SCALES),
        (sheet, 8.5, SHEET_POINTS, SHEET_SCALES),
    ):
        surface = window_surface(mesh, n_vertices=99, for_query=True)
        found = query_signature(surface)
        assert found.boundary == pytest.approx(boundary)
        assert surface.is_sheet == (boundary > SHEET)
        assert (found.n_points, found.n_scales) == (points, scales)
        assert found.mutual.shape == (points, points)
        assert found.n_vertices == 99
        assert stored(mesh).n_scales == 1


def test_scales_of_a_query_are_those_of_a_smaller_share_of_a_whole() -> None:
    """Hypothesis j of a shape is that of a shape whose area is 1.07^(-2j) of the unit."""
    query, step = asked_bumpy(1), 3
    surface = window_surface(bumpy_sphere(3, 1), n_vertices=642, for_query=True)
    smaller = TriangleMesh(surface.mesh.vertices * STEP**-step, surface.mesh.faces)
    expected = signature_at(smaller, surface.points).numbers[0]
    clipped = np.clip(expected, LOWEST, HIGHEST)
    assert (np.abs(query.numbers[step] - clipped) <= HALF_A_CODE + 1e-5).all()


def test_cells_share_the_area_and_distances_are_those_along_the_surface() -> None:
    surface = window_surface(bumpy_sphere(3, 1), n_vertices=642, for_query=True)
    assert surface.mesh.area == pytest.approx(1.0)
    assert surface.areas.sum() == pytest.approx(1.0)
    far = window_surface(bumpy_sphere(3, 1), n_vertices=642, for_query=False)
    n = min(len(far.mutual), QUERY_POINTS)
    assert_array_equal(far.points[:n], surface.points[:n])
    exact = surface.mutual[:n, :n]  # those of a stored shape lead by way of near points
    assert (far.mutual[:n, :n] >= exact - 1e-12).all()
    assert_allclose(far.mutual[:n, :n], exact, atol=0.02)


def test_windows_need_no_distances_beyond_their_reach() -> None:
    """A stored shape's searches end early; its windows are those of all distances."""
    mesh = bumpy_sphere(3, 1)
    early = window_surface(mesh, n_vertices=642, for_query=False)
    full = signature_at(early.mesh, early.points)
    assert_array_equal(stored_bumpy(1).numbers, full.numbers)
    beyond = early.distances[-1][np.isfinite(early.distances[-1])]
    assert beyond.max() < 0.5 * early.mutual.max()


def test_how_far_the_boundary_reaches_decides_what_counts() -> None:
    """On a unit square a window of radius R is whole if no edge of the rim is within about R."""
    mesh = rectangle(40, 40)
    surface = window_surface(mesh, n_vertices=1, for_query=True)
    found = query_signature(surface)
    inside = 0.5 - np.abs(surface.mesh.vertices[surface.points, :2]).max(axis=1)
    for kind, radius in enumerate([*RADII, *FACING_RADII]):
        reaches = found.reaches[0, :, kind]
        assert (reaches[inside > 1.01 * radius] == WHOLE).all()
        on_rim = inside < 1e-9
        assert (reaches[on_rim] == LOST).all()
        between = (inside > 0.55 * radius) & (inside < 0.75 * radius)
        assert (reaches[between] == CUT).all()  # w is .1 at .83 R and .6 at .47 R
    assert (found.reaches[:, inside > 0.45] == WHOLE).all()


def test_roughness_is_the_median_angle_between_faces() -> None:
    assert median_angle(rectangle(5, 5)) == 0.0
    assert median_angle(single_triangle()) == 0.0
    assert median_angle(tetrahedron()) == pytest.approx(180.0 - np.degrees(np.arccos(1.0 / 3.0)))


def test_signatures_at_no_points_are_empty() -> None:
    found = signature_at(bumpy_sphere(2, 1), np.empty(0, dtype=np.int64))
    assert found.numbers.shape == (1, 0, KINDS, 7)
    assert found.reaches.shape == (1, 0, KINDS)


def test_windows_of_all_that_is_near_can_be_taken_alone_and_at_chosen_scales() -> None:
    mesh = bumpy_sphere(3, 5)
    surface = window_surface(mesh, n_vertices=mesh.n_vertices, for_query=True)
    everything, some = query_signature(surface), signature_of(surface, [4, 1], facing=False)
    near = slice(0, len(RADII))
    assert_allclose(some.numbers[:, :, near], everything.numbers[[4, 1]][:, :, near], rtol=1e-6)
    assert_array_equal(some.reaches[:, :, near], everything.reaches[[4, 1]][:, :, near])
    assert (some.reaches[:, :, len(RADII) :] == LOST).all()
