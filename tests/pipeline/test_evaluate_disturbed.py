"""Evaluations that are disturbed: retried, cancelled, overtaken by deletions, refused."""

from typing import Any

import pytest
from sqlalchemy import select

from tests.pipeline.evaluations import (
    Zoo,
    assert_same,
    expected_result,
)
from workers.errors import (
    CollectionNotFoundError,
    InvalidRequestError,
    ModelNotFoundError,
    ModelNotReadyError,
    ShapeNotReadyError,
)
from workers.pipeline.outcome import Outcome
from workers.pipeline.part_kinds import ingest_part, unpack_part
from workers.pipeline.work import run_claim
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.collections import (
    delete_collection,
    get_collection,
)
from workers.storage.database import Database
from workers.storage.jobs import cancel_job, create_job, retry_job
from workers.storage.models import Job, Shape, TrainedModel
from workers.storage.parts import claim_part
from workers.storage.shapes import delete_shape
from workers.storage.trained_models import delete_model


def test_what_failed_is_tried_again_and_gives_the_same_result(park: Zoo) -> None:
    undisturbed, _ = park.ask("heat", "commute-time")
    park.work()
    calls = []

    def broken(*arguments: Any) -> Outcome:
        calls.append(arguments)
        raise ZeroDivisionError

    evaluation, job = park.ask("heat", "commute-time")
    park.with_verb("rank", broken).work()
    assert len(calls) == 6  # each model three times
    assert park.view(evaluation).state == "failed"
    errors = park.job(job).errors
    assert [error["type"] for error in errors] == ["internal-error"] * 2 + ["conflict"]
    assert [error["item"] for error in errors] == ["heat", "commute-time", "evaluate"]
    with park.database.begin() as session:
        retry_job(session, job)
    assert park.view(evaluation).state == "queued"
    parts = park.queued(job)
    assert [kind for _, kind in parts] == ["rank", "rank", "evaluate"]
    for part, _ in reversed(parts):  # the finale, too early, waits for the others
        park.run(part)
    park.work()
    assert park.result(evaluation) == park.result(undisturbed)
    assert park.job(job).state == "succeeded"
    assert park.job(job).errors == []


def test_a_lost_description_is_no_reason_to_compare_fewer_shapes(park: Zoo) -> None:
    """What a shape cannot help, a database that was away, fails the job until it is retried."""

    def broken(*_: Any) -> Outcome:
        raise ZeroDivisionError

    evaluation, job = park.ask("biharmonic")
    park.with_verb("describe", broken).work()
    assert park.view(evaluation).state == "failed"
    with park.database.begin() as session:
        retry_job(session, job)
    park.work()
    assert park.result(evaluation)[0]["n_queries"] == 18


@pytest.mark.parametrize("done", range(5))
def test_cancelled_anywhere_it_stores_nothing_and_can_be_retried(park: Zoo, done: int) -> None:
    """Parts are, in order: describe, evaluate, rank, rank, evaluate."""
    evaluation, job = park.ask("heat", "commute-time")
    for _ in range(done):
        park.run(park.queued(job)[0][0])
    with park.database.begin() as session:
        cancel_job(session, job)
    assert park.work() == 0
    assert park.view(evaluation).state == "cancelled"
    assert park.view(evaluation).row.result is None
    with park.database.begin() as session:
        retry_job(session, job)
    park.work()
    result, _ = park.result(evaluation)
    assert_same(result, expected_result(park, "heat", "commute-time"))


def test_a_shape_deleted_between_two_models_is_gone_for_both(park: Zoo) -> None:
    evaluation, job = park.ask("heat", "commute-time")
    while [kind for _, kind in park.queued(job)] != ["rank", "rank"]:
        park.run(park.queued(job)[0][0])
    park.run(park.queued(job)[0][0])
    with park.database.read() as session:
        gone = session.scalars(select(Shape).where(Shape.name == "owl.null.0.off")).one()
    with park.database.begin() as session:
        delete_shape(session, gone.id)
    park.work()
    result, ranks = park.result(evaluation)
    assert_same(result, expected_result(park, "heat", "commute-time"))
    assert not any(gone.id in entry["top"] for entry in ranks)
    assert [(group["reason"], group["count"]) for group in result["skipped"]] == [
        ("no-relevant-target", 6),
        ("not-described", 1),
    ]
    assert park.blob_files() == []
    row = park.job(job)
    assert (row.state, row.done) == ("succeeded", row.total)


