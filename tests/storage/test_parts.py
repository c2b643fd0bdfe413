"""The laws of claiming, finishing and losing parts, on both databases."""

import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest
from sqlalchemy import select

from workers.errors import ConflictError
from workers.settings import LIGHT
from workers.storage.database import Database
from workers.storage.jobs import (
    FEWEST_DONE,
    NewPart,
    cancel_job,
    create_job,
    get_job,
    retry_job,
)
from workers.storage.models import Part
from workers.storage.parts import (
    Claim,
    Failure,
    LeaseLostError,
    claim_part,
    fail_exhausted,
    finish_part,
    hold_lease,
    parts_to_send,
    release_part,
    renew_leases,
)


def make_job(
    database: Database, count: int, *, finale: NewPart | None = None
) -> tuple[str, list[str]]:
    parts = [NewPart("ingest", LIGHT, {"n": n}) for n in range(count)]
    with database.begin() as session:
        job, rows = create_job(session, kind="ingest", unit="shapes", parts=parts, finale=finale)
        return job.id, [row.id for row in rows]


def claim(database: Database, part: str, *, now: float = 0.0, message: str = "m") -> Claim | None:
    with database.begin() as session:
        return claim_part(session, part, message=message, now=now, lease_seconds=10.0)


def finish(database: Database, held: Claim, failure: Failure | None = None) -> list[str]:
    with database.begin() as session:
        return [part.id for part in finish_part(session, held, failure=failure)]


def state(database: Database, job: str) -> tuple[str, int, int]:
    with database.read() as session:
        row = get_job(session, job)
        return row.state, row.done, row.total


def test_a_job_without_parts_has_succeeded(database: Database) -> None:
    job, _ = make_job(database, 0)
    assert state(database, job) == ("succeeded", 0, 0)


def test_of_many_workers_one_gets_the_part(database: Database) -> None:
    _, (part,) = make_job(database, 1)
    with ThreadPoolExecutor(8) as pool:
        claims = list(pool.map(lambda _: claim(database, part), range(16)))
    assert sum(held is not None for held in claims) == 1


def test_a_lease_that_ran_out_is_taken_over_and_the_first_owner_stores_nothing(
    database: Database,
) -> None:
    job, (part,) = make_job(database, 1)
    first = claim(database, part, now=0.0)
    assert first is not None
    assert claim(database, part, now=9.0) is None
    second = claim(database, part, now=11.0)
    assert second is not None
    assert second.attempts == 2
    with pytest.raises(LeaseLostError):
        finish(database, first)
    assert state(database, job) == ("running", 0, 1)
    finish(database, second)
    assert state(database, job) == ("succeeded", 1, 1)


def test_a_part_is_finished_once(database: Database) -> None:
    job, (part, _) = make_job(database, 2)
    held = claim(database, part)
    assert held is not None
    finish(database, held)
    with pytest.raises(LeaseLostError):
        finish(database, held)
    assert state(database, job) == ("running", 1, 2)


def test_a_renewed_lease_is_not_taken_over(database: Database) -> None:
    _, (part,) = make_job(database, 1)
    claim(database, part, now=0.0, message="heard")
    with database.begin() as session:
        assert renew_leases(session, ["heard", "other"], until=50.0) == 1
    assert claim(database, part, now=11.0) is None
    assert claim(database, part, now=51.0) is not None


def test_parts_that_finish_at_once_end_the_job_once(database: Database) -> None:
    job, parts = make_job(database, 12, finale=NewPart("activate", LIGHT, {}, weight=0))
    claims = [claim(database, part) for part in parts]
    with ThreadPoolExecutor(6) as pool:
        queued = list(pool.map(lambda held: finish(database, held), claims))
    finales = [part for some in queued for part in some]
    assert len(finales) == 1
    assert state(database, job) == ("running", 12, 12)
    held = claim(database, finales[0])
    assert held is not None
    assert finish(database, held) == []
    assert state(database, job) == ("succeeded", 12, 12)


def test_a_job_goes_on_past_a_bad_file_and_names_it(database: Database) -> None:
    job, (bad, good) = make_job(database, 2)
    for part, failure in ((bad, Failure("a.off", "invalid-mesh", "no faces")), (good, None)):
        held = claim(database, part)
        assert held is not None
        finish(database, held, failure)
    assert state(database, job) == ("succeeded", 2, 2)
    with database.read() as session:
        assert get_job(session, job).errors == [
            {"item": "a.off", "type": "invalid-mesh", "detail": "no faces"}
        ]


