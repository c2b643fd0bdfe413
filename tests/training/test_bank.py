"""A bank: the channels that tell shapes apart are found and weighted, their distances explained."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.retrieval.banks import N_CHANNELS, bank_shapes, few_candidates
from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.retrieval.calibration import IMPOSTOR_SHARES, impostor_quantiles, impostor_share
from workers.retrieval.model import Model
from workers.retrieval.scan import distances, similarity
from workers.training.bank import BankOptions, TrainedBank, held_out_queries, train_bank
from workers.training.bank_shapes import BankShapes, dissimilarities, ranking_terms, typical_scales
from workers.training.elimination import Stage, choose, eliminate


def trained(shapes: BankShapes, options: BankOptions | None = None) -> TrainedBank:
    options = BankOptions() if options is None else options
    return train_bank(
        "b", shapes, few_candidates(), options, parameters={"a": 1}, versions={"x": "1"}
    )


def test_the_channels_that_tell_shapes_apart_are_found() -> None:
    model = trained(bank_shapes(telling=(1, 4), noise=1.0)).model
    names = [channel.name for channel in few_candidates().channels]
    weights = {channel.name: channel.weight for channel in model.channels}
    telling = (weights.pop(names[1]), weights.pop(names[4]))
    assert min(telling) > 1.2 * max(weights.values(), default=0.0)
    total = sum(telling) + sum(weights.values())
    assert total == pytest.approx(1.0, abs=1e-3)  # rounded to four decimals


def test_copies_find_their_own_shape_by_the_models_own_scan() -> None:
    shapes, candidates = bank_shapes(telling=(1, 4)), few_candidates()
    model = trained(shapes).model
    columns = np.concatenate(
        [np.arange(candidates.dimension)[candidates.slices[c.name]] for c in model.channels]
    )
    matrix = shapes.references[:, columns]
    for query, own in zip(shapes.queries[::7], shapes.truth[::7], strict=True):
        found = distances(query[columns], matrix, model)
        assert np.argmin(found) == own
        assert similarity(found, model)[own] > 0.99


def test_similarity_is_the_share_of_impostors_that_are_farther() -> None:
    model = trained(bank_shapes()).model
    at = np.array(model.impostor_quantiles)
    assert_allclose(similarity(at, model), 1.0 - np.array(IMPOSTOR_SHARES), atol=1e-12)
    assert similarity(np.array([0.0]), model).tolist() == [1.0]
    own = similarity(np.array([1.0]), replace(model, impostor_quantiles=()))
    assert similarity(np.array([1.0]), model, dissimilarity="l2") == own


def test_a_bank_has_as_many_channels_as_were_asked_for() -> None:
    shapes = bank_shapes(telling=(0, 1, 2, 3, 4, 5))
    assert len(trained(shapes, BankOptions(channels=4)).model.channels) <= 4
    assert len(trained(shapes, BankOptions(channels=6)).model.channels) > 4


def test_the_same_shapes_give_the_same_bank() -> None:
    first, second = (trained(bank_shapes()) for _ in range(2))
    assert json.dumps(first.model.to_json()) == json.dumps(second.model.to_json())
    assert json.dumps(first.report) == json.dumps(second.report)


def test_a_bank_survives_json() -> None:
    model = trained(bank_shapes()).model
    again = Model.from_json(json.loads(json.dumps(model.to_json())))
    assert again == model
    assert again.impostor_quantiles == model.impostor_quantiles
    assert dict(again.versions)["x"] == "1"


def test_the_report_has_what_was_held_out_and_what_each_channel_gives() -> None:
    report = trained(bank_shapes(telling=(1, 4), noise=0.8)).report
    assert report["held_out_groups"] == ["group 3", "group 7"]
    assert set(report["rows"]) == {"training", "held_out"}
    assert set(report["rows"]["held_out"]["map"]) == {"noise", "holes"}
    low, high = report["rows"]["held_out"]["interval"]
    assert low <= report["rows"]["held_out"]["mean"] <= high
    best = max(report["ablation"], key=lambda entry: entry["lost"])
    assert best["channel"] in {few_candidates().channels[i].name for i in (1, 4)}
    for entry in report["similarity"]:  # 24 references, 24 queries held out
        assert entry["found"] == pytest.approx(entry["promised"], abs=0.15)


def test_few_groups_are_all_learned_from() -> None:
    shapes = bank_shapes(groups=3)
    assert not held_out_queries(shapes).any()
    report = trained(shapes).report
    assert set(report["rows"]) == {"training"}
    assert report["similarity"] == []


def test_shapes_that_are_alike_under_labels_are_no_impostors() -> None:
    strict = bank_shapes(groups=4, members=2)
    lenient = replace(strict, lenient=(True,) * 8)
    assert not strict.excluded.any()
    assert_array_equal(lenient.excluded.sum(axis=1), np.ones(len(lenient.truth)))
    assert not lenient.excluded[np.arange(len(lenient.truth)), lenient.truth].any()


def test_every_transformation_counts_the_same() -> None:
    shapes = bank_shapes()
    uneven = replace(shapes, transformations=("noise",) + ("holes",) * (len(shapes.truth) - 1))
    assert uneven.importance[0] == pytest.approx(0.5)
    assert uneven.importance.sum() == pytest.approx(1.0)


def test_a_channel_that_copies_keep_exactly_is_scaled_by_the_impostors() -> None:
    shapes = bank_shapes()
    queries = shapes.queries.copy()
    queries[:, -1] = shapes.references[shapes.truth, -1]  # the area: nothing changed it
    exact = replace(shapes, queries=queries)
    found = dissimilarities(exact, few_candidates())
    scales = typical_scales(exact, found)
    assert np.all(scales > 0.0)
    others = np.abs(exact.queries[:, None, -1] - exact.references[None, :, -1])
    assert_allclose(found[-1], others, atol=1e-6)
    assert trained(exact).model.channels[-1].name.endswith("area")


def test_a_bank_trained_with_scale_forgets_the_area_and_another_does_not() -> None:
    shapes = bank_shapes(telling=(N_CHANNELS - 1,))  # copies keep their area and nothing else
    assert trained(shapes).report["share_that_sees_scale"] > 1.4 / N_CHANNELS
    scaled = replace(shapes, transformations=("noise", "scale") * (len(shapes.truth) // 2))
    report = trained(scaled).report
    assert report["share_that_sees_scale"] == 0.0
    assert report["n_candidates"] == N_CHANNELS - 1


def test_banks_that_cannot_be_learned_are_refused() -> None:
    shapes = bank_shapes()
    only = replace(
        shapes,
        queries=shapes.queries[:4],
        truth=shapes.truth[:4],
        transformations=shapes.transformations[:4],
        strengths=shapes.strengths[:4],
    )
    with pytest.raises(InsufficientTrainingDataError, match="1 shapes with transformed copies"):
        trained(only)
    same = replace(
        shapes,
        references=np.ones_like(shapes.references),
        queries=np.ones_like(shapes.queries),
    )
    with pytest.raises(InsufficientTrainingDataError, match="all 24 shapes are the same"):
        trained(same)
    with pytest.raises(InvalidRequestError, match="1 channel"):
        BankOptions(channels=0)
    with pytest.raises(InvalidRequestError, match="24 references"):
        replace(shapes, groups=("one",))


def test_elimination_goes_down_to_four_channels() -> None:
    shapes = bank_shapes(telling=(0, 1, 2, 3, 4))
    found = dissimilarities(shapes, few_candidates())
    terms = ranking_terms(
        shapes, few_candidates(), found, typical_scales(shapes, found), power=0.25
    )
    stages = eliminate(terms, terms)
    sizes = [len(stage.channels) for stage in stages]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] == 4
    broadest = choose(stages, most=99, share=1e9, least_nats=0.0)
    assert len(broadest.channels) == sizes[0]
    assert len(choose(stages, most=4, share=1e9, least_nats=0.0).channels) == 4
    best = choose(stages, most=99, share=0.0, least_nats=0.0)
    assert best.loss == min(stage.loss for stage in stages)


def test_the_broadest_bank_is_taken_of_those_that_chance_may_have_put_in_order() -> None:
    def channels_of(losses: list[float]) -> int:
        sizes = range(len(losses) + 3, 3, -1)
        stages = [
            Stage(np.arange(size), np.ones(size), loss)
            for size, loss in zip(sizes, losses, strict=True)
        ]
        return len(choose(stages, most=99, share=0.03, least_nats=0.01).channels)

    assert channels_of([0.5000, 0.4120, 0.4000, 0.4500]) == 6  # within 3 %
    assert channels_of([0.4200, 0.4125, 0.4000, 0.4500]) == 5
    assert channels_of([0.0200, 0.0130, 0.0040, 0.0080]) == 6  # within a hundredth of a nat
    assert channels_of([0.0130, 0.0130, 0.0040, 0.0080]) == 7


def test_the_share_of_impostors_is_what_was_counted() -> None:
    rng = np.random.default_rng(0)
    training = rng.gamma(4.0, size=20000)
    quantiles = impostor_quantiles(training)
    for share in IMPOSTOR_SHARES[3:]:
        at = np.quantile(training, share)
        assert impostor_share(np.array([at]), quantiles)[0] == pytest.approx(share, abs=2e-3)
    assert impostor_share(np.array([0.0, 1e9]), quantiles).tolist() == [0.0, 1.0]
    assert impostor_quantiles(np.empty(0)) == ()
