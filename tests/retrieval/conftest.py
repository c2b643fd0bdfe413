"""A described shape without symmetry, for several tests of this package."""

import pytest

from tests.meshes import bumpy_sphere
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import Spectrum, compute_spectrum

Solved = tuple[TriangleMesh, Spectrum]


@pytest.fixture(scope="session")
def bumpy() -> Solved:
    """642 vertices, 60 eigenpairs, all eigenvalues simple."""
    mesh = bumpy_sphere()
    return mesh, compute_spectrum(mesh, n_eigenpairs=60)
