"""Rows of evaluations: their state is their job's, and lists leave the ranks where they are."""

import pytest
from sqlalchemy import inspect

from tests.storage.rows import make_collection, make_shape
from workers.errors import EvaluationNotFoundError, InvalidRequestError
from workers.settings import LIGHT
from workers.storage.database import Database
from workers.storage.descriptors import described_shapes, mark_deleted, store_descriptors
from workers.storage.evaluations import (
    create_evaluation,
    finish_evaluation,
    get_evaluation,
    group_shapes,
    page_of_evaluations,
    rename_in_evaluations,
)
from workers.storage.identifiers import new_id
from workers.storage.jobs import NewPart, cancel_job, create_job
from workers.storage.models import Job, Shape
from workers.storage.parts import claim_part


def make_evaluation(database: Database, collection: str = "zoo") -> tuple[str, str, str]:
    """Ids of an evaluation, its job and the job's only part."""
    with database.begin() as session:
        part = NewPart("evaluate", LIGHT, {}, weight=0)
        job, (row,) = create_job(session, kind="evaluate", unit="shapes", parts=[part])
        evaluation = create_evaluation(
            session,
            evaluation_id=new_id(),
            job_id=job.id,
            collection=collection,
            models=["heat", "biharmonic"],
            dissimilarity=None,
        )
        return evaluation.id, job.id, row.id


def state(database: Database, evaluation: str) -> str:
    with database.read() as session:
        return get_evaluation(session, evaluation).state


def test_the_state_is_that_of_the_job_until_there_is_a_result(database: Database) -> None:
    evaluation, job, part = make_evaluation(database)
    assert state(database, evaluation) == "queued"
    with database.begin() as session:
        claim_part(session, part, message="m", now=0.0, lease_seconds=10.0)
    assert state(database, evaluation) == "running"
    with database.begin() as session:
        cancel_job(session, job)
    assert state(database, evaluation) == "cancelled"
    with database.begin() as session:
        finish_evaluation(session, evaluation, result={"n_queries": 1}, ranks=[])
    assert state(database, evaluation) == "succeeded"
    with database.begin() as session:
        session.delete(session.get_one(Job, job))
    assert state(database, evaluation) == "succeeded"


def test_without_result_and_job_it_has_failed(database: Database) -> None:
    evaluation, job, _ = make_evaluation(database)
    with database.begin() as session:
        session.delete(session.get_one(Job, job))
    assert state(database, evaluation) == "failed"


def test_an_unknown_id_is_not_found(database: Database) -> None:
    with database.read() as session, pytest.raises(EvaluationNotFoundError, match="'none'"):
        get_evaluation(session, "none")


def test_pages_begin_with_the_newest_and_do_not_read_ranks(database: Database) -> None:
    made = [make_evaluation(database, name)[0] for name in ("zoo", "park", "zoo", "zoo")]
    ranks = [{"query": "q", "model": "heat", "rank": 2, "top": ["t"]}]
    for evaluation in made:
        with database.begin() as session:
            finish_evaluation(session, evaluation, result={"n_queries": 1}, ranks=ranks)
    with database.read() as session:
        first = page_of_evaluations(session, limit=2, cursor=None, collection="zoo")
        rest = page_of_evaluations(session, limit=2, cursor=first.next_cursor, collection="zoo")
        found = [view.row.id for page in (first, rest) for view in page.items]
        assert found == [made[3], made[2], made[0]]
        assert rest.next_cursor is None
        assert all("ranks" in inspect(view.row).unloaded for view in first.items)
        assert len(page_of_evaluations(session, limit=9, cursor=None).items) == 4
        with pytest.raises(InvalidRequestError):
            page_of_evaluations(session, limit=2, cursor="?")
    with database.read() as session:
        row = get_evaluation(session, made[0]).row
    assert (row.result, row.ranks) == ({"n_queries": 1}, ranks)


def test_a_collection_takes_its_evaluations_to_its_new_name(database: Database) -> None:
    moved, _, _ = make_evaluation(database, "zoo")
    stays, _, _ = make_evaluation(database, "park")
    with database.begin() as session:
        rename_in_evaluations(session, "zoo", "jungle")
    with database.read() as session:
        assert get_evaluation(session, moved).row.collection == "jungle"
        assert get_evaluation(session, stays).row.collection == "park"


def test_the_census_parts_what_can_be_compared_from_what_cannot(database: Database) -> None:
    with database.begin() as session:
        zoo, other = make_collection(session), make_collection(session, "other")
        ids = [make_shape(session, zoo, n, label=f"label{n}") for n in range(4)]
        store_descriptors(session, zoo.id, [(i, "heat", b"1234") for i in ids[:2]])
        store_descriptors(session, zoo.id, [(ids[0], "biharmonic", b"1234")])
        for failed in ids[1:3]:  # the first of them can be found all the same
            session.get_one(Shape, failed).error = {"type": "invalid-mesh", "detail": "no faces"}
        make_shape(session, other, 9)
    with database.read() as session:
        grouped = group_shapes(session, zoo)
        assert [shape.id for shape in grouped.ready] == ids[:2]
        assert [shape.label for shape in grouped.ready] == ["label0", "label1"]
        assert [shape.id for shape in grouped.failed] == ids[2:3]
        assert (grouped.unfinished, grouped.unpacking) == (1, 0)
        assert described_shapes(session, zoo.id, "heat") == set(ids[:2])
        assert described_shapes(session, zoo.id, "biharmonic") == {ids[0]}
    with database.begin() as session:
        mark_deleted(session, [ids[0]])
    with database.read() as session:
        assert described_shapes(session, zoo.id, "heat") == {ids[1]}
