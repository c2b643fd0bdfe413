"""Points of the query are looked for on the nearest candidates: a part is found on its whole."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere, renumbered, rotated, scaled
from tests.retrieval.test_scan import HEAT, descriptors
from workers.diffusion.distances import diagonal_signature
from workers.diffusion.kernels import CommuteTimeKernel, HeatKernel
from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array, FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import default_view
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.retrieval import scan
from workers.retrieval.channels import POINTS, Channel, describe_channel
from workers.retrieval.dissimilarity import UNFOUND
from workers.retrieval.model import Model
from workers.retrieval.points import unfound_points
from workers.retrieval.scan import FARTHEST, distances, with_points

TIMES = (1.0, 2.0, 4.0)
LOCAL = Channel(
    "points", "closed", HeatKernel(0.002), POINTS, "area",
    levels=TIMES, dissimilarity=UNFOUND, samples=20, scale=0.5, weight=0.75,
)  # fmt: skip
MODEL = Model("m", "bank", {}, (default_view(),), (HEAT, LOCAL), fusion_power=0.25)


def fetched(rows: Float32Array) -> Any:
    """What `with_points` fetches rows by."""
    return lambda places: rows[places]


def solved(mesh: TriangleMesh) -> Solution:
    return Solution(mesh, compute_spectrum(mesh, n_eigenpairs=60))


# -- the channel ------------------------------------------------------------------------------


def test_a_vector_has_the_signature_of_each_sampled_point(bumpy: Solution) -> None:
    vector = describe_channel(bumpy, LOCAL)
    assert vector.shape == (LOCAL.dimension,) == (60,)
    spectrum = bumpy.spectrum.rescaled(1.0 / np.sqrt(bumpy.spectrum.area))
    indices = bumpy.sample(20).indices
    for place, multiple in enumerate(TIMES):
        values = diagonal_signature(spectrum, HeatKernel(0.002 * multiple))[indices]
        assert_allclose(vector.reshape(20, 3)[:, place], np.log(values), atol=1e-5)


def test_a_disguised_copy_has_its_points_found() -> None:
    rng = np.random.default_rng(3)
    mesh = bumpy_sphere(3)
    copy, _ = renumbered(scaled(rotated(mesh, rng), 7.0), rng)
    first, second = (describe_channel(solved(m), LOCAL) for m in (mesh, copy))
    assert unfound_points(first, second[None], 3)[0] < 1e-4


def test_the_points_of_a_sample_that_is_there_are_used(bumpy: Solution) -> None:
    stored = replace(bumpy, samples={100: bumpy.sample(100)})
    assert_array_equal(stored.farthest_points(20), bumpy.sample(20).indices)
    assert_array_equal(describe_channel(stored, LOCAL), describe_channel(bumpy, LOCAL))


def test_a_smaller_surface_repeats_its_points(bumpy: Solution) -> None:
    many = replace(LOCAL, samples=bumpy.mesh.n_vertices + 5)
    vector = describe_channel(bumpy, many).reshape(-1, 3)
    assert_array_equal(vector[:5], vector[-5:])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kernel": CommuteTimeKernel()}, "points have a heat kernel"),
        ({"dissimilarity": "l1"}, "points, and nothing else"),
        ({"levels": (0.0,)}, "above 0 for points"),
        ({"levels": None, "edges": (0.0, 1.0)}, "levels and no edges"),
    ],
)
def test_points_that_make_no_sense_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidRequestError, match=words):
        replace(LOCAL, **changes)
    with pytest.raises(InvalidRequestError, match="points, and nothing else"):
        replace(HEAT, dissimilarity=UNFOUND)
    with pytest.raises(InvalidRequestError, match="no channel that is scanned"):
        replace(MODEL, channels=(LOCAL,))


# -- the dissimilarity ------------------------------------------------------------------------


def test_unfound_points_follow_the_formula() -> None:
    rng = np.random.default_rng(0)
    query, rows = rng.normal(size=(5, 3)), rng.normal(size=(4, 7, 3))
    expected = [
        np.mean([np.sqrt(min(np.abs(p - q).mean() for q in row)) for p in query]) ** 2
        for row in rows
    ]
    assert_allclose(unfound_points(query.ravel(), rows.reshape(4, -1), 3), expected)


def test_a_part_is_found_on_the_whole_and_not_the_reverse() -> None:
    rng = np.random.default_rng(1)
    whole: FloatArray = rng.normal(size=(20, 3))
    part = np.resize(whole[:8], (20, 3))
    assert unfound_points(part.ravel(), whole.reshape(1, -1), 3)[0] == 0.0
    assert unfound_points(whole.ravel(), part.reshape(1, -1), 3)[0] > 0.1


# -- the scan ---------------------------------------------------------------------------------


def test_the_nearest_rows_get_their_points_and_all_others_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(scan, "RERANKED", 10)
    rows = descriptors(MODEL, 60)
    far = distances(rows[4], rows, MODEL)
    fetched_places: list[IntArray] = []

    def fetch(places: IntArray) -> Float32Array:
        fetched_places.append(places)
        return rows[places]

    found = with_points(rows[4], fetch, far, MODEL)
    (near,) = fetched_places
    assert_array_equal(near, np.sort(np.argsort(far)[:10]))
    part = MODEL.slices["points"]
    own = unfound_points(rows[4, part], rows[near][:, part], 3)
    assert_allclose(found[near], far[near] + 0.75 * (own / 0.5) ** 0.25)
    others = np.setdiff1d(np.arange(60), near)
    assert_allclose(found[others], far[others] + 0.75 * FARTHEST**0.25)
    assert found[near].max() <= found[others].min()
    assert found[4] == 0.0  # itself


def test_rows_as_far_as_the_last_one_are_looked_at_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the answer would depend on the order of the rows."""
    monkeypatch.setattr(scan, "RERANKED", 3)
    rows = np.repeat(descriptors(MODEL, 2), 5, axis=0)
    order = np.random.default_rng(2).permutation(10)
    found = with_points(rows[0], fetched(rows), distances(rows[0], rows, MODEL), MODEL)
    shuffled = rows[order]
    again = with_points(rows[0], fetched(shuffled), distances(rows[0], shuffled, MODEL), MODEL)
    assert_array_equal(found[order], again)
    assert len(set(found.tolist())) == 2


def test_points_count_nothing_under_another_dissimilarity_or_without_rows() -> None:
    rows = descriptors(MODEL, 5)
    far = distances(rows[0], rows, MODEL, dissimilarity="l1")
    assert with_points(rows[0], fetched(rows), far, MODEL, dissimilarity="l1") is far
    empty = np.empty(0)
    assert with_points(rows[0], fetched(rows), empty, MODEL) is empty
    plain = replace(MODEL, channels=(HEAT,))
    far = distances(rows[0, :40], rows[:, :40], plain)
    assert with_points(rows[0, :40], fetched(rows), far, plain) is far
