"""Solutions as blobs: what is read back is what descriptors are made from, its sample included."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import workers.geometry.solution as solution_module
from tests.meshes import bumpy_sphere, scaled, translated, union
from workers.diffusion.kernels import CommuteTimeKernel
from workers.errors import SpectrumError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.sampling import SAMPLES, SurfaceSample, sample_surface
from workers.geometry.solution import solve
from workers.geometry.spectrum import Spectrum, compute_spectrum
from workers.geometry.views import open_view
from workers.retrieval.builtin import distance_model
from workers.retrieval.model import describe
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import BlobStore, spectrum_key
from workers.storage.solutions import load_solution, store_solution

SHA256 = "0" * 64
VIEW = open_view(working_vertices=1500)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> BlobStore:
    """A store that holds one solution, of more vertices than a sample has points."""
    folder: Path = tmp_path_factory.mktemp("blobs")
    blobs = BlobStore(f"file://{folder}")
    mesh = bumpy_sphere(4)
    store_solution(blobs, SHA256, VIEW, solve(mesh, VIEW), cleaned=mesh)
    return blobs


def test_the_sample_is_kept_and_is_that_of_what_is_read_back(
    store: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = load_solution(store, SHA256, VIEW)
    expected = sample_surface(found.mesh, found.spectrum)

    def refuse(*_: object, **__: object) -> SurfaceSample:
        raise AssertionError("the sample was taken again")

    monkeypatch.setattr(solution_module, "sample_surface", refuse)
    assert len(found.sample().indices) == SAMPLES < found.mesh.n_vertices
    assert_array_equal(found.sample().indices, expected.indices)
    assert_array_equal(found.sample().weights, expected.weights)


def test_a_solution_that_was_stored_without_a_sample_gives_the_same_descriptor(
    store: BlobStore,
) -> None:
    model = distance_model("commute-time", CommuteTimeKernel(), VIEW, normalisation="area", top=4.0)
    expected = describe({VIEW.name: load_solution(store, SHA256, VIEW)}, model)
    arrays = unpack(store.get(spectrum_key(SHA256, VIEW.key)))
    older = {name: values for name, values in arrays.items() if not name.startswith("sample_")}
    assert len(older) < len(arrays)
    store.put(spectrum_key("1" * 64, VIEW.key), pack(older))
    found = describe({VIEW.name: load_solution(store, "1" * 64, VIEW)}, model)
    assert found.tobytes() == expected.tobytes()
    assert np.isfinite(found).all()


def test_a_solution_of_several_components_is_read_back_with_its_parts(tmp_path: Path) -> None:
    blobs = BlobStore(f"file://{tmp_path}")
    mesh = union(bumpy_sphere(3), translated(scaled(bumpy_sphere(2), 0.5), (4, 0, 0)))
    stored = store_solution(blobs, SHA256, VIEW, solve(mesh, VIEW), cleaned=mesh)
    loaded = load_solution(blobs, SHA256, VIEW)
    assert [part.body for part in loaded.parts][1] > 2.0
    for ours, theirs in zip(loaded.parts, stored.parts, strict=True):
        assert (ours.weight, ours.copies, ours.body) == (theirs.weight, theirs.copies, theirs.body)
        read, kept = ours.solution, theirs.solution
        assert_array_equal(read.mesh.faces, kept.mesh.faces)
        assert_array_equal(read.spectrum.eigenvectors, kept.spectrum.eigenvectors)
        assert_array_equal(read.sample().indices, kept.sample().indices)
    assert_array_equal(loaded.spectrum.eigenvalues, stored.spectrum.eigenvalues)


def test_what_cannot_be_certified_is_solved_coarser_and_says_so(
    store: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    def of_coarse_meshes_alone(mesh: TriangleMesh, *, n_eigenpairs: int) -> Spectrum:
        if mesh.n_vertices > 900:
            raise SpectrumError("not certified")
        return compute_spectrum(mesh, n_eigenpairs=n_eigenpairs)

    monkeypatch.setattr(solution_module, "compute_spectrum", of_coarse_meshes_alone)
    body = bumpy_sphere(4)
    other = translated(bumpy_sphere(4, seed=2), (5.0, 0.0, 0.0))
    for number, mesh in enumerate((body, union(body, other))):
        found = solve(mesh, VIEW)
        assert 1 <= len(found.notes) <= 1 + number
        for note in found.notes:
            assert re.fullmatch(
                r"solved with [78]\d\d vertices instead of 1,5\d\d, whose eigenpairs could not be "
                "certified",
                note,
            )
        store_solution(store, f"{number}" * 64, VIEW, found, cleaned=mesh)
        assert load_solution(store, f"{number}" * 64, VIEW).notes == found.notes


def test_a_shape_fails_if_no_coarser_mesh_can_be_certified_either(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried = []

    def never(mesh: TriangleMesh, *, n_eigenpairs: int) -> Spectrum:
        tried.append(mesh.n_vertices)
        raise SpectrumError(f"{n_eigenpairs} not certified")

    monkeypatch.setattr(solution_module, "compute_spectrum", never)
    with pytest.raises(SpectrumError, match="100 not certified"):
        solve(bumpy_sphere(4), VIEW)
    assert len(tried) == 4
    assert all(finer > 1.6 * coarser for finer, coarser in pairwise(tried))
