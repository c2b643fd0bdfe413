"""A worker that dies after its n-th step, and what is in the database afterwards."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.pipeline.outcome import Verb
from workers.pipeline.verbs import VERBS
from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Base, Collection, Descriptor, Job, Part, Shape
from workers.storage.parts import parts_to_send

PASSING = {"created_at", "started_at", "finished_at", "sent_at", "lease_until", "change"}
PASSING |= {"seconds_left"}
DRAWN = {"id", "job_id", "attempts", "revision", "message", "owner", "finale", "value", "shape_id"}


class CrashError(BaseException):
    """No `Exception`: nothing in the engine may catch it, as nothing can catch SIGKILL."""


@dataclass
class Countdown:
    """Raises when so many steps were taken: commits, messages, blobs stored or deleted."""

    steps: int | None = None
    taken: int = 0

    def step(self) -> None:
        self.taken += 1
        if self.taken == self.steps:
            raise CrashError


class CrashingDatabase(Database):
    """Dies right after a commit."""

    def __init__(self, url: str, countdown: Countdown) -> None:
        super().__init__(url)
        self.countdown = countdown

    @contextmanager
    def begin(self) -> Iterator[Session]:
        with super().begin() as session:
            yield session
        self.countdown.step()


class CrashingBlobs(BlobStore):
    """Dies right after a blob was stored or deleted."""

    def __init__(self, url: str, countdown: Countdown) -> None:
        super().__init__(url)
        self.countdown = countdown

    def put(self, key: str, data: bytes) -> None:
        super().put(key, data)
        self.countdown.step()

    def delete(self, key: str) -> None:
        super().delete(key)
        self.countdown.step()


def crashing_bench(folder: Path, countdown: Countdown) -> Workbench:
    """Rows and blobs in a folder, for one worker that dies; its leases end at once."""
    settings = Settings(
        data_dir=folder, working_vertices=500, worker_processes=1, lease_seconds=1e-9
    )

    def send(_parts: Sequence[Part]) -> None:
        countdown.step()

    return Workbench(
        CrashingDatabase(settings.resolved_database_url, countdown),
        CrashingBlobs(settings.resolved_blob_url, countdown),
        settings,
        send,
    )


def work_until_nothing_is_left(bench: Workbench, verbs: Mapping[str, Verb] = VERBS) -> None:
    """Run what is queued, or was running in a worker that died, as the sweeper would have it."""
    while True:
        with bench.database.read() as session:
            left = parts_to_send(session, now=time.time() + 1.0, resend_seconds=0.0)
        if not left:
            return
        for part in left:
            run_part(bench, part.id, message=f"in-process-{part.id}", verbs=verbs)


def rows_of(bench: Workbench) -> dict[str, list[str]]:
    """All rows but for what is drawn at random or read from a clock, in an order of their own."""
    found: dict[str, list[str]] = {}
    with bench.database.read() as session:
        content = {
            **{row.id: row.sha256 for row in session.scalars(select(Shape))},
            **{row.id: row.name for row in session.scalars(select(Collection))},
        }
        for table in Base.__subclasses__():
            rows = [_facts(row, content) for row in session.scalars(select(table))]
            found[table.__tablename__] = sorted(map(str, rows))
    return found


def _facts(row: Any, content: dict[str, str]) -> dict[str, Any]:
    columns = {column.key for column in type(row).__mapper__.column_attrs}
    facts = {name: getattr(row, name) for name in sorted(columns - PASSING - DRAWN)}
    if isinstance(row, Job):
        facts["errors"] = sorted(map(str, row.errors))
    if isinstance(row, Descriptor | Part):
        facts["shape"] = content.get(row.shape_id or "")
    return facts
