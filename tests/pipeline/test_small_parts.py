"""Small shapes that are claimed and stored together, on both databases."""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import pytest
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from tests.pipeline.crashes import CrashError
from tests.pipeline.uploads import Upload
from workers.errors import InvalidMeshError, SpectrumError
from workers.pipeline.outcome import GoOn, Outcome
from workers.pipeline.small_parts import Bulk
from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.descriptors import get_vector, store_descriptors
from workers.storage.jobs import cancel_job, get_job
from workers.storage.models import Job, Part, Shape
from workers.storage.parts import Claim, renew_leases
from workers.storage.shapes import delete_shape

ALL = Bulk(parts=16, n_bytes=1 << 20, shares=1, seconds=60.0)
"""One process, which takes all that is small at once."""
Act = Callable[[Claim], Outcome | None]


@dataclass
class Worker:
    """Runs parts of an upload; what it does with a shape can be changed by the shape's place."""

    bench: Workbench
    collection: str
    upload: Upload
    job: str = ""
    shapes: list[str] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)
    computed: list[int] = field(default_factory=list)
    sent: list[str] = field(default_factory=list)
    acts: dict[int, Act] = field(default_factory=dict)

    def receive(self, *sizes: int) -> None:
        """Upload files of so many bytes each."""
        files = [bytes([number]) * size for number, size in enumerate(sizes)]
        self.job, self.shapes = self.upload(self.collection, *files)
        with self.bench.database.read() as session:
            rows = session.execute(select(Part.shape_id, Part.id)).all()
        found = {row.shape_id: row.id for row in rows}
        self.parts = [found[shape] for shape in self.shapes]

    def run(self, place: int, bulk: Bulk = ALL, *, message: str = "m") -> int:
        """Wake the worker for one shape; returns how many parts it claimed."""
        verbs = {"ingest": self.compute}
        return run_part(self.bench, self.parts[place], message=message, verbs=verbs, bulk=bulk)

    def compute(self, _bench: Workbench, claim: Claim) -> Outcome:
        place = self.shapes.index(str(claim.shape_id))
        self.computed.append(place)
        acted = self.acts[place](claim) if place in self.acts else None
        return stored(claim) if acted is None else acted

    def change(self, place: int, **values: object) -> None:
        """What somebody else does to a part's row meanwhile."""
        with self.bench.database.begin() as session:
            session.execute(update(Part).where(Part.id == self.parts[place]).values(**values))

    @property
    def states(self) -> list[tuple[str, int]]:
        """State and attempts of each part."""
        with self.bench.database.read() as session:
            rows = {row.id: row for row in session.scalars(select(Part))}
        return [(rows[part].state, rows[part].attempts) for part in self.parts]

    @property
    def described(self) -> list[int]:
        """Places of the shapes that have a descriptor."""
        with self.bench.database.read() as session:
            vectors = [get_vector(session, shape, "heat") for shape in self.shapes]
        return [place for place, vector in enumerate(vectors) if vector is not None]

    @property
    def progress(self) -> tuple[str, int, int, int]:
        """State, done, total and failed of the job."""
        with self.bench.database.read() as session:
            job = get_job(session, self.job)
            return job.state, job.done, job.total, job.failed


def stored(claim: Claim) -> Outcome:
    """Store a descriptor, as `ingest` does."""

    def store(session: Session, _job: Job) -> None:
        shape = session.get(Shape, claim.shape_id, with_for_update=True)
        if shape is None:  # it was deleted meanwhile
            return
        store_descriptors(session, shape.collection_id, [(shape.id, "heat", b"\0\0\0\0")])

    return Outcome(store=store)


def refuse(_claim: Claim) -> Outcome:
    raise InvalidMeshError("it has no faces")


def go_wrong(_claim: Claim) -> Outcome:
    raise ZeroDivisionError


def die(_claim: Claim) -> Outcome:
    raise CrashError


class CountingDatabase(Database):
    """Counts the transactions that write."""

    written = 0

    @contextmanager
    def begin(self) -> Iterator[Session]:
        with super().begin() as session:
            yield session
        self.written += 1


@pytest.fixture
def worker(
    database: Database, blobs: BlobStore, settings: Settings, zoo: str, upload: Upload
) -> Iterator[Worker]:
    sent: list[str] = []

    def send(parts: Sequence[Part]) -> None:
        sent.extend(part.id for part in parts)

    own = CountingDatabase(settings.resolved_database_url)
    yield Worker(Workbench(own, blobs, settings, send), zoo, upload, sent=sent)
    own.dispose()


