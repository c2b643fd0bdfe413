"""Counting eigenvalues by the pivots of a factor, and refusing what cannot be believed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

from tests.meshes import bumpy_sphere, rectangle
from workers.geometry.inertia import factorise, factorise_between
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh


def _standard_form(mesh: TriangleMesh) -> sparse.csc_array:
    laplacian = mesh_laplacian(mesh)
    scaling = sparse.diags_array(np.sqrt(laplacian.areas.sum() / laplacian.areas))
    return sparse.csc_array(scaling @ laplacian.stiffness @ scaling)


@pytest.mark.parametrize("mesh", [bumpy_sphere(2), rectangle(14, 9, 3, 2)])
def test_negative_pivots_count_the_eigenvalues_below_the_shift(mesh: TriangleMesh) -> None:
    matrix = _standard_form(mesh)
    eigenvalues = np.linalg.eigvalsh(matrix.toarray())
    for shift in [-1.0, 5.0, 40.0, 333.0, 700.0, 1e5, 1e9]:
        factor = factorise(matrix, shift)
        assert factor is not None
        assert factor.n_below == np.count_nonzero(eigenvalues < shift)


def test_solving_inverts_the_shifted_matrix() -> None:
    matrix = _standard_form(bumpy_sphere(2))
    factor = factorise(matrix, 100.0)
    assert factor is not None
    block = np.random.default_rng(0).normal(size=(matrix.shape[0], 3))
    solution = factor.solve(block)
    assert_allclose(matrix @ solution - 100.0 * solution, block, atol=1e-9)


def test_a_factor_that_needed_pivoting_is_refused() -> None:
    # One eigenvalue is below zero, but no diagonal pivot exists: signs would tell nothing.
    matrix = sparse.csc_array(np.array([[0.0, 1.0], [1.0, 0.0]]))
    assert factorise(matrix, 0.0) is None


def test_a_shift_on_an_eigenvalue_is_refused() -> None:
    assert factorise(sparse.diags_array([1.0, 2.0, 3.0]).tocsc(), 2.0) is None


def test_digits_lost_to_a_tiny_pivot_are_noticed() -> None:
    # the leaves of a star are eliminated first, and 1e-14 wipes out its centre
    matrix = np.array([[1e-14, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 0.5]])
    assert factorise(sparse.csc_array(matrix), 0.0) is None


def test_a_shift_that_hits_an_eigenvalue_is_moved_within_its_interval() -> None:
    factor = factorise_between(sparse.diags_array([1.0, 2.0, 3.0]).tocsc(), 1.5, 2.5)
    assert factor is not None
    assert 1.5 < factor.shift < 2.5
    assert factor.n_below == (1 if factor.shift < 2.0 else 2)
