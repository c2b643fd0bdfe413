"""Spectra that several tests of this package use."""

import pytest

from tests.meshes import bumpy_sphere, icosphere
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import Spectrum, compute_spectrum

Solved = tuple[TriangleMesh, Spectrum]


@pytest.fixture(scope="session")
def sphere() -> Solved:
    """Unit sphere of 2562 vertices with its 48 eigenpairs of degree 1 to 6."""
    mesh = icosphere(4)
    return mesh, compute_spectrum(mesh, n_eigenpairs=48)


@pytest.fixture(scope="session")
def bumpy() -> Solved:
    """A shape without symmetry, 642 vertices, 60 eigenpairs."""
    mesh = bumpy_sphere()
    return mesh, compute_spectrum(mesh, n_eigenpairs=60)
