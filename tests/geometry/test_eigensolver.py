"""The certified eigensolver against LAPACK, and on what makes solvers lie."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse

from tests.meshes import bumpy_sphere, icosphere, rectangle, union
from workers.errors import SpectrumError
from workers.geometry.arrays import FloatArray
from workers.geometry.certificate import Candidate, is_certified, is_complete, polished
from workers.geometry.eigensolver import (
    DENSE_VERTICES,
    FEW,
    FOR_FEW,
    STRATEGIES,
    Strategy,
    place_shift,
    smallest_eigenpairs,
)
from workers.geometry.inertia import SOUND_ERROR, factorise
from workers.geometry.laplacian import Laplacian, cotangent_laplacian, mesh_laplacian
from workers.geometry.mesh import TriangleMesh


def _by_lapack(laplacian: Laplacian, count: int) -> FloatArray:
    """Smallest nonzero eigenvalues of the dense standard form."""
    roots = np.sqrt(laplacian.areas)
    matrix = laplacian.stiffness.toarray() / np.outer(roots, roots)
    return np.asarray(scipy.linalg.eigvalsh(matrix)[1 : count + 1], dtype=np.float64)


def _star(copies: int, nx: int, ny: int) -> Laplacian:
    """Rectangles that share one corner: connected, each eigenvalue ``copies`` - 1 times."""
    leaf = rectangle(nx, ny, 2.0, 1.0)
    others = leaf.n_vertices - 1
    faces = np.concatenate(
        [np.where(leaf.faces == 0, 0, leaf.faces + i * others) for i in range(copies)]
    )
    corners = np.concatenate([leaf.vertices[leaf.faces]] * copies)
    return cotangent_laplacian(corners, faces, copies * others + 1)


def _with_slivers(mesh: TriangleMesh, height: float, count: int) -> TriangleMesh:
    """The mesh with ``count`` vertices inserted into faces, almost on an edge."""
    chosen = mesh.faces[:: mesh.n_faces // count][:count]
    a, b, c = (mesh.vertices[chosen[:, i]] for i in range(3))
    new = (1.0 - height) * (0.4 * a + 0.6 * b) + height * c
    middle = mesh.n_vertices + np.arange(count)
    kept = np.delete(mesh.faces, np.arange(0, mesh.n_faces, mesh.n_faces // count)[:count], axis=0)
    parts = [(0, 1), (1, 2), (2, 0)]
    cut = [np.stack([chosen[:, i], chosen[:, j], middle], axis=1) for i, j in parts]
    return TriangleMesh(np.concatenate([mesh.vertices, new]), np.concatenate([kept, *cut]))


@pytest.mark.parametrize("count", [1, 3, 10, 100])
@pytest.mark.parametrize("mesh", [bumpy_sphere(3), rectangle(40, 30, 2, 1), icosphere(3)])
def test_lanczos_and_lapack_agree(mesh: TriangleMesh, count: int) -> None:
    assert mesh.n_vertices > DENSE_VERTICES
    laplacian = mesh_laplacian(mesh)
    values, vectors = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, count)
    assert_allclose(values, _by_lapack(laplacian, count), rtol=1e-10)
    gram = vectors.T @ (laplacian.areas[:, None] * vectors)
    assert_allclose(gram, np.eye(count), atol=1e-12)
    residuals = laplacian.stiffness @ vectors - values * (laplacian.areas[:, None] * vectors)
    assert np.linalg.norm(residuals) < 1e-7 * np.linalg.norm(laplacian.stiffness @ vectors)


def test_the_constant_function_is_dropped_and_orthogonal_to_the_rest() -> None:
    laplacian = mesh_laplacian(bumpy_sphere(3))
    values, vectors = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 20)
    assert values[0] > 0.1
    assert_allclose(laplacian.areas @ vectors, 0.0, atol=1e-10)


def test_the_same_input_gives_the_same_bits() -> None:
    laplacian = mesh_laplacian(bumpy_sphere(3))
    first = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 50)
    second = smallest_eigenpairs(laplacian.stiffness.copy(), laplacian.areas.copy(), 50)
    assert_array_equal(first[0], second[0])
    assert_array_equal(first[1], second[1])


@pytest.mark.parametrize(("copies", "nx", "ny"), [(12, 12, 6), (60, 6, 3)])
def test_multiplicities_above_the_block_are_found_in_full(copies: int, nx: int, ny: int) -> None:
    laplacian = _star(copies, nx, ny)
    assert len(laplacian.areas) > DENSE_VERTICES
    values, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 100)
    assert_allclose(values, _by_lapack(laplacian, 100), rtol=1e-9)
    assert_allclose(values[: copies - 1], values[0], rtol=1e-9)


def test_a_multiplicity_above_the_number_wanted_is_certified_from_below() -> None:
    laplacian = _star(150, 4, 2)
    values, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 100)
    assert_allclose(values, _by_lapack(laplacian, 100), rtol=1e-9)


@pytest.mark.parametrize("height", [1e-3, 1e-5, 1e-7])
def test_slivers_change_nothing_but_a_little(height: float) -> None:
    mesh = bumpy_sphere(3)
    plain, sliver = mesh_laplacian(mesh), mesh_laplacian(_with_slivers(mesh, height, 40))
    values, vectors = smallest_eigenpairs(sliver.stiffness, sliver.areas, 50)
    gram = vectors.T @ (sliver.areas[:, None] * vectors)
    assert_allclose(gram, np.eye(50), atol=1e-10)
    # the surface is the same; the lumping of 40 faces out of 1,280 differs
    assert_allclose(values, _by_lapack(plain, 50), rtol=5e-3)


def test_a_long_thin_surface_has_the_spectrum_of_a_line() -> None:
    # Weyl's estimate is off by a factor of 4,000 here; the shift has to be found by counting.
    mesh = rectangle(2000, 1, 2000.0, 0.5)
    laplacian = mesh_laplacian(mesh)
    values, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 30)
    exact = 2.0 * (1.0 - np.cos(np.pi * np.arange(1, 31) / 2000))  # of the lumped line
    assert_allclose(values, exact, rtol=1e-7)


def test_fewer_vertices_than_wanted_give_all_there_are() -> None:
    mesh = rectangle(2, 2)
    laplacian = mesh_laplacian(mesh)
    values, vectors = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 100)
    assert values.shape == (8,)
    assert vectors.shape == (9, 8)


def test_two_components_are_refused() -> None:
    mesh = union(icosphere(3), icosphere(3))
    laplacian = mesh_laplacian(mesh)
    with pytest.raises(SpectrumError, match="not connected"):
        smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 10)


def test_a_candidate_that_misses_one_eigenvalue_is_not_certified() -> None:
    laplacian = mesh_laplacian(bumpy_sphere(2))
    masses = laplacian.areas / laplacian.areas.sum()
    roots = np.sqrt(masses)
    scaling = sparse.diags_array(1.0 / roots)
    matrix = sparse.csc_array(scaling @ laplacian.stiffness @ scaling)
    values = np.linalg.eigvalsh(matrix.toarray())[1:20]
    whole = Candidate(values, values - 1e-9, values + 1e-9, np.arange(19))
    assert is_certified(matrix, roots, whole, 10)
    for missing in range(10):
        rest = np.delete(values, missing)
        lacking = replace(whole, values=rest, lower=rest - 1e-9, upper=rest + 1e-9)
        assert not is_certified(matrix, roots, lacking, 10)


def _candidate(values: list[float]) -> Candidate:
    """All nonzero eigenvalues of a matrix, known to 1e-9."""
    found = np.array(values)
    return Candidate(found, found - 1e-9, found + 1e-9, np.arange(len(found)))


def _beside_a_stiff_vertex(eigenvalues: list[float], stiffness: float) -> sparse.csc_array:
    """A full matrix of these eigenvalues, and one stiff vertex as slivers make it."""
    n = len(eigenvalues)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(n, n)))[0]
    matrix = turn @ np.diag(eigenvalues) @ turn.T
    blocks = [0.5 * (matrix + matrix.T), np.array([[stiffness]])]
    return sparse.csc_array(sparse.block_diag(blocks))


@pytest.mark.parametrize(
    "values",
    [
        [1.0, 2.0, 2.001, 3.0, 4.0],
        [1.0, 2.0, 2.0000001, 2.0000002, 2.0000003, 4.0],
    ],
)
def test_a_gap_too_narrow_for_its_factor_gives_way_to_a_wider_one(values: list[float]) -> None:
    # Rounding of 1e-16 in a trace of 1e14 moves eigenvalues by 0.01: nobody can tell on which side
    # of a shift in the first gap they lie, but in a gap of 1 and more anybody can.
    matrix = _beside_a_stiff_vertex([0.0, *values], 1e14)
    assert is_certified(matrix, np.ones(matrix.shape[0]), _candidate(values), 2)


def test_gaps_that_are_all_too_narrow_certify_nothing() -> None:
    values = [1.0, 1.001, 1.002, 1.003]
    matrix = _beside_a_stiff_vertex([0.0, *values], 1e14)
    assert not is_certified(matrix, np.ones(matrix.shape[0]), _candidate(values), 2)


def test_a_wider_gap_does_not_certify_what_misses_an_eigenvalue() -> None:
    values = [1.0, 1.5, 2.0, 2.001, 3.0, 4.0]
    matrix = _beside_a_stiff_vertex([0.0, *values], 1e14)
    for missing in (0, 1, 2):
        lacking = _candidate(values[:missing] + values[missing + 1 :])
        assert not is_certified(matrix, np.ones(matrix.shape[0]), lacking, 3)


def test_a_shift_that_costs_digits_gives_way_to_another_in_the_same_gap() -> None:
    # In the middle of the gap, 2, the first pivot is 1e-5 and the factor loses three digits.
    full = np.array([[2.00001, 0.0, 1.0], [0.0, 3.0, 1.0], [1.0, 1.0, 2.5]])
    values = np.linalg.eigvalsh(full)  # (3,): 1.0, 2.5, 4.0
    matrix = sparse.csc_array(sparse.block_diag([full, np.zeros((1, 1)), np.array([[1e13]])]))
    middle = factorise(matrix, 2.0)
    assert middle is not None
    assert middle.backward_error > SOUND_ERROR
    upper = values + np.array([0.5, 1e-9, 1e-9])
    candidate = Candidate(values, values - np.array([1e-9, 5e-6, 1e-9]), upper, np.arange(3))
    assert is_certified(matrix, np.ones(5), candidate, 1)


def test_what_no_strategy_can_certify_is_solved_densely_or_an_error() -> None:
    laplacian = mesh_laplacian(bumpy_sphere(3))
    n = len(laplacian.areas)
    too_wide = (Strategy(block=n, position=0.45),)  # no room for a second block
    values, _ = smallest_eigenpairs(
        laplacian.stiffness, laplacian.areas, 10, strategies=too_wide, last_resort=n
    )
    assert_allclose(values, _by_lapack(laplacian, 10), rtol=1e-10)
    with pytest.raises(SpectrumError, match="could not be certified"):
        smallest_eigenpairs(
            laplacian.stiffness, laplacian.areas, 10, strategies=too_wide, last_resort=n - 1
        )


@pytest.mark.parametrize("strategy", [FOR_FEW, *STRATEGIES])
def test_every_strategy_by_itself_gives_the_same_eigenvalues(strategy: Strategy) -> None:
    laplacian = mesh_laplacian(bumpy_sphere(4))
    expected, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 30)
    values, _ = smallest_eigenpairs(
        laplacian.stiffness, laplacian.areas, 30, strategies=(strategy,), last_resort=0
    )
    assert_allclose(values, expected, rtol=1e-10)


def _unit_area_form(mesh: TriangleMesh) -> tuple[sparse.csc_array, FloatArray]:
    """S at area 1, and its zero mode."""
    laplacian = mesh_laplacian(mesh)
    roots = np.sqrt(laplacian.areas / laplacian.areas.sum())
    scaling = sparse.diags_array(1.0 / roots)
    return sparse.csc_array(scaling @ laplacian.stiffness @ scaling), roots


def test_the_factor_of_the_search_certifies_what_lies_below_its_shift() -> None:
    matrix, roots = _unit_area_form(bumpy_sphere(2))
    values = np.linalg.eigvalsh(matrix.toarray())[1:30]
    factor = factorise(matrix, 0.5 * (values[11] + values[12]))
    assert factor is not None
    whole = Candidate(values, values - 1e-9, values + 1e-9, np.arange(29))
    assert is_complete(matrix, roots, whole, factor)
    for missing in range(12):
        rest = np.delete(values, missing)
        lacking = replace(whole, values=rest, lower=rest - 1e-9, upper=rest + 1e-9)
        assert not is_complete(matrix, roots, lacking, factor)
    doubled = np.sort(np.append(values, values[3]))  # one more than there are
    twice = replace(whole, values=doubled, lower=doubled - 1e-9, upper=doubled + 1e-9)
    assert not is_complete(matrix, roots, twice, factor)
    vague = replace(whole, upper=np.where(np.arange(29) == 11, values[12], whole.upper))
    assert not is_complete(matrix, roots, vague, factor)
    nothing_above = replace(
        whole, values=values[:12], lower=whole.lower[:12], upper=whole.upper[:12]
    )
    assert not is_complete(matrix, roots, nothing_above, factor)


@pytest.mark.parametrize("position", [1.2, 1.6])
def test_a_position_beyond_one_has_all_wanted_eigenvalues_below_the_shift(position: float) -> None:
    for mesh in (bumpy_sphere(3), rectangle(60, 20, 30.0, 1.0)):
        factor = place_shift(_unit_area_form(mesh)[0], 10, position)
        assert factor is not None
        assert 10 <= factor.n_below - 1 <= 24


@pytest.mark.parametrize("spoilt", [0.0, 1e-11, 1e-6, 1e-2])
def test_vectors_that_span_the_eigenspace_become_its_eigenvectors(spoilt: float) -> None:
    matrix, _ = _unit_area_form(bumpy_sphere(2))
    values, vectors = np.linalg.eigh(matrix.toarray())
    mixing = np.eye(10) + spoilt * np.random.default_rng(2).normal(size=(10, 10))
    factor = factorise(matrix, 0.5 * (values[5] + values[6]))
    assert factor is not None
    found = polished(matrix, factor, vectors[:, 1:11] @ mixing)
    assert found is not None
    assert_allclose(found[0], values[1:11], rtol=1e-11)
    assert_allclose(found[1].T @ found[1], np.eye(10), atol=1e-13)
    assert_allclose(matrix @ found[1], found[0] * found[1], atol=1e-7 * values[10])


def test_few_eigenpairs_are_the_first_of_many() -> None:
    laplacian = mesh_laplacian(bumpy_sphere(4))
    many, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 2 * FEW)
    for count in (1, 5, FEW - 1):
        few, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, count)
        assert_allclose(few, many[:count], rtol=1e-10)
