"""Points of the query are compared with those of the nearest rows: a part is found on its whole."""

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
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.views import default_view
from workers.retrieval.chamfer import DIRECTED_CHAMFER, directed_chamfer
from workers.retrieval.channels import PointsChannel, channel_from_json
from workers.retrieval.model import Model
from workers.retrieval.scan import distances, rerank, with_points

TIMES = (1.0, 2.0, 4.0)
LOCAL = PointsChannel(
    name="points",
    view="closed",
    kernel=HeatKernel(0.002),
    normalisation="area",
    time_factors=TIMES,
    samples=20,
    scale=0.5,
    weight=0.75,
)
MODEL = Model("m", "bank", {}, (default_view(),), (HEAT, LOCAL), fusion_power=0.25)


def fetched(rows: Float32Array) -> Any:
    """What `rerank` fetches rows by."""
    return lambda places: rows[places]


def solved(mesh: TriangleMesh) -> Solution:
    return Solution(mesh, compute_spectrum(mesh, n_eigenpairs=60))


# -- the channel ------------------------------------------------------------------------------


def test_a_vector_has_the_signature_of_each_sampled_point(bumpy: Solution) -> None:
    vector = LOCAL.describe(bumpy)
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
    first, second = (LOCAL.describe(solved(m)) for m in (mesh, copy))
    assert directed_chamfer(first, second[None], 3)[0] < 1e-4


def test_the_points_of_a_sample_that_is_there_are_used(bumpy: Solution) -> None:
    stored = replace(bumpy, samples={100: bumpy.sample(100)})
    assert_array_equal(stored.farthest_points(20), bumpy.sample(20).indices)
    assert_array_equal(LOCAL.describe(stored), LOCAL.describe(bumpy))


def test_a_smaller_surface_repeats_its_points(bumpy: Solution) -> None:
    many = replace(LOCAL, samples=bumpy.mesh.n_vertices + 5)
    vector = many.describe(bumpy).reshape(-1, 3)
    assert_array_equal(vector[:5], vector[-5:])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kernel": CommuteTimeKernel()}, "points have a heat kernel"),
        ({"dissimilarity": "l1"}, "compared by 'unfound-points' alone"),
        ({"time_factors": (0.0,)}, "above 0 for points"),
        ({"time_factors": ()}, "above 0 for points"),
        ({"samples": 0}, "at least 1"),
    ],
)
def test_points_that_make_no_sense_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidRequestError, match=words):
        replace(LOCAL, **changes)
    with pytest.raises(InvalidRequestError, match="no dissimilarity 'unfound-points'"):
        replace(HEAT, dissimilarity=DIRECTED_CHAMFER)
    with pytest.raises(InvalidRequestError, match="no channel that is scanned"):
        replace(MODEL, channels=(LOCAL,))


def test_points_survive_json_under_the_word_that_stored_models_have() -> None:
    content = LOCAL.to_json()
    assert (content["feature"], content["dissimilarity"]) == (
        "log-diagonal-points",
        "unfound-points",
    )
    assert channel_from_json(content) == LOCAL


# -- the dissimilarity ------------------------------------------------------------------------


def test_directed_chamfer_follow_the_formula() -> None:
    rng = np.random.default_rng(0)
    query, rows = rng.normal(size=(5, 3)), rng.normal(size=(4, 7, 3))
    expected = [
        np.mean([np.sqrt(min(np.abs(p - q).mean() for q in row)) for p in query]) ** 2
        for row in rows
    ]
    assert_allclose(directed_chamfer(query.ravel(), rows.reshape(4, -1), 3), expected)


def test_a_part_is_found_on_the_whole_and_not_the_reverse() -> None:
    rng = np.random.default_rng(1)
    whole: FloatArray = rng.normal(size=(20, 3))
    part = np.resize(whole[:8], (20, 3))
    assert directed_chamfer(part.ravel(), whole.reshape(1, -1), 3)[0] == 0.0
    assert directed_chamfer(whole.ravel(), part.reshape(1, -1), 3)[0] > 0.1


# -- the scan ---------------------------------------------------------------------------------


def test_the_nearest_rows_get_their_points_and_all_others_the_largest_term() -> None:
    rows = descriptors(MODEL, 60)
    scanned = distances(rows[4], rows, MODEL)
    fetched_places: list[IntArray] = []

    def fetch(places: IntArray) -> Float32Array:
        fetched_places.append(places)
        return rows[places]

    found = rerank(rows[4], fetch, scanned, MODEL, depth=10)
    (looked_at,) = fetched_places
    assert_array_equal(looked_at, np.sort(np.argsort(scanned)[:10]))
    columns = MODEL.slices["points"]
    own = directed_chamfer(rows[4, columns], rows[looked_at][:, columns], 3)
    assert_allclose(found[looked_at], scanned[looked_at] + 0.75 * (own / 0.5) ** 0.25)
    others = np.setdiff1d(np.arange(60), looked_at)
    assert_allclose(found[others], scanned[others] + 0.75 * 16.0**0.25)
    assert found[looked_at].max() <= found[others].min()
    assert found[4] == 0.0  # itself


def test_chosen_rows_have_the_distances_that_they_have_among_the_nearest() -> None:
    rows = descriptors(MODEL, 60)
    scanned = distances(rows[4], rows, MODEL)
    of_all = rerank(rows[4], fetched(rows), scanned, MODEL, depth=60)
    chosen = np.array([3, 17, 41])
    found = with_points(rows[4], fetched(rows), scanned, MODEL, chosen)
    assert_array_equal(found, of_all[chosen])
    beyond = rerank(rows[4], fetched(rows), scanned, MODEL, depth=3)
    assert (found[1:] < beyond[chosen][1:]).any()


def test_rows_level_with_the_last_one_are_compared_too() -> None:
    """Otherwise the answer would depend on the order of the rows."""
    rows = np.repeat(descriptors(MODEL, 2), 5, axis=0)
    order = np.random.default_rng(2).permutation(10)
    scanned = distances(rows[0], rows, MODEL)
    found = rerank(rows[0], fetched(rows), scanned, MODEL, depth=3)
    shuffled = rows[order]
    again = rerank(rows[0], fetched(shuffled), scanned[order], MODEL, depth=3)
    assert_array_equal(found[order], again)
    assert len(set(found.tolist())) == 2


def test_points_count_nothing_under_another_dissimilarity_or_without_rows() -> None:
    rows = descriptors(MODEL, 5)
    scanned = distances(rows[0], rows, MODEL, dissimilarity="l1")
    assert rerank(rows[0], fetched(rows), scanned, MODEL, dissimilarity="l1") is scanned
    empty = np.empty(0)
    assert rerank(rows[0], fetched(rows), empty, MODEL) is empty
    plain = replace(MODEL, channels=(HEAT,))
    scanned = distances(rows[0, :40], rows[:, :40], plain)
    assert rerank(rows[0, :40], fetched(rows), scanned, plain) is scanned
