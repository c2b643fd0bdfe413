"""``make train-default`` in small, with real processes, one of which is killed on the way."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.default_model import request_body
from service.schemas.training import DEFAULT_VIEWS
from tests.pipeline.trainings import begin_bank, definition, small_bench, work
from tests.storage.test_shipped_models import RAISED_SINCE
from workers.storage.migrate import migrate
from workers.storage.shipped_models import shipped_model, shipped_report
from workers.training.bank import MOST_CHANNELS
from workers.training.request import TrainingRequest

SMALL = ("--creatures", "4", "-t", "noise", "-t", "scale", "--strength", "2", "--view", "closed")
ROOT = Path(__file__).parent.parent.parent


def descendants(pid: int) -> Iterator[int]:
    """Processes below this one."""
    with contextlib.suppress(OSError):
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            yield int(child)
            yield from descendants(int(child))


def kill_once_it_works(builder: subprocess.Popen[str], variants: Path) -> None:
    """Kill a process of the worker's pool as soon as something is stored."""
    while builder.poll() is None:
        if any(variants.rglob("*.npz")):
            for pid in descendants(builder.pid):
                with contextlib.suppress(OSError):
                    if "billiard" in Path(f"/proc/{pid}/cmdline").read_text():
                        os.kill(pid, signal.SIGKILL)
                        return
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks at processes by /proc")
def test_a_killed_worker_changes_nothing(tmp_path: Path, short_folder: Path) -> None:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PROTEUS_")}
    builder = subprocess.Popen(
        [
            *(sys.executable, "-m", "benchmarks.default_model", *SMALL),
            *("--data-dir", str(tmp_path / "data"), "--out", str(tmp_path / "out")),
            *("--working-vertices", "500", "--workers", "1"),
        ],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**environment, "TMPDIR": str(short_folder), "PROTEUS_LEASE_SECONDS": "5"},
    )  # fmt: skip
    killer = threading.Thread(
        target=kill_once_it_works, args=(builder, tmp_path / "data" / "blobs" / "variants")
    )
    killer.start()
    told, _ = builder.communicate(timeout=400)
    killer.join()
    assert builder.returncode == 0, told
    assert "held out" in told
    found = json.loads((tmp_path / "out" / "proteus.json").read_text())

    bench = small_bench(tmp_path / "undisturbed")
    migrate(bench.settings)
    asked = TrainingRequest(transformations=("noise", "scale"), strengths=(2,), creatures=4)
    begin_bank(bench, "undisturbed", asked, channels=MOST_CHANNELS)
    work(bench)
    expected = definition(bench, "undisturbed")
    bench.database.dispose()
    assert found["channels"] == expected["channels"]
    assert found["impostor_quantiles"] == expected["impostor_quantiles"]
    report = shipped_report(tmp_path / "out")
    assert report["rows"] == expected["training"]["rows"]
    assert report["witnesses"][0]["species"] == "human"
    small = shipped_model(working_vertices=500, folder=tmp_path / "out")
    assert small.dimension == len(report["witnesses"][0]["descriptor"])


def test_what_is_asked_for_is_what_the_report_says_was_asked_for() -> None:
    request = shipped_report()["request"]
    training = request["training"]
    asked = request_body(
        creatures=training["creatures"],
        transformations=training["transformations"],
        strengths=training["strengths"],
        views=DEFAULT_VIEWS,
    )
    if not RAISED_SINCE:  # the name has the versions in it
        assert request["name"] == asked["name"]
    assert {**request, "name": ""} == {**asked, "name": ""}
