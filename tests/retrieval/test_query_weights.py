"""A view that noise has ruined counts less: weights for a query, and banks learned with limits."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere
from tests.retrieval.banks import of_copies
from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array
from workers.geometry.mesh import TriangleMesh
from workers.geometry.smoothing import roughness
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.views import named_view
from workers.retrieval.channels import Channel
from workers.retrieval.comparison import compare
from workers.retrieval.model import Model, describe
from workers.retrieval.query_weights import kept_shares, weighted_for
from workers.retrieval.roughness import RoughnessLimits
from workers.retrieval.scan import distances, rerank, similarity
from workers.training.bank import BankOptions, train_bank
from workers.training.bank_report import impostor_distances
from workers.training.bank_shapes import BankShapes, dissimilarities, ranking_terms
from workers.training.candidates import ROUGH, candidate_model

CANDIDATES = candidate_model([named_view("detailed"), named_view("smooth")], power=0.25)
(LIMITS,) = CANDIDATES.roughness_limits


def chosen(*names: str) -> tuple[Channel, ...]:
    return tuple(channel for channel in CANDIDATES.channels if channel.name in names)


MODEL = replace(
    CANDIDATES,
    channels=tuple(
        replace(channel, weight=weight)
        for channel, weight in zip(
            chosen(
                *("detailed: heat 0.01", "detailed: points"),
                *("smooth: heat 0.01", "smooth: eigenvalues"),
            ),
            (0.3, 0.2, 0.1, 0.4),
            strict=True,
        )
    ),
)


def some_rows(model: Model, n: int, rough: float) -> Float32Array:
    """Descriptors that are as rough as that."""
    rows = np.random.default_rng(3).normal(size=(n, model.dimension)).astype(np.float32)
    rows[:, model.slices[LIMITS.name]] = rough
    return rows


def weights_of(model: Model) -> dict[str, float]:
    return {channel.name: channel.weight for channel in model.channels}


def moved(mesh: TriangleMesh, share: float) -> TriangleMesh:
    """Mesh with noise of such a share of an edge."""
    edge = np.sqrt(mesh.area / mesh.n_faces)
    noise = np.random.default_rng(0).normal(size=mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + share * edge * noise, mesh.faces)


@pytest.mark.parametrize("subdivisions", [4, 5])
def test_noise_is_rough_at_any_resolution_and_what_shapes_are_made_of_is_not(
    subdivisions: int,
) -> None:
    mesh = bumpy_sphere(subdivisions)
    clean, some, much = (roughness(moved(mesh, share)) for share in (0.0, 0.6, 1.2))
    assert clean < 0.05
    assert ROUGH[0] - 0.05 < some < ROUGH[0] + 0.05
    assert ROUGH[1] < much
    assert roughness(TriangleMesh(7.0 * mesh.vertices + 1.0, mesh.faces)) == pytest.approx(clean)


def test_the_last_number_of_a_descriptor_is_the_roughness_of_the_working_mesh() -> None:
    mesh = bumpy_sphere(3)
    solution = Solution(mesh, compute_spectrum(mesh, n_eigenpairs=20))
    model = replace(MODEL, channels=chosen("detailed: heat 0.01", "smooth: heat 0.01"))
    found = describe({"detailed": solution, "smooth": solution}, model)
    assert found[-1] == np.float32(roughness(mesh))
    assert_array_equal(found[-1:], LIMITS.describe(solution))


def test_views_that_noise_can_ruin_have_it_where_another_can_count_for_them() -> None:
    def rough(*views: str) -> list[str]:
        model = candidate_model([named_view(view) for view in views], power=0.25)
        return [limits.name for limits in model.roughness_limits]

    assert rough("closed", "open") == []
    assert rough("smooth") == []
    assert rough("closed", "smooth", "open") == ["closed: roughness", "open: roughness"]


def test_a_view_loses_its_weight_between_the_limits() -> None:
    rows = np.concatenate([some_rows(MODEL, 1, rough) for rough in (0.1, 0.35, 0.525, 0.7, 3.0)])
    shares = kept_shares(rows, MODEL)
    detailed = [channel.view == "detailed" for channel in MODEL.channels]
    expected = np.tile([[1.0], [1.0], [0.5], [0.0], [0.0]], 2)
    assert_allclose(shares[:, detailed], expected, atol=1e-6)
    assert np.all(shares[:, ~np.array(detailed)] == 1.0)


def test_weights_of_a_clean_query_are_the_models_own() -> None:
    assert weighted_for(some_rows(MODEL, 1, 0.2)[0], MODEL) is MODEL


@pytest.mark.parametrize("rough", [0.5, 0.65, 2.0])
def test_what_a_view_loses_the_others_gain(rough: float) -> None:
    query = some_rows(MODEL, 1, rough)[0]
    weights, own = weights_of(weighted_for(query, MODEL)), weights_of(MODEL)
    assert sum(weights.values()) == pytest.approx(sum(own.values()))
    left = max(0.0, (0.7 - rough) / 0.35)
    for other in ("detailed: points", "smooth: heat 0.01"):
        kept = left if other.startswith("detailed") else 1.0
        total = sum(
            weight * (left if name.startswith("detailed") else 1.0) for name, weight in own.items()
        )
        assert weights[other] == pytest.approx(own[other] * kept / total, abs=1e-6)


def test_a_rough_query_is_answered_by_the_smooth_view_alone() -> None:
    rows = some_rows(MODEL, 30, 0.1)
    query = some_rows(MODEL, 1, 1.0)[0]
    smooth = chosen("smooth: heat 0.01", "smooth: eigenvalues")
    names = [channel.name for channel in smooth]
    own = [channel for channel in MODEL.channels if channel.name in names]
    total = sum(channel.weight for channel in MODEL.channels)
    kept = sum(channel.weight for channel in own)
    alone = replace(
        MODEL,
        channels=tuple(replace(channel, weight=channel.weight * total / kept) for channel in own),
        roughness_limits=(),
    )
    columns = np.concatenate([np.arange(MODEL.dimension)[MODEL.slices[name]] for name in names])
    expected = distances(query[columns], rows[:, columns], alone)
    scanned = distances(query, rows, MODEL)
    assert_allclose(scanned, expected, rtol=1e-12)
    assert_array_equal(rerank(query, rows.__getitem__, scanned, MODEL), scanned)


def test_a_rough_row_is_compared_as_all_others_are() -> None:
    query = some_rows(MODEL, 1, 0.1)[0]
    rows = some_rows(MODEL, 5, 0.1)
    rough = rows.copy()
    rough[:, MODEL.slices[LIMITS.name]] = 2.0
    assert_array_equal(distances(query, rows, MODEL), distances(query, rough, MODEL))


@pytest.mark.parametrize("rough", [0.1, 0.5, 2.0])
def test_a_distance_taken_apart_has_the_weights_of_its_query(rough: float) -> None:
    query, match = some_rows(MODEL, 2, rough)
    scanned = distances(query, match[None], MODEL)
    expected = rerank(query, match[None].__getitem__, scanned, MODEL)[0]
    found = compare(query, match, MODEL)
    assert found.distance == expected
    assert sum(part.share for part in found.channels) == pytest.approx(expected, rel=1e-12)
    assert LIMITS.name not in {part.channel.name for part in found.channels}
    own = compare(query, query, MODEL)
    assert (own.distance, own.similarity) == (0.0, 1.0)


def test_where_nothing_would_be_left_all_keep_their_weights() -> None:
    alone = replace(MODEL, channels=chosen("detailed: heat 0.01"))
    query = some_rows(alone, 1, 2.0)[0]
    assert weighted_for(query, alone) is alone
    points = replace(MODEL, channels=chosen("detailed: heat 0.01", "smooth: points"))
    assert weighted_for(some_rows(points, 1, 2.0)[0], points) is points


def test_limits_survive_json_and_ascend() -> None:
    assert RoughnessLimits.from_json(LIMITS.to_json()) == LIMITS
    assert LIMITS.to_json()["name"] == "detailed: roughness"
    for lower, upper in ((0.7, 0.35), (0.5, 0.5), (-0.1, 0.5), (0.1, float("inf"))):
        with pytest.raises(InvalidRequestError, match="that ascend"):
            RoughnessLimits("detailed", lower, upper)
    with pytest.raises(InvalidRequestError, match="cannot be read"):
        RoughnessLimits.from_json({**LIMITS.to_json(), "levels": [0.5]})
    with pytest.raises(InvalidRequestError, match="at least one"):
        replace(MODEL, channels=(), roughness_limits=())
    with pytest.raises(InvalidRequestError, match="no channel that is scanned"):
        replace(MODEL, channels=())
    with pytest.raises(InvalidRequestError, match="no view 'open'"):
        replace(MODEL, roughness_limits=(RoughnessLimits("open", 0.1, 0.2),))


def two_views() -> Model:
    """Candidates of two views, few of each."""
    kept = [
        *[one for one in CANDIDATES.channels if one.view == "detailed"][:4],
        *[one for one in CANDIDATES.channels if one.view == "smooth"][:4],
    ]
    return replace(CANDIDATES, channels=tuple(kept))


def half_ruined(candidates: Model) -> BankShapes:
    """Copies whose detailed channels tell a little more, but nothing at all in every second one."""
    rng = np.random.default_rng(1)
    n, each = 24, 6
    references = rng.normal(size=(n, candidates.dimension))
    truth = np.repeat(np.arange(n), each)
    rough = np.tile([False, True], n * each // 2)
    changes = rng.normal(size=(len(truth), candidates.dimension))
    queries = references[truth] + 2.2 * changes
    for channel in candidates.channels:
        own = candidates.slices[channel.name]
        if channel.view == "detailed":
            queries[:, own] = np.where(
                rough[:, None], changes[:, own], queries[:, own] - 0.6 * changes[:, own]
            )
    references[:, candidates.slices[LIMITS.name]] = 0.1
    queries[:, candidates.slices[LIMITS.name]] = np.where(rough, 1.0, 0.1)[:, None]
    copies = ["noise" if ruined else "holes" for ruined in rough]
    return of_copies(references, queries, copies, members=3)


def test_a_bank_knows_what_its_views_are_worth() -> None:
    candidates = two_views()
    shapes = half_ruined(candidates)
    blind = replace(candidates, roughness_limits=())
    rows = {}
    for name, model in (("seeing", candidates), ("blind", blind)):
        seen = replace(
            shapes,
            references=shapes.references[:, : model.dimension],
            queries=shapes.queries[:, : model.dimension],
        )
        trained = train_bank(name, seen, model, BankOptions(), parameters={}, versions={})
        rows[name] = trained.report["rows"]["training"]["map"]
        assert bool(trained.model.roughness_limits) == (name == "seeing")
        assert LIMITS.name not in {one["channel"] for one in trained.report["ablation"]}
    assert rows["seeing"]["noise"] > rows["blind"]["noise"] + 5.0
    assert rows["seeing"]["holes"] >= rows["blind"]["holes"]


def test_a_bank_of_one_view_has_no_use_for_roughness() -> None:
    candidates = two_views()
    shapes = half_ruined(candidates)
    queries = shapes.queries.copy()
    for channel in candidates.channels:  # nothing that is smooth tells anything
        if channel.view == "smooth":
            queries[:, candidates.slices[channel.name]] = 0.0
    references = shapes.references.copy()
    for channel in candidates.channels:
        if channel.view == "smooth":
            references[:, candidates.slices[channel.name]] = 0.0
    blind = replace(shapes, queries=queries, references=references)
    model = train_bank("b", blind, candidates, BankOptions(), parameters={}, versions={}).model
    assert {channel.view for channel in model.channels} == {"detailed"}
    assert model.roughness_limits == ()


def test_distances_that_similarity_is_calibrated_by_are_those_of_the_scan() -> None:
    candidates = two_views()
    shapes = half_ruined(candidates)
    found = dissimilarities(shapes, candidates)
    scales = np.full(len(candidates.channels), 2.0)
    terms = ranking_terms(shapes, candidates, found, scales, power=0.25)
    weights = np.linspace(0.5, 1.5, terms.n_channels)
    weights /= weights.sum()
    model = replace(
        candidates,
        channels=tuple(
            replace(one, scale=2.0, weight=weight)
            for one, weight in zip(candidates.channels, weights.tolist(), strict=True)
        ),
    )
    expected = np.concatenate(
        [
            np.delete(distances(query, shapes.references, model), own)
            for query, own in zip(shapes.queries, shapes.truth, strict=True)
        ]
    )
    assert_allclose(np.sort(impostor_distances(terms, weights)), np.sort(expected), rtol=1e-4)
    assert np.all(similarity(expected, replace(model, impostor_quantiles=())) < 1.0)
