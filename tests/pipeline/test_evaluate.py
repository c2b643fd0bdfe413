"""Evaluations from the request to the tables, whatever happens in between; on both databases."""

import json
from functools import partial

import pytest
from numpy.testing import assert_allclose
from sqlalchemy import select

from tests.pipeline.evaluations import (
    Zoo,
    assert_same,
    expected_result,
    fake_descriptor,
)
from workers.errors import (
    InvalidRequestError,
    SpectrumError,
)
from workers.geometry.arrays import Float32Array
from workers.pipeline.evaluate import evaluate
from workers.pipeline.redescribe import redescribe
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.collections import (
    count_shapes,
    get_collection,
    models_of,
)
from workers.storage.database import Database
from workers.storage.descriptors import get_vector
from workers.storage.models import Shape
from workers.storage.shapes import get_shape


def test_an_evaluation_is_what_the_matrix_of_distances_says(park: Zoo) -> None:
    evaluation, job = park.ask("heat", "commute-time", "shape-dna")
    assert park.view(evaluation).state == "queued"
    assert park.view(evaluation).row.result is None
    park.work()
    result, ranks = park.result(evaluation)
    assert_same(result, expected_result(park, "heat", "commute-time", "shape-dna"))
    assert list(result["table"]) == ["isometry", "holes", "all"]
    assert (result["n_queries"], result["n_targets"], result["skipped"]) == (18, 4, [])
    assert len(ranks) == 18 * 3
    assert [entry["model"] for entry in ranks[:3]] == ["heat", "commute-time", "shape-dna"]
    assert all(len(entry["top"]) == 4 and 1 <= entry["rank"] <= 4 for entry in ranks)
    row = park.job(job)
    assert (row.state, row.kind, row.collection) == ("succeeded", "evaluate", "zoo")
    assert (row.done, row.total) == (22 * 2 + 18 * 3, 22 * 2 + 18 * 3)  # described, ranked
    assert park.blob_files() == []


def test_the_collection_does_not_follow_the_models(park: Zoo) -> None:
    with park.database.read() as session:
        collection = get_collection(session, "zoo")
        before = count_shapes(session, [collection])
    evaluation, _ = park.ask("biharmonic")
    park.work()
    park.result(evaluation)
    with park.database.read() as session:
        assert models_of(session, collection.id) == {"heat"}
        assert get_collection(session, "zoo").model == "heat"
        assert count_shapes(session, [collection]) == before
        shape_id = session.scalars(select(Shape.id)).first()
        assert get_vector(session, str(shape_id), "biharmonic") is not None


def test_a_shape_that_cannot_be_described_is_left_out_for_all_models_and_stays_ready(
    park: Zoo,
) -> None:
    with park.database.begin() as session:
        bad = session.scalars(select(Shape).where(Shape.name == "dog.all.2.off")).one()
        bad.path = "kennel/dog.all.2.off"

    def fail_for_bad(_: Workbench, shape: Shape, model: Model) -> Float32Array:
        if shape.id == bad.id:
            raise SpectrumError("made to fail")
        return fake_descriptor(shape, model)

    evaluation, job = park.ask("heat", "commute-time")
    park.with_verb("describe", partial(redescribe, describe_shape=fail_for_bad)).work()
    result, _ = park.result(evaluation)
    assert_same(result, expected_result(park, "heat", "commute-time", without=bad.id))
    assert result["n_queries"] == 17
    assert result["skipped"] == [
        {"reason": "not-described", "count": 1, "shapes": [{"id": bad.id, "name": bad.name}]}
    ]
    assert [error["item"] for error in park.job(job).errors] == [bad.path]
    with park.database.read() as session:
        view = get_shape(session, bad.id)
    assert (view.state, view.row.error) == ("ready", None)


def test_failed_shapes_and_lonely_queries_are_named(park: Zoo) -> None:
    (broken,) = park.add("cow.off", described=False)
    with park.database.begin() as session:
        session.get_one(Shape, broken).error = {"type": "invalid-mesh", "detail": "no faces"}
    park.add("bird.noise.1.off", "bird.noise.2.off")
    evaluation, _ = park.ask("heat")
    park.work()
    result, _ = park.result(evaluation)
    assert result["n_queries"] == 18
    assert [(group["reason"], group["count"]) for group in result["skipped"]] == [
        ("failed", 1),
        ("no-relevant-target", 2),
    ]
    assert result["skipped"][0]["shapes"][0]["name"] == "cow.off"


def test_queries_are_ranked_some_at_a_time(park: Zoo) -> None:
    whole, _ = park.ask("heat", "commute-time")
    park.work()
    park = park.with_verb("evaluate", partial(evaluate, queries_a_part=7))
    evaluation, job = park.ask("heat", "commute-time")
    while "rank" not in dict((kind, part) for part, kind in park.queued(job)):
        park.run(park.queued(job)[0][0])
    assert len(park.queued(job)) == 2 * 3  # of 7, 7 and 4 queries
    park.work()
    found, expected = park.result(evaluation), park.result(whole)
    for model in ("heat", "commute-time"):
        its, whole_its = (one[0]["precision_recall"].pop(model) for one in (found, expected))
        assert_allclose(its, whole_its, rtol=1e-12)
    assert found == expected
    assert park.blob_files() == []


def test_labels_alone_are_evaluated_leave_one_out(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str
) -> None:
    park = Zoo(database, blobs, settings)
    park.add(*(f"{label}/{n}.off" for label in ("cat", "dog", "owl") for n in range(4)), "x.off")
    evaluation, _ = park.ask("heat")
    park.work()
    result, ranks = park.result(evaluation)
    assert_same(result, expected_result(park, "heat"))
    assert (result["leave_one_out"], result["n_queries"], result["n_targets"]) == (True, 12, 13)
    assert (result["table"], result["mean_of_rows"]) == ({}, {})
    assert list(result["by_label"]) == ["cat", "dog", "owl"]
    assert all(entry["query"] not in entry["top"] for entry in ranks)
    assert [group["reason"] for group in result["skipped"]] == ["no-label"]


def test_another_dissimilarity_is_used_for_every_channel(park: Zoo) -> None:
    own, _ = park.ask("heat")
    other, _ = park.ask("heat", dissimilarity="chi-squared")
    park.work()
    assert park.result(own)[0]["n_queries"] == park.result(other)[0]["n_queries"]
    assert park.result(own)[1] != park.result(other)[1]
    with pytest.raises(InvalidRequestError, match="possible are"):
        park.ask("heat", "shape-dna", dissimilarity="chi-squared")


def test_neither_the_order_of_models_nor_of_parts_changes_a_bit(park: Zoo) -> None:
    first, _ = park.ask("heat", "commute-time", "biharmonic")
    park.work()
    second, job = park.ask("biharmonic", "commute-time", "heat")
    while queued := park.queued(job):
        park.run(queued[-1][0])  # the last first
    one, two = park.result(first)[0], park.result(second)[0]
    for name in ("table", "by_strength", "by_label", "measures", "precision_recall"):
        assert json.dumps(one[name], sort_keys=True) == json.dumps(two[name], sort_keys=True)
    assert list(two["mean_average_precision"]) == ["biharmonic", "commute-time", "heat"]
    again, _ = park.ask("heat", "commute-time", "biharmonic")
    park.work()
    assert json.dumps(park.result(again)) == json.dumps(park.result(first))
