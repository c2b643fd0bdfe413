"""A described shape without symmetry, for several tests of this package."""

import pytest

from tests.meshes import bumpy_sphere
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum


@pytest.fixture(scope="session")
def bumpy() -> Solution:
    """642 vertices, 60 eigenpairs, all eigenvalues simple."""
    mesh = bumpy_sphere()
    return Solution(mesh, compute_spectrum(mesh, n_eigenpairs=60))
