"""The certified eigensolver against LAPACK, and on what makes solvers lie."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse

from tests.meshes import bumpy_sphere, icosphere, rectangle, union
from workers.errors import SpectrumError
from workers.geometry import eigensolver
from workers.geometry.arrays import FloatArray
from workers.geometry.certificate import Candidate, is_certified
from workers.geometry.eigensolver import DENSE_VERTICES, smallest_eigenpairs
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


def test_what_no_strategy_can_certify_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(eigensolver, "is_certified", lambda *_: False)
    monkeypatch.setattr(eigensolver, "_LAST_RESORT_VERTICES", 0)
    laplacian = mesh_laplacian(bumpy_sphere(3))
    with pytest.raises(SpectrumError, match="could not be certified"):
        smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 10)


@pytest.mark.parametrize("strategy", eigensolver._STRATEGIES)
def test_every_strategy_by_itself_gives_the_same_eigenvalues(
    strategy: eigensolver._Strategy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(eigensolver, "_LAST_RESORT_VERTICES", 0)
    laplacian = mesh_laplacian(bumpy_sphere(4))
    expected, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 30)
    monkeypatch.setattr(eigensolver, "_STRATEGIES", (strategy,))
    values, _ = smallest_eigenpairs(laplacian.stiffness, laplacian.areas, 30)
    assert_allclose(values, expected, rtol=1e-10)
