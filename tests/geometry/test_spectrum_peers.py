"""Eigenvalues against other people's programs, on meshes made here and on real ones.

Real meshes are looked for in the folder that PROTEUS_REAL_MESHES names, or in ``../shared/data``
beside the project.
"""

import os
from pathlib import Path

import lapy
import numpy as np
import pytest
import robust_laplacian
import trimesh
from numpy.testing import assert_allclose
from scipy.sparse.linalg import eigsh

from tests.meshes import bumpy_sphere, icosphere, rectangle, torus
from workers.geometry.arrays import FloatArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import compute_spectrum

_MADE = {
    "bumpy sphere": bumpy_sphere(3),
    "icosphere": icosphere(3),
    "rectangle": rectangle(40, 30, 4.0, 3.0),
    "torus": torus(50, 30),
}
_REAL = [
    "poses/lion/lion-reference.ply",
    "poses/cow/cow-reference.ply",
    "poses/horse/horse-01.ply",
    "objects/goathead.ply",
    "objects/wingnut.ply",
]


def _with_unit_area(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices / np.sqrt(mesh.area), mesh.faces)


def _by_lapy(mesh: TriangleMesh, count: int) -> FloatArray:
    """LaPy's eigenvalues with the lumped mass: the same operator, another program."""
    solver = lapy.Solver(lapy.TriaMesh(mesh.vertices, mesh.faces), lump=True, use_cholmod=False)
    return np.asarray(np.sort(solver.eigs(k=count + 1)[0])[1:], dtype=np.float64)


def _by_robust_laplacian(mesh: TriangleMesh, count: int) -> FloatArray:
    """Eigenvalues of the intrinsic Delaunay Laplacian: another operator of the same surface."""
    stiffness, masses = robust_laplacian.mesh_laplacian(
        mesh.vertices, mesh.faces, mollify_factor=0.0
    )
    values = eigsh(stiffness.tocsc(), k=count + 1, M=masses.tocsc(), sigma=-0.01)[0]
    return np.asarray(np.sort(values)[1:], dtype=np.float64)


def _real(name: str) -> TriangleMesh:
    default = Path(__file__).parents[2].parent / "shared" / "data"
    path = Path(os.environ.get("PROTEUS_REAL_MESHES", default)) / name
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    loaded = trimesh.load_mesh(path)
    return TriangleMesh(loaded.vertices, loaded.faces)


@pytest.mark.parametrize("name", _MADE)
def test_lapy_gives_the_same_eigenvalues(name: str) -> None:
    mesh = _with_unit_area(_MADE[name])
    values = compute_spectrum(mesh, n_eigenpairs=60).eigenvalues
    assert_allclose(values, _by_lapy(mesh, 60), rtol=1e-9)


@pytest.mark.parametrize("name", _MADE)
def test_robust_laplacian_gives_nearly_the_same_eigenvalues(name: str) -> None:
    mesh = _with_unit_area(_MADE[name])
    values = compute_spectrum(mesh, n_eigenpairs=30).eigenvalues
    assert_allclose(values, _by_robust_laplacian(mesh, 30), rtol=2e-2)  # flips change W a little


@pytest.mark.slow
@pytest.mark.parametrize("name", _REAL)
def test_lapy_gives_the_same_eigenvalues_on_real_meshes(name: str) -> None:
    mesh = _with_unit_area(_real(name))
    values = compute_spectrum(mesh).eigenvalues
    assert_allclose(values, _by_lapy(mesh, 100), rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", _REAL)
def test_robust_laplacian_is_close_on_real_meshes(name: str) -> None:
    mesh = _with_unit_area(_real(name))
    values = compute_spectrum(mesh, n_eigenpairs=30).eigenvalues
    assert_allclose(values, _by_robust_laplacian(mesh, 30), rtol=5e-2)
