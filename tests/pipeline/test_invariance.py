"""Copies that are the same shape get the same descriptor, all the way through the pipeline."""

from hashlib import sha256

import numpy as np
import pytest

from tests.meshes import bumpy_sphere, renumbered, rotated, scaled
from workers.creatures import make_creature
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh
from workers.pipeline.solve import describe_mesh, read_mesh
from workers.retrieval.builtin import built_in_models
from workers.settings import Settings
from workers.storage.blobs import BlobStore, mesh_key


def descriptors(mesh: TriangleMesh) -> dict[str, np.ndarray]:
    data = write(mesh, "ply")
    digest = sha256(data).hexdigest()
    blobs = BlobStore(f"memory://{digest}")
    blobs.put(mesh_key(digest), data)
    read = read_mesh(blobs, digest, filename="m.ply", settings=Settings())
    return dict(describe_mesh(blobs, digest, read.mesh, built_in_models()).vectors)


MESHES = {
    "solved as it is": lambda: make_creature("cat", seed=3, vertices=2500).posed(1),
    "simplified first": lambda: bumpy_sphere(5, seed=1),
}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("factor", [1e-3, 37.0])
def test_scaled_rotated_and_renumbered_copies_have_the_same_descriptors(
    name: str, factor: float
) -> None:
    mesh = MESHES[name]()
    rng = np.random.default_rng(5)
    copy, _ = renumbered(scaled(rotated(mesh, rng), factor), rng)
    ours, theirs = descriptors(mesh), descriptors(copy)
    for model, descriptor in ours.items():
        error = np.abs(descriptor - theirs[model]).sum() / np.abs(descriptor).sum()
        assert error <= 1e-6, model


def test_a_pose_is_nearer_than_another_species() -> None:
    cat = make_creature("cat", seed=3, vertices=2500)
    rest, posed = descriptors(cat.rest), descriptors(cat.posed(1))
    other = descriptors(make_creature("octopus", seed=3, vertices=2500).rest)
    for model, descriptor in rest.items():
        near = np.abs(descriptor - posed[model]).sum()
        assert near < 0.5 * np.abs(descriptor - other[model]).sum(), model
