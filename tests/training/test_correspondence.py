"""Points of a transformation, found again on the shape that it was made of."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import bent_rectangle, bumpy_sphere, cylinder, rectangle, renumbered
from workers.errors import InsufficientTrainingDataError
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.geometry.views import View, default_view, open_view
from workers.training.correspondence import CorrespondingPoints, Solved, corresponding_points

OPEN = open_view(working_vertices=500)
CLOSED = default_view(working_vertices=500)


def solved(mesh: TriangleMesh, view: View) -> Solved:
    return Solved(mesh, solve(clean(mesh).mesh, view))


def aligned(found: CorrespondingPoints, column: int) -> tuple[np.ndarray, np.ndarray]:
    """Values of an eigenfunction on both shapes, of the same sign."""
    first, second = found.points[:, column], found.transformed_points[:, column]
    return first, second * np.sign(np.sum(first * second))


def test_eigenfunctions_of_a_folded_sheet_are_those_of_the_flat_one() -> None:
    """Folding is isometric; the working meshes are simplified apart from each other."""
    flat, bent = rectangle(66, 20, 3.3, 1.0), bent_rectangle(66, 20, 3.3, 1.0)
    mesh, origin = renumbered(bent, np.random.default_rng(1))
    found = corresponding_points(solved(flat, OPEN), solved(mesh, OPEN), origin)
    assert len(found.weights) >= 400
    assert_allclose(found.weights.sum(), 1.0)
    for column in range(3):  # λ = π² p²/3.3², p = 1, 2, 3: all simple
        first, second = aligned(found, column)
        # linear between 500 vertices
        assert_allclose(first, second, atol=0.08 * np.abs(first).max())


def test_duplicate_and_unused_vertices_of_the_file_do_not_matter() -> None:
    """Cleaning renumbers; what counts is where the vertices of the file are."""
    mesh = bumpy_sphere(3, seed=4)
    spare = np.concatenate([[[9.0, 9.0, 9.0]], mesh.vertices])
    wide = TriangleMesh(spare, mesh.faces + 1)
    far = TriangleMesh(2.0 * spare, mesh.faces + 1)
    found = corresponding_points(solved(wide, CLOSED), solved(far, CLOSED), np.arange(len(spare)))
    first, second = aligned(found, 0)
    assert_allclose(first, 2.0 * second, atol=0.02 * np.abs(first).max())


def test_points_on_caps_correspond_to_nothing() -> None:
    """A cylinder of radius 1 and height 2: its closed ends are a third of the area."""
    tube = cylinder(48, 16, radius=1.0, height=2.0)
    shape = solved(tube, CLOSED)
    ends = np.isclose(np.abs(shape.solution.mesh.vertices[:, 2]), 1.0, atol=1e-3)
    ends |= np.isclose(shape.solution.mesh.vertices[:, 2] % 2.0, 0.0, atol=1e-3)
    rim = np.linalg.norm(shape.solution.mesh.vertices[:, :2], axis=1) > 0.9
    found = corresponding_points(shape, shape, np.arange(tube.n_vertices))
    on_caps = int(np.count_nonzero(ends & ~rim))
    assert on_caps > 50
    assert len(found.weights) <= len(shape.solution.sample().indices) - 0.8 * on_caps


def test_too_few_points_are_refused() -> None:
    """Another shape altogether: next to no point lies on it."""
    shape, other = bumpy_sphere(3, seed=1), bumpy_sphere(3, seed=2)
    inside = TriangleMesh(0.5 * other.vertices, other.faces)
    origin = np.zeros(other.n_vertices, dtype=np.int64)
    moved = TriangleMesh(shape.vertices + 5.0, shape.faces)
    with pytest.raises(InsufficientTrainingDataError, match="at least 100"):
        corresponding_points(
            Solved(moved, solved(shape, CLOSED).solution), solved(inside, CLOSED), origin
        )
