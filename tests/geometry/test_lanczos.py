"""Block Lanczos: its basis stays nearly orthogonal, and its Ritz pairs are eigenpairs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from workers.geometry.arrays import FloatArray
from workers.geometry.lanczos import BlockLanczos

_N = 700


def _process(eigenvalues: FloatArray, *, block: int, capacity: int) -> BlockLanczos:
    """A process on a diagonal operator, kept away from the first unit vector."""
    deflated = np.zeros((len(eigenvalues), 1))
    deflated[0] = 1.0
    return BlockLanczos(
        lambda columns: eigenvalues[:, None] * columns,
        n_rows=len(eigenvalues),
        block=block,
        capacity=capacity,
        deflated=deflated,
        rng=np.random.default_rng(0),
    )


def _inverse_distances() -> FloatArray:
    """What shift-and-invert sees: most near zero, a few large ones of both signs."""
    return np.asarray(1.0 / (np.arange(_N) - 40.3), dtype=np.float64)


@pytest.mark.parametrize("block", [1, 4, 8])
def test_ritz_vectors_stay_orthonormal_long_after_many_have_converged(block: int) -> None:
    eigenvalues = _inverse_distances()
    process = _process(eigenvalues, block=block, capacity=320)
    while not process.is_full:
        process.step()
    ritz = process.ritz_pairs()
    converged = np.flatnonzero(ritz.residuals < 1e-12 * np.abs(ritz.values))
    assert len(converged) > 60
    vectors = ritz.vectors(converged)
    assert_allclose(vectors.T @ vectors, np.eye(len(converged)), atol=1e-9)
    assert_allclose(vectors[0], 0.0, atol=1e-12)


def test_a_converged_value_is_found_once() -> None:
    eigenvalues = _inverse_distances()
    process = _process(eigenvalues, block=4, capacity=320)
    while not process.is_full:
        process.step()
    ritz = process.ritz_pairs()
    below = np.sort(ritz.values[ritz.values < 0.0])
    assert_allclose(below, np.sort(eigenvalues[1:41]), rtol=1e-12)


def test_one_ritz_value_and_its_residual_are_those_of_all() -> None:
    process = _process(_inverse_distances(), block=4, capacity=120)
    for _ in range(20):
        process.step()
    ritz = process.ritz_pairs()
    for index in (0, 5, 20, 60, 79):
        value, residual = process.remainder_at(index)
        assert_allclose(value, ritz.values[index], atol=1e-14)
        assert_allclose(residual, ritz.residuals[index], rtol=1e-5, atol=1e-13)


def test_an_exhausted_space_goes_on_in_new_directions() -> None:
    # three eigenvalues: a block of two spans an invariant space after three steps
    eigenvalues = np.repeat([5.0, 1.0, 2.0, 3.0], [1, 15, 15, 15])
    process = _process(eigenvalues, block=2, capacity=40)
    for _ in range(12):
        process.step()
    ritz = process.ritz_pairs()
    distances = np.abs(ritz.values[:, None] - [1.0, 2.0, 3.0]).min(axis=1)
    assert_allclose(distances, 0.0, atol=1e-9)
    vectors = ritz.vectors(np.arange(24))
    assert_allclose(vectors.T @ vectors, np.eye(24), atol=1e-9)