def test_small_shapes_of_an_upload_take_two_transactions_together(worker: Worker) -> None:
    worker.receive(*[100] * 6)
    assert isinstance(worker.bench.database, CountingDatabase)
    assert worker.run(2) == 6
    assert worker.bench.database.written == 2
    assert worker.described == [0, 1, 2, 3, 4, 5]
    assert worker.progress == ("succeeded", 6, 6, 0)
    assert [worker.run(place) for place in range(6)] == [0] * 6  # their messages come later
    assert sorted(worker.computed) == [0, 1, 2, 3, 4, 5]
    assert worker.bench.database.written == 2


def test_what_is_large_is_left_to_others(worker: Worker) -> None:
    worker.receive(100, 5000, 100, 900, 100)
    assert worker.run(0, replace(ALL, n_bytes=1000)) == 3
    assert worker.described == [0, 2, 4]
    assert worker.run(1, replace(ALL, n_bytes=1000)) == 1
    assert worker.run(3, replace(ALL, parts=1)) == 1
    assert worker.progress == ("succeeded", 5, 5, 0)


def test_a_claim_is_a_share_of_what_waits_and_gets_smaller(worker: Worker) -> None:
    """So the last shapes are spread over all processes."""
    worker.receive(*[100] * 10)
    taken = [worker.run(place, replace(ALL, shares=2)) for place in range(10)]
    assert taken == [5, 0, 0, 0, 0, 3, 0, 0, 1, 1]


def test_other_uploads_and_other_work_are_not_taken_along(worker: Worker) -> None:
    worker.receive(100, 100, 100)
    first = worker.parts
    worker.upload(worker.collection, b"other")
    worker.change(1, kind="variant")
    assert worker.run(0) == 2
    assert [state for state, _ in worker.states] == ["succeeded", "queued", "succeeded"]
    assert worker.parts == first


@pytest.mark.parametrize("place", [0, 2, 3])
def test_a_bad_mesh_harms_no_other(worker: Worker, place: int) -> None:
    worker.receive(*[100] * 4)
    worker.acts[place] = refuse
    worker.run(0)
    assert worker.described == [other for other in range(4) if other != place]
    assert worker.progress == ("succeeded", 4, 4, 1)
    with worker.bench.database.read() as session:
        (error,) = get_job(session, worker.job).errors
        shape = session.get(Shape, worker.shapes[place])
    assert error == {"item": f"{place}.off", "type": "invalid-mesh", "detail": "it has no faces"}
    assert shape is not None
    assert shape.error == {"type": "invalid-mesh", "detail": "it has no faces"}


def test_an_error_of_ours_gives_back_that_shape_alone(worker: Worker) -> None:
    worker.receive(*[100] * 4)
    worker.acts[1] = go_wrong
    worker.run(0)
    assert worker.states[1] == ("queued", 1)
    assert worker.described == [0, 2, 3]


def test_a_shape_that_cannot_be_stored_fails_alone(worker: Worker) -> None:
    worker.receive(*[100] * 4)

    def uncertified(_session: Session, _job: Job) -> None:
        raise SpectrumError("it could not be certified")

    worker.acts[2] = lambda _claim: Outcome(store=uncertified)
    worker.run(0)
    assert worker.described == [0, 1, 3]
    assert worker.progress == ("succeeded", 4, 4, 1)


def test_a_shape_that_must_go_on_is_stored_later_and_the_others_too(worker: Worker) -> None:
    worker.receive(*[100] * 4)
    worker.acts[1] = lambda claim: Outcome(store=lambda _s, _j: GoOn(lambda: stored(claim)))
    worker.run(0)
    assert worker.described == [0, 1, 2, 3]
    assert worker.progress == ("succeeded", 4, 4, 0)


def test_a_lease_that_is_lost_costs_that_shape_alone(worker: Worker) -> None:
    worker.receive(*[100] * 4)

    def lose(_claim: Claim) -> None:
        worker.change(1, owner="another worker", attempts=2)

    worker.acts[3] = lose
    worker.run(0)
    assert worker.described == [0, 2, 3]
    assert worker.states[1] == ("running", 2)
    assert worker.progress == ("running", 3, 4, 0)


def test_a_cancelled_job_stores_nothing_and_what_is_not_begun_is_left_alone(
    worker: Worker,
) -> None:
    worker.receive(*[100] * 4)

    def cancel(_claim: Claim) -> None:
        with worker.bench.database.begin() as session:
            cancel_job(session, worker.job)

    worker.acts[1] = cancel
    worker.run(0)
    assert worker.computed == [0, 1]
    assert worker.described == []
    assert {state for state, _ in worker.states} == {"cancelled"}


def test_what_is_not_begun_in_time_is_given_back_and_sent(worker: Worker) -> None:
    worker.receive(*[100] * 4)
    worker.run(0, replace(ALL, seconds=0.0))
    assert worker.described == [0]
    assert worker.states == [("succeeded", 1), *[("queued", 0)] * 3]
    assert worker.sent == worker.parts[1:]
    for place in (1, 2, 3):
        worker.run(place, replace(ALL, seconds=0.0))
    assert worker.progress == ("succeeded", 4, 4, 0)