def test_a_job_estimates_what_is_left_from_what_it_did_since_it_was_begun(
    database: Database,
) -> None:
    """Nothing is told of the first few, nor at the end; a retry begins anew."""
    _, parts = make_job(database, FEWEST_DONE + 3)
    begun = time.time() - 100.0
    told = []
    for part in parts:
        held = claim(database, part, now=begun)
        assert held is not None
        finish(database, held)
        with database.read() as session:
            told.append(get_job(session, held.job_id).seconds_left)
    assert told[: FEWEST_DONE - 1] == [None] * (FEWEST_DONE - 1)
    estimates = [seconds for seconds in told if seconds is not None]
    rates = [left / (FEWEST_DONE + number) for number, left in enumerate((3, 2, 1))]
    assert estimates == pytest.approx([100.0 * rate for rate in rates], abs=5.0)  # a busy machine
    assert told[-1] is None


def test_what_was_done_before_counts_for_no_estimate(database: Database) -> None:
    with database.begin() as session:
        new = [NewPart("ingest", LIGHT, {})] * (FEWEST_DONE + 1)
        job, rows = create_job(session, kind="ingest", unit="shapes", parts=new, done=100)
        parts = [row.id for row in rows]
    for part in parts[:-2]:
        held = claim(database, part)
        assert held is not None
        finish(database, held)
    with database.read() as session:
        found = get_job(session, job.id)
    assert (found.done, found.seconds_left) == (100 + FEWEST_DONE - 1, None)
    with database.begin() as session:
        cancel_job(session, job.id)
    with database.begin() as session:
        retried, _ = retry_job(session, job.id)
        assert retried.done_before == retried.done == 100 + FEWEST_DONE - 1


def test_a_job_of_which_everything_failed_has_failed_and_can_be_retried(
    database: Database,
) -> None:
    job, (part,) = make_job(database, 1)
    held = claim(database, part)
    assert held is not None
    finish(database, held, Failure("a.off", "invalid-mesh", "no faces"))
    assert state(database, job) == ("failed", 1, 1)
    with database.begin() as session:
        row, parts = retry_job(session, job)
        assert ([p.id for p in parts], row.errors) == ([part], [])
    again = claim(database, part)
    assert again is not None
    finish(database, again)
    assert state(database, job) == ("succeeded", 1, 1)
    with pytest.raises(ConflictError), database.begin() as session:
        retry_job(session, job)


def test_after_a_cancellation_nothing_is_begun_or_stored(database: Database) -> None:
    job, (running, waiting) = make_job(database, 2)
    held = claim(database, running)
    assert held is not None
    with database.begin() as session:
        cancel_job(session, job)
    assert claim(database, waiting) is None
    with pytest.raises(LeaseLostError):
        finish(database, held)
    assert state(database, job)[0] == "cancelled"
    with pytest.raises(ConflictError), database.begin() as session:
        cancel_job(session, job)


def test_cancelling_while_parts_finish_never_deadlocks(database: Database) -> None:
    for _ in range(5):
        job, parts = make_job(database, 6)
        claims = [claim(database, part) for part in parts]

        def end(held: Claim | None) -> None:
            assert held is not None
            with suppress(LeaseLostError):
                finish(database, held)

        def cancel(job_id: str) -> None:
            with suppress(ConflictError), database.begin() as session:
                cancel_job(session, job_id)

        with ThreadPoolExecutor(4) as pool:
            ends = [pool.submit(end, held) for held in claims]
            ends.insert(2, pool.submit(cancel, job))
            for future in ends:
                future.result(timeout=60)
        assert state(database, job)[0] in {"cancelled", "succeeded"}


def test_the_sweeper_finds_what_is_long_unheard_and_whose_lease_ran_out(
    database: Database,
) -> None:
    _, (unheard, running, _) = make_job(database, 3)
    with database.begin() as session:
        rows = session.scalars(select(Part)).all()
        for row in rows:
            row.sent_at = 0.0 if row.id == unheard else 100.0
    claim(database, running, now=85.0)
    with database.read() as session:
        lost = parts_to_send(session, now=100.0, resend_seconds=10.0)
    assert {part.id for part in lost} == {unheard, running}


def test_a_released_part_is_queued_again_with_its_attempts(database: Database) -> None:
    _, (part,) = make_job(database, 1)
    held = claim(database, part)
    assert held is not None
    with database.begin() as session:
        hold_lease(session, held)
        release_part(session, held, now=5.0)
    again = claim(database, part)
    assert again is not None
    assert again.attempts == 2


def test_a_part_whose_workers_died_three_times_fails_with_a_reason(database: Database) -> None:
    job, (part,) = make_job(database, 1)
    for attempt in range(3):
        assert claim(database, part, now=attempt * 20.0) is not None
    with database.begin() as session:
        assert fail_exhausted(session, part, now=45.0, max_attempts=3) == []
    assert state(database, job)[0] == "running"  # its lease still stands
    with database.begin() as session:
        fail_exhausted(session, part, now=60.0, max_attempts=3)
    assert state(database, job) == ("failed", 1, 1)
    with database.read() as session:
        assert "3 times" in get_job(session, job).errors[0]["detail"]
