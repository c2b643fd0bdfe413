import numpy as np
import pytest
from numpy.testing import assert_allclose

from service.cli.deformations import add_noise, coarsen, punch_holes, scale_and_turn
from tests.meshes import icosphere
from workers.geometry.mesh import TriangleMesh


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(17)


def _volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_scaled_and_turned_copy_is_similar_and_no_mirror_image(rng: np.random.Generator) -> None:
    mesh = icosphere(2)
    for _ in range(5):
        turned = scale_and_turn(mesh, factor=3.7, rng=rng)
        assert_allclose(turned.area, 3.7**2 * mesh.area)
        assert_allclose(_volume(turned), 3.7**3 * _volume(mesh), rtol=1e-9)
        assert not np.allclose(turned.vertices, 3.7 * mesh.vertices)


def test_noise_has_the_asked_share_of_an_edge(rng: np.random.Generator) -> None:
    mesh = icosphere(4)
    edges = np.linalg.norm(
        mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1
    )
    moved = add_noise(mesh, strength=0.2, rng=rng).vertices - mesh.vertices
    assert_allclose(moved.std(), 0.2 * edges.mean(), rtol=0.05)  # 7,686 draws: 0.8 % sd


def test_holes_take_their_share_and_leave_no_unused_vertex(rng: np.random.Generator) -> None:
    mesh = icosphere(4)
    holed = punch_holes(mesh, count=3, share=0.02, rng=rng)
    lost = mesh.n_faces - holed.n_faces
    each = int(0.02 * mesh.n_faces)
    assert each <= lost <= 3 * each
    assert np.array_equal(np.unique(holed.faces), np.arange(holed.n_vertices))
    assert_allclose(holed.area, mesh.area * (1 - lost / mesh.n_faces), rtol=0.02)


def test_coarser_copy_has_fewer_faces_on_the_same_surface() -> None:
    mesh = icosphere(4)
    coarse = coarsen(mesh, share=0.3)
    assert_allclose(coarse.n_faces, 0.3 * mesh.n_faces, rtol=0.05)
    assert_allclose(np.linalg.norm(coarse.vertices, axis=1), 1, atol=0.02)