def test_only_the_first_lease_is_renewed(worker: Worker) -> None:
    """So what waits behind a long part is free for others when a lease is over."""
    worker.receive(*[100] * 3)

    def renew(_claim: Claim) -> None:
        with worker.bench.database.begin() as session:
            assert renew_leases(session, ["m"], until=9e9) == 1

    worker.acts[2] = renew
    worker.run(0)
    with worker.bench.database.read() as session:
        messages = [session.get_one(Part, part).message for part in worker.parts]
    assert messages == ["m", None, None]


def test_another_process_takes_over_what_waits_behind_a_long_part(worker: Worker) -> None:
    worker.receive(*[100] * 4)

    def take_long(_claim: Claim) -> None:
        for place in (2, 3):
            worker.change(place, lease_until=0.0)
            assert worker.run(place, message="another") == 1

    worker.acts[1] = take_long
    worker.run(0)
    assert worker.computed == [0, 1, 2, 3]  # each once
    assert worker.described == [0, 1, 2, 3]
    assert worker.progress == ("succeeded", 4, 4, 0)


def test_a_shape_that_kills_its_worker_takes_no_other_with_it(worker: Worker) -> None:
    worker.receive(*[100] * 4)
    worker.acts[2] = die
    with pytest.raises(CrashError):
        worker.run(0)
    assert worker.states == [("running", 1)] * 4
    for _ in range(3):
        for place in range(4):
            if worker.states[place][0] == "running":
                worker.change(place, lease_until=0.0)
            if place == 2 and worker.states[place][1] < 3:
                with pytest.raises(CrashError):
                    worker.run(place)
            else:
                worker.run(place)
    assert worker.described == [0, 1, 3]
    assert worker.states == [("succeeded", 2)] * 2 + [("failed", 4), ("succeeded", 2)]
    assert worker.progress == ("succeeded", 4, 4, 1)


def test_what_was_tried_before_is_claimed_alone(worker: Worker) -> None:
    worker.receive(*[100] * 4)
    worker.change(1, attempts=1)
    worker.change(2, attempts=1)
    assert worker.run(1) == 1
    assert worker.run(0) == 2
    assert worker.states == [("succeeded", 1), ("succeeded", 2), ("queued", 1), ("succeeded", 1)]


def test_where_a_part_is_tried_once_each_is_claimed_alone(worker: Worker) -> None:
    worker.receive(*[100] * 3)
    strict = worker.bench.settings.model_copy(update={"max_attempts": 1})
    worker.bench = replace(worker.bench, settings=strict)
    assert worker.run(0) == 1


def test_processes_that_store_together_never_lock_each_other_out(worker: Worker) -> None:
    """Two of them store, while a client deletes shapes of the same upload."""
    worker.receive(*[100] * 48)
    bulk = replace(ALL, parts=8)
    gone = worker.shapes[::4]

    def work(name: str) -> None:
        for place in range(48):
            worker.run(place, bulk, message=name)

    def delete() -> None:
        for shape in gone:
            with worker.bench.database.begin() as session:
                delete_shape(session, shape)

    with ThreadPoolExecutor(3) as threads:
        running = [threads.submit(work, name) for name in ("one", "two")]
        running.append(threads.submit(delete))
        for one in running:
            one.result()
    assert worker.progress == ("succeeded", 48, 48, 0)
    assert sorted(worker.computed) == list(range(48))
    assert [worker.shapes[place] for place in worker.described] == [
        shape for shape in worker.shapes if shape not in gone
    ]


def test_all_shapes_are_locked_before_the_first_is_stored(worker: Worker) -> None:
    """A client that deletes the second shape waits for it, and has not locked it yet."""
    worker.receive(*[100] * 3)

    def delete() -> None:
        with worker.bench.database.begin() as session:
            delete_shape(session, worker.shapes[1])

    with ThreadPoolExecutor(1) as thread:
        deleting: list[Future[None]] = []

        def store_first(claim: Claim) -> Outcome:
            plain = stored(claim).store
            assert plain is not None

            def store(session: Session, job: Job) -> None:
                plain(session, job)  # it has locked the counter of changes
                deleting.append(thread.submit(delete))
                time.sleep(0.3)

            return Outcome(store=store)

        worker.acts[0] = store_first
        worker.run(0)
        deleting[0].result()
    assert isinstance(worker.bench.database, CountingDatabase)
    assert worker.bench.database.written == 3  # claimed, stored together, deleted
    assert worker.progress == ("succeeded", 3, 3, 0)
    assert worker.described == [0, 2]
