"""Maps from landmarks and their twins, and which of them is chosen."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.meshes import bumpy_sphere
from workers.correspondence.hypotheses import (
    Hypothesis,
    best,
    choose,
    from_landmarks,
    is_mirrored,
    twins,
)
from workers.correspondence.sides import Sides
from workers.creatures import make_creature
from workers.geometry.arrays import lengths
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.storage.shipped_models import shipped_whitening


def sides(first: TriangleMesh, second: TriangleMesh) -> Sides:
    one, other = (Solution(m, compute_spectrum(m, n_eigenpairs=60)) for m in (first, second))
    return Sides.of(one, other, shipped_whitening())


@cache
def cats() -> Sides:
    cat = make_creature("cat", seed=5, vertices=2500)
    return sides(cat.rest, cat.posed(3))


@cache
def balls() -> Sides:
    return sides(bumpy_sphere(), bumpy_sphere())


def off(one: Hypothesis) -> float:
    """Mean distance from the truth through space, of shapes with the same vertices."""
    vertices = one.pair.whole.mesh.vertices
    return float(lengths(vertices[one.images] - vertices).mean())


@cache
def exchanged() -> Hypothesis:
    """The map that exchanges left and right of the cat."""
    found = best(from_landmarks(cats(), -1.0), -1.0)
    assert found is not None
    return found


def test_the_twin_of_a_map_that_exchanges_left_and_right_is_right() -> None:
    (twin,) = twins(cats(), [exchanged()], 1.0)
    assert off(exchanged()) > 0.08
    assert off(twin) < 0.5 * off(exchanged())
    assert twin.orientation > 0.5


def test_a_map_of_the_wanted_orientation_needs_no_twin() -> None:
    assert twins(cats(), [exchanged()], -1.0) == []


def test_the_twin_fits_badly_where_a_shape_has_no_reflection() -> None:
    right = best(from_landmarks(balls(), 1.0), 1.0)
    assert right is not None
    found = [one for one in twins(balls(), [right], -1.0) if one.misfit < 2.0 * right.misfit]
    assert found == []


def fits(misfit: float, orientation: float) -> Hypothesis:
    return replace(exchanged(), misfit=misfit, orientation=orientation)


def test_of_two_that_fit_alike_the_one_that_keeps_the_orientation_is_chosen() -> None:
    kept, reversed_ = fits(1.2, 0.5), fits(1.0, -0.5)
    assert choose([reversed_, kept], (1.0, -1.0)) is kept
    assert is_mirrored([reversed_, kept]) is None


@pytest.mark.parametrize(("kept", "reversed_", "mirrored"), [(9.0, 1.0, True), (1.0, 9.0, False)])
def test_one_that_fits_clearly_better_is_chosen(
    kept: float, reversed_: float, mirrored: bool
) -> None:
    tried = [fits(kept, 0.5), fits(reversed_, -0.5), fits(20.0, 0.5)]
    assert choose(tried, (1.0, -1.0)) is tried[int(mirrored)]
    assert is_mirrored(tried) is mirrored


def test_only_the_orientation_that_is_asked_for_is_chosen() -> None:
    tried = [fits(1.0, 0.5), fits(9.0, -0.5)]
    assert choose(tried, (-1.0,)) is tried[1]


def test_any_map_is_better_than_none() -> None:
    tried = [fits(1.0, 0.5), fits(2.0, 0.5)]
    assert choose(tried, (-1.0,)) is tried[0]
    assert is_mirrored(tried) is False
    assert is_mirrored([fits(1.0, 0.0)]) is None


def test_maps_are_the_same_whatever_was_computed_before() -> None:
    again = best(from_landmarks(cats(), -1.0), -1.0)
    assert again is not None
    assert np.array_equal(again.images, exchanged().images)
