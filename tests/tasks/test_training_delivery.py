"""A training over a real broker and real workers gives the model of an undisturbed one."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select

from tests.pipeline.trainings import begin_training, definition, small_bench, work
from tests.servers import valkey_server
from tests.tasks.test_delivery import Fleet, make_fleet
from workers.pipeline.workbench import Workbench
from workers.storage.migrate import migrate
from workers.storage.models import Part
from workers.training.request import TrainingRequest

pytestmark = [pytest.mark.server, pytest.mark.slow]
REQUEST = TrainingRequest(transformations=("noise", "holes"), strengths=(1, 4), shapes=3)


def bench_of(fleet: Fleet) -> Workbench:
    return Workbench(fleet.database, fleet.blobs, fleet.settings, lambda parts: None)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The model as one process makes it, part after part."""
    bench = small_bench(tmp_path_factory.mktemp("alone"))
    migrate(bench.settings)
    begin_training(bench, "mine", REQUEST)
    work(bench)
    found = definition(bench, "mine")
    bench.database.dispose()
    return found


@pytest.fixture
def fleet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Fleet]:
    monkeypatch.setenv("PROTEUS_WORKING_VERTICES", "500")
    with valkey_server(tmp_path) as broker:
        yield from make_fleet(tmp_path, "", broker, working_vertices=500)


def test_four_processes_of_which_all_are_killed_once_give_the_same_bytes(
    fleet: Fleet, undisturbed: dict[str, Any]
) -> None:
    begin_training(bench_of(fleet), "mine", REQUEST)
    with fleet.worker(processes=4) as worker:
        fleet.send_all()
        fleet.wait_until(lambda: count(fleet, "succeeded") >= 3 and count(fleet, "running") >= 1)
        os.killpg(worker.pid, signal.SIGKILL)
    assert count(fleet, "succeeded") < 12
    with fleet.worker():
        fleet.wait_until(fleet.all_ended)
    with fleet.database.read() as session:
        assert (session.scalar(select(func.max(Part.attempts))) or 0) >= 2
    assert definition(bench_of(fleet), "mine") == undisturbed


def count(fleet: Fleet, state: str) -> int:
    """Pairs in a state."""
    with fleet.database.read() as session:
        pairs = select(func.count()).where(Part.kind == "pair", Part.state == state)
        return session.scalar(pairs) or 0
