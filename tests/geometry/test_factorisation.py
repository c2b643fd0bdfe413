"""Symmetric factors: they solve, and their pivots have the signs of the eigenvalues."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

from tests.meshes import bumpy_sphere
from workers.geometry.factorisation import SymmetricFactor
from workers.geometry.laplacian import mesh_laplacian


@pytest.mark.parametrize("threshold", [0.0, 1.0])
def test_solving_inverts_the_matrix_for_one_and_for_several_columns(threshold: float) -> None:
    laplacian = mesh_laplacian(bumpy_sphere(2))
    matrix = laplacian.stiffness + sparse.diags_array(laplacian.areas)
    factor = SymmetricFactor(matrix, pivot_threshold=threshold)
    columns = np.random.default_rng(0).normal(size=(matrix.shape[0], 3))
    assert_allclose(matrix @ factor.solve(columns), columns, atol=1e-12)
    assert_allclose(factor.solve(columns[:, 0]), factor.solve(columns)[:, 0], rtol=1e-9, atol=1e-12)


def test_pivots_of_a_definite_matrix_are_positive_and_multiply_to_its_determinant() -> None:
    matrix = sparse.csc_array(np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 1.0], [0.0, 1.0, 2.0]]))
    factor = SymmetricFactor(matrix)
    assert not factor.exchanged_rows
    assert (factor.pivots > 0).all()
    assert_allclose(factor.pivots.prod(), 18.0, rtol=1e-14)


def test_pivots_have_the_signs_of_the_eigenvalues() -> None:
    matrix = np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 3.0], [0.0, 3.0, -5.0]])
    factor = SymmetricFactor(sparse.csc_array(matrix))
    assert not factor.exchanged_rows
    assert (factor.pivots < 0).sum() == (np.linalg.eigvalsh(matrix) < 0).sum()


def test_rows_are_exchanged_where_no_diagonal_pivot_exists() -> None:
    assert SymmetricFactor(sparse.csc_array(np.array([[0.0, 1.0], [1.0, 0.0]]))).exchanged_rows


def test_a_singular_matrix_is_an_error() -> None:
    with pytest.raises(RuntimeError):
        SymmetricFactor(sparse.csc_array(np.array([[1.0, 1.0], [1.0, 1.0]])))
