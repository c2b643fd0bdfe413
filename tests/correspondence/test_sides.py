"""How alike points are, and which of two shapes is a part of the other."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere, scaled, translated, union
from workers.correspondence.likeness import SCALES, Costs, Likeness, compare
from workers.correspondence.sides import MORE_POINTS, POINTS, Sides
from workers.correspondence.surface import Surface
from workers.creatures import Creature, make_creature
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.retrieval.windows.signature import STEP
from workers.storage.shipped_models import shipped_whitening
from workers.transformations import transform
from workers.transformations.transformed import TransformedMesh


def solved(mesh: TriangleMesh) -> Solution:
    return Solution(mesh, compute_spectrum(mesh, n_eigenpairs=60))


def sides(first: TriangleMesh, second: TriangleMesh) -> Sides:
    return Sides.of(solved(first), solved(second), shipped_whitening())


@cache
def cow() -> Creature:
    return make_creature("cow", seed=4, vertices=2500)


@cache
def half_a_cow() -> TransformedMesh:
    return transform(cow().rest, "partial", 5, seed=2)


def compared_with_itself(*, may_be_part: bool) -> Likeness:
    solution = solved(bumpy_sphere())
    one, other = Surface.of(solution, POINTS), Surface.of(solution, MORE_POINTS)
    return compare(one, other, shipped_whitening(), may_be_part=may_be_part)


@pytest.mark.parametrize("may_be_part", [False, True])
def test_a_point_costs_nothing_to_match_with_itself(may_be_part: bool) -> None:
    found = compared_with_itself(may_be_part=may_be_part)
    assert found.scale == 1.0
    assert found.costs.values.shape == (POINTS, MORE_POINTS)
    # Sums of squares in single precision, of numbers of about a hundred.
    assert_allclose(np.diag(found.costs.values), 0.0, atol=1e-2)
    assert found.costs.values.mean() > 1.0
    assert_array_equal(found.own.values, found.costs.values)


def test_handedness_counts_as_three_numbers() -> None:
    costs = Costs(np.array([[2.0, 4.0]]), np.array([3.0]))
    mixed = costs.with_hands(np.array([[1.0, 0.0]]), np.array([[1.0, 0.0], [-1.0, 0.0]]))
    assert_allclose(mixed, [[1.0, 3.0]])  # both halves: 2 and 0, 4 and 2


def test_the_scale_of_a_part_is_the_root_of_its_share() -> None:
    part = half_a_cow()
    found = sides(part.mesh, cow().posed(2))
    share = part.mesh.area / cow().rest.area
    assert found.is_part
    assert not found.is_swapped
    assert found.scale == pytest.approx(np.sqrt(share), rel=STEP - 1.0)
    assert found.scale >= STEP ** -(SCALES - 1)


def test_a_whole_and_its_part_are_swapped() -> None:
    found = sides(cow().posed(2), half_a_cow().mesh)
    assert found.is_part
    assert found.is_swapped


def test_the_same_piece_in_two_poses_is_a_part_of_neither() -> None:
    part = half_a_cow()
    other = TriangleMesh(cow().posed(2).vertices[part.origin], part.mesh.faces)
    found = sides(part.mesh, other)
    assert found.scale == 1.0
    assert not found.is_part


def test_a_small_hole_makes_no_part() -> None:
    torn = TriangleMesh(cow().rest.vertices, cow().rest.faces[1:])
    found = sides(torn, cow().posed(2))
    assert found.scale == 1.0
    assert not found.is_part


def test_one_of_two_components_is_a_part() -> None:
    large, small = bumpy_sphere(seed=1), scaled(bumpy_sphere(seed=2), 0.8)
    both = union(large, translated(small, (5.0, 0.0, 0.0)))
    found = sides(large, both)
    assert found.is_part
    assert found.scale == pytest.approx(np.sqrt(large.area / both.area), rel=STEP - 1.0)


def test_the_first_points_have_cells_of_their_own() -> None:
    surface = Surface.of(solved(bumpy_sphere()), 64)
    few = surface.with_points(10)
    assert_array_equal(few.points, surface.points[:10])
    assert_array_equal(few.cells, Surface.of(solved(bumpy_sphere()), 10).cells)
    assert few.weights.sum() == pytest.approx(1.0)
