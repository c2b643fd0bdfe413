"""Verbs say what they are at, and that they have ended before anything is stored."""

from collections.abc import Mapping
from hashlib import sha256
from typing import NoReturn

import pytest
from sqlalchemy import select

from tests.pipeline.evaluations import Zoo
from tests.pipeline.trainings import CREATURES, begin_training, pairs_for, variants_for
from tests.pipeline.uploads import Upload, potato
from workers.errors import SpectrumError
from workers.pipeline.activation_plan import plan_activation
from workers.pipeline.outcome import Outcome
from workers.pipeline.part_kinds import query_part
from workers.pipeline.progress import LEARNING, MESH_STEPS, TRANSFORMING, Progress
from workers.pipeline.training.fit_kernel import fit_kernel
from workers.pipeline.training.pair import compute_pair
from workers.pipeline.training.variant import compute_variant
from workers.pipeline.verbs import watched
from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore, mesh_key
from workers.storage.database import Database
from workers.storage.jobs import create_job
from workers.storage.models import Part
from workers.storage.parts import Claim

MESH = ["reading", "simplifying", "spectrum", "describing"]


class Heard(Progress):
    """Keeps what it was told, and in what state the part was meanwhile."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.told: list[str] = []
        self.claim: Claim | None = None

    def begin(self, claim: Claim, shape_id: str | None = None) -> None:
        self.claim = claim
        self.told.append("begin" if shape_id is None else "begin a shape")

    def enter(self, step: str) -> None:
        self.told.append(step)

    def end(self) -> None:
        assert self.claim is not None
        with self.database.read() as session:
            state = session.get_one(Part, self.claim.part_id).state
        self.told.append(f"end, {state}")


@pytest.fixture
def heard(database: Database) -> Heard:
    return Heard(database)


@pytest.fixture
def bench(database: Database, blobs: BlobStore, settings: Settings, heard: Heard) -> Workbench:
    return Workbench(database, blobs, settings, lambda _: None, heard)


def run_queued(bench: Workbench, **verbs: object) -> None:
    with bench.database.read() as session:
        queued = session.scalars(select(Part.id).where(Part.state == "queued")).all()
    for part in queued:
        run_part(bench, part, message="m", **verbs)  # type: ignore[arg-type]


def test_a_query_says_its_steps(bench: Workbench, heard: Heard) -> None:
    data = potato(1)
    digest = sha256(data).hexdigest()
    bench.blobs.put(mesh_key(digest), data)
    with bench.database.begin() as session:
        part = query_part(digest, "heat", "asked.off")
        create_job(session, kind="query", unit="meshes", parts=[part])
    run_queued(bench)
    assert heard.told == ["begin", *MESH, "end, running"]


def test_an_upload_and_a_move_to_another_model_say_their_steps(
    bench: Workbench, heard: Heard, zoo: str, upload: Upload
) -> None:
    upload(zoo, potato(1))
    run_queued(bench)
    assert [told for told in heard.told if told != "end, running"] == ["begin", *MESH]
    assert heard.told[-1] == "end, running"
    heard.told.clear()
    with bench.database.begin() as session:
        plan_activation(session, zoo, "biharmonic")
    run_queued(bench)
    assert heard.told[:4] == ["begin", "begin a shape", "describing", "end, running"]


@pytest.mark.parametrize("error", [ValueError("broken"), KeyboardInterrupt()])
def test_work_that_fails_has_ended_too(
    bench: Workbench, heard: Heard, zoo: str, upload: Upload, error: BaseException
) -> None:
    upload(zoo, potato(1))

    def fail(bench: Workbench, _claim: Claim) -> Outcome:
        bench.progress.enter("reading")
        raise error

    verbs = {"ingest": watched(fail)}
    if isinstance(error, Exception):
        run_queued(bench, verbs=verbs)
    else:
        with pytest.raises(type(error)):
            run_queued(bench, verbs=verbs)
    assert heard.told == ["begin", "reading", "end, running"]


def test_an_evaluation_says_that_it_searches_and_measures(
    database: Database, blobs: BlobStore, settings: Settings, heard: Heard, park: Zoo
) -> None:
    bench = Workbench(database, blobs, settings, lambda _: None, heard)
    _, job = park.ask("heat")
    while queued := park.queued(job):
        for part, _ in queued:
            run_part(bench, part, message="m", verbs=park.verbs)
    assert {"searching", "measuring"} <= set(heard.told)
    assert park.job(job).state == "succeeded"


def test_a_training_says_that_it_transforms_and_learns(bench: Workbench, heard: Heard) -> None:
    """Its parts are stopped when it is cancelled; nothing limits their time but the task's."""

    def refuse(_bench: Workbench, _example: object) -> NoReturn:
        raise SpectrumError("not now")

    def claim(kind: str, payload: Mapping[str, object]) -> Claim:
        return Claim("p", job_id, kind, payload, None, "owner", 1)

    job_id = begin_training(bench, "calm")
    pair, variant = pairs_for(bench)[0], variants_for(bench, CREATURES)[0]
    compute_pair(bench, claim("pair", pair.to_payload()), measure=refuse)
    compute_variant(bench, claim("variant", variant.to_payload()), compute=refuse)
    assert heard.told == [TRANSFORMING, TRANSFORMING]
    fit_kernel(bench, claim("fit", {"model": "calm"}))
    assert heard.told[2:] == [LEARNING]
    assert not MESH_STEPS & set(heard.told)