def test_a_shape_deleted_after_the_ranking_changes_nothing(park: Zoo) -> None:
    evaluation, job = park.ask("heat")
    expected = expected_result(park, "heat")
    while [kind for _, kind in park.queued(job)] != ["evaluate"] or not park.job(job).done:
        park.run(park.queued(job)[0][0])
    with park.database.begin() as session:
        delete_shape(session, session.scalars(select(Shape.id)).all()[0])
    park.work()
    assert_same(park.result(evaluation)[0], expected)


def test_shapes_and_labels_that_come_later_change_nothing(park: Zoo) -> None:
    expected = expected_result(park, "heat", "commute-time")
    evaluation, job = park.ask("heat", "commute-time")
    park.add("cat.noise.1.off", "late.null.0.off")
    with park.database.begin() as session:
        session.scalars(select(Shape)).all()[4].label = "else"
    park.run(park.queued(job)[0][0])
    park.add("dog.noise.1.off")
    park.work()
    assert_same(park.result(evaluation)[0], expected)


def copy_of_heat(park: Zoo, name: str, state: str = "ready") -> None:
    with park.database.begin() as session:
        heat = session.get_one(TrainedModel, "heat")
        copied = {"method": "heat", "definition": {**heat.definition, "name": name}}
        session.add(TrainedModel(name=name, state=state, built_in=False, created_at=0.0, **copied))


@pytest.mark.parametrize("done", range(4))
def test_a_model_deleted_meanwhile_fails_the_evaluation_by_name(park: Zoo, done: int) -> None:
    copy_of_heat(park, "mine")
    evaluation, job = park.ask("heat", "mine")
    for _ in range(done):
        park.run(park.queued(job)[0][0])
    with park.database.begin() as session:
        delete_model(session, "mine")
    park.work()
    assert park.view(evaluation).state == "failed"
    assert "'mine'" in park.job(job).errors[0]["detail"]
    assert park.job(job).errors[0]["type"] == "model-not-found"


@pytest.mark.parametrize("done", range(4))
def test_a_collection_deleted_meanwhile_fails_the_evaluation(park: Zoo, done: int) -> None:
    evaluation, job = park.ask("heat", "commute-time")
    for _ in range(done):
        park.run(park.queued(job)[0][0])
    with park.database.begin() as session:
        delete_collection(session, "zoo")
    park.work()
    assert park.view(evaluation).state == "failed"
    assert park.job(job).errors[-1]["type"] == "collection-not-found"


def test_a_worker_that_lost_its_lease_stores_nothing(park: Zoo) -> None:
    evaluation, job = park.ask("heat")
    stale = []
    while queued := park.queued(job):
        with park.database.begin() as session:
            stale.append(
                claim_part(session, queued[0][0], message="slow", now=0.0, lease_seconds=1.0)
            )
        park.run(queued[0][0])  # another worker takes over
    expected = park.result(evaluation)
    assert [claim.kind for claim in stale if claim] == ["evaluate", "rank", "evaluate"]
    for claim in stale:
        assert claim is not None
        assert run_claim(park.bench, claim) == "lost"
    assert park.result(evaluation) == expected
    assert park.job(job).state == "succeeded"


def test_what_is_unknown_or_not_ready_is_refused(park: Zoo) -> None:
    with pytest.raises(ModelNotFoundError):
        park.ask("heat", "none")
    copy_of_heat(park, "young", state="training")
    with pytest.raises(ModelNotReadyError):
        park.ask("young")
    with park.database.begin() as session:
        delete_collection(session, "zoo")
    with pytest.raises(CollectionNotFoundError):
        park.ask("heat")


def test_unfinished_uploads_are_refused_by_number(park: Zoo) -> None:
    (one, two) = park.add("a.off", "b.off", described=False)
    with pytest.raises(ShapeNotReadyError, match="2 shapes of collection 'zoo' are still"):
        park.ask("heat")
    with park.database.begin() as session:
        delete_shape(session, one)
        delete_shape(session, two)
        collection = get_collection(session, "zoo")
        zipped = unpack_part(collection.id, "0" * 64, filename="a.zip", label=None, attributes={})
        create_job(
            session, kind="ingest", unit="shapes", parts=[zipped, ingest_part(one)],
            collection="zoo",
        )  # fmt: skip
    with pytest.raises(ShapeNotReadyError, match="1 archives"):
        park.ask("heat")


def test_nothing_to_ask_is_refused_with_what_is_there(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str
) -> None:
    park = Zoo(database, blobs, settings)
    with pytest.raises(InvalidRequestError, match="found 0 shapes"):
        park.ask("heat")
    park.add("a.off", "b.off")
    with pytest.raises(InvalidRequestError, match="0 of them with a label"):
        park.ask("heat")
    with park.database.read() as session:
        assert session.scalars(select(Job)).all() == []
