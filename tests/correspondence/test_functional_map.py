"""Functional maps that are fitted to few matches."""

import numpy as np
from numpy.testing import assert_allclose

from tests.meshes import bumpy_sphere, scaled
from workers.correspondence.functional_map import Matches, Pair, zoom_out
from workers.correspondence.surface import Surface
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum


def pair() -> Pair:
    mesh = bumpy_sphere()
    solved = Solution(mesh, compute_spectrum(mesh, n_eigenpairs=60))
    larger = scaled(mesh, 3.0)
    other = Solution(larger, compute_spectrum(larger, n_eigenpairs=60))
    none = np.zeros((mesh.n_vertices, 1))
    surfaces = Surface.of(solved, 24), Surface.of(other, 24)
    return Pair(*surfaces, 1.0, (none, none), is_part=False)


def fitted(both: Pair, count: int, stiffness: float) -> FloatArray:
    """C of so many functions, fitted to the true matches of 24 points."""
    points = both.part.points
    every = np.arange(both.part.mesh.n_vertices)
    functional, _ = zoom_out(
        both,
        Matches(points, points, np.ones(len(points))),
        counts=(count,),
        samples=every,
        targets=every,
        hint=0.0,
        stiffness=stiffness,
    )
    return functional


def test_unlike_frequencies_are_those_of_other_functions() -> None:
    unlike = pair().detuning(30, 30)
    assert_allclose(np.diag(unlike), 0.0, atol=1e-12)
    assert_allclose(unlike[0, -1], 1.0, rtol=1e-6)
    assert unlike.max() <= 1.0


def test_a_stiff_map_of_more_functions_than_matches_keeps_their_frequencies() -> None:
    both = pair()
    loose, stiff = (np.abs(fitted(both, 40, one)) for one in (0.0, 3.0))
    unlike = both.detuning(40, 40) > 0.25
    assert stiff[unlike].max() < 0.2 * loose[unlike].max()


def test_a_map_of_fewer_functions_than_matches_hardly_needs_to_be_stiff() -> None:
    both = pair()
    identity = np.abs(fitted(both, 8, 0.0))
    assert_allclose(identity, np.eye(8), atol=1e-4)
    assert_allclose(np.abs(fitted(both, 8, 3.0)), np.eye(8), atol=1e-4)
