"""Thin, ragged, doubled sheets full of holes: every one that is a surface gets a solution."""

import numpy as np
import pytest

from tests.meshes import rectangle, union
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solver
from workers.geometry.views import named_view

VIEWS = [named_view(name, working_vertices=300) for name in ("closed", "smooth")]


def sheet(seed: int) -> TriangleMesh:
    """A sheet that is bent, noisy, torn, stretched, squashed or doubled, by chance."""
    rng = np.random.default_rng(seed)
    width = 10.0 ** rng.uniform(-2.0, 0.5)
    flat = rectangle(int(rng.integers(8, 40)), int(rng.integers(3, 40)), 1.0, width)
    x, y, z = flat.vertices.T.copy()
    if rng.random() < 0.4:
        z = 0.2 * np.sin(7.0 * x + rng.uniform(0.0, 6.0)) + 0.1 * np.cos(9.0 * y / width)
    if rng.random() < 0.4:
        x = x ** rng.integers(2, 9)
    vertices = np.stack([x, y, z], axis=1)
    if rng.random() < 0.5:
        vertices += rng.choice([1e-4, 1e-3, 1e-2, 5e-2]) * rng.normal(size=vertices.shape)
    if rng.random() < 0.3:
        vertices[:, 2] *= 10.0 ** rng.uniform(-6.0, -1.0)
    torn = rng.random(flat.n_faces) < rng.choice([0.0, 0.02, 0.1, 0.3])
    mesh = TriangleMesh(vertices, flat.faces[~torn])
    if rng.random() < 0.3:
        gap = np.array([0.0, 0.0, 10.0 ** rng.uniform(-7.0, -2.0)])
        mesh = union(mesh, TriangleMesh(vertices + gap, mesh.faces[:, ::-1]))
    return mesh


@pytest.mark.parametrize("first", range(0, 40, 10))
def test_every_sheet_has_a_solution_under_every_view(first: int) -> None:
    for seed in range(first, first + 10):
        solver = Solver(clean(sheet(seed)).mesh)
        for view in VIEWS:
            spectrum = solver.under(view).spectrum
            assert spectrum.n_eigenpairs > 0
            assert np.isfinite(spectrum.eigenvectors).all()
            assert spectrum.eigenvalues[0] > 0.0
