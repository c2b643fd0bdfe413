import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from service.supervisor.lock import AlreadyRunningError, DirectoryLock, holder_of
from service.supervisor.processes import Child, ChildPlan, describe_exit

SLEEPER = (sys.executable, "-S", "-c", "import time; time.sleep(600)")

PARENT = """
import json, sys, os
from functools import partial
from pathlib import Path
from typing import Any
from service.supervisor.events import StartError
from service.supervisor.lock import DirectoryLock
from service.supervisor.processes import ChildPlan
from service.supervisor.supervise import Supervisor

directory = Path(sys.argv[1])
children = json.loads(sys.argv[2])
lock = DirectoryLock(directory, wait_seconds=5)

def ready(name):
    return (directory / f"{name}.ready").exists()

def report(event):
    print(json.dumps([event.kind, event.name, event.text, event.lines]), flush=True)

plans = [
    ChildPlan(
        name=name,
        command=(sys.executable, "-S", "-c", source),
        environment={**os.environ, "READY": str(directory / f"{name}.ready")},
        log_directory=directory / "logs",
        ready=partial(ready, name),
        prepare=partial((directory / f"{name}.ready").unlink, missing_ok=True),
        once=name.startswith("once"),
        grace_seconds=3.0,
        descriptors=(lock.descriptor,),
    )
    for name, source in children.items()
]
try:
    Supervisor(plans, report=report).run()
except StartError as error:
    print(json.dumps(["error", "", str(error), error.lines]), flush=True)
    sys.exit(1)
"""

READY = "import os, pathlib; pathlib.Path(os.environ['READY']).write_text(str(os.getpid())); "
WAITS = READY + "import time; time.sleep(600)"
STUBBORN = (
    "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); " + READY + "import time\n"
    "while True: time.sleep(600)"
)
WITH_HELPER = (
    "import subprocess, sys, pathlib, os\n"
    "helper = subprocess.Popen([sys.executable, '-S', '-c', 'import time; time.sleep(600)'])\n"
    "pathlib.Path(os.environ['READY'] + '.helper').write_text(str(helper.pid))\n" + WAITS
)


def alive(pid: int) -> bool:
    """Whether a process of this id runs; one that only waits to be reaped does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def eventually(condition: Callable[[], bool], *, seconds: float = 20.0) -> bool:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if condition():
            return True
        time.sleep(0.02)
    return condition()


class Run:
    """A supervisor over trivial children, in a process of its own."""

    def __init__(self, directory: Path, **children: str) -> None:
        self.directory = directory
        self.output = directory / "output"
        with self.output.open("wb") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-c", PARENT, str(directory), json.dumps(children)],
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def events(self) -> list[list[Any]]:
        lines = self.output.read_text().splitlines()
        return [json.loads(line) for line in lines if line.startswith("[")]

    def has(self, kind: str, name: str = "") -> bool:
        return any(event[:2] == [kind, name] for event in self.events())

    def pid(self, name: str) -> int:
        """Return what the child wrote once it was ready; before a start it is removed."""
        found: list[str] = []

        def written() -> bool:
            with contextlib.suppress(FileNotFoundError):
                found.append((self.directory / f"{name}.ready").read_text())
            return bool(found and found[-1])

        assert eventually(written), self.output.read_text()
        return int(found[-1])

    def wait_up(self) -> None:
        assert eventually(lambda: self.has("up")), self.output.read_text()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Run]]:
    runs: list[Run] = []

    def begin(**children: str) -> Run:
        runs.append(Run(tmp_path, **children))
        return runs[-1]

    yield begin
    for run in runs:
        pids = [int(path.read_text()) for path in tmp_path.glob("*.ready*") if path.read_text()]
        for pid in [run.process.pid, *pids]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        run.process.wait()


def test_children_start_in_order_and_stop_in_the_other(start: Callable[..., Run]) -> None:
    run = start(first=WAITS, once="print('done')", second=WAITS)
    run.wait_up()
    first, second = run.pid("first"), run.pid("second")
    run.process.send_signal(signal.SIGTERM)
    assert run.process.wait(timeout=20) == 0
    told = [tuple(event[:2]) for event in run.events()]
    assert told[:7] == [
        ("starting", "first"), ("ready", "first"), ("starting", "once"), ("done", "once"),
        ("starting", "second"), ("ready", "second"), ("up", ""),
    ]  # fmt: skip
    assert told[-2:] == [("stopping", ""), ("stopped", "")]
    assert not alive(first)
    assert not alive(second)


def test_killed_child_is_started_again(start: Callable[..., Run]) -> None:
    run = start(one=WAITS, two=WAITS)
    run.wait_up()
    for name in ("one", "two", "one"):
        before = run.pid(name)
        os.kill(before, signal.SIGKILL)
        assert eventually(lambda: not alive(before))  # noqa: B023 (called at once)
        assert eventually(lambda: run.pid(name) != before)  # noqa: B023
    ended = [event[2] for event in run.events() if event[0] == "ended"]
    assert len(ended) == 3
    assert all("killed by SIGKILL" in text for text in ended)


def test_helpers_of_a_killed_child_die_with_it(start: Callable[..., Run]) -> None:
    run = start(one=WITH_HELPER)
    run.wait_up()
    helper = int((run.directory / "one.ready.helper").read_text())
    assert alive(helper)
    os.kill(run.pid("one"), signal.SIGKILL)
    assert eventually(lambda: not alive(helper))


def test_children_die_with_a_killed_parent_and_free_the_lock(start: Callable[..., Run]) -> None:
    run = start(one=WAITS, two=WAITS)
    run.wait_up()
    children = [run.pid("one"), run.pid("two")]
    run.process.kill()
    run.process.wait()
    assert eventually(lambda: not any(alive(pid) for pid in children))
    assert eventually(lambda: holder_of(run.directory) is None)
    again = start(one=WAITS)
    again.wait_up()


def test_interrupt_twice_kills_a_stubborn_child(start: Callable[..., Run]) -> None:
    run = start(one=STUBBORN)
    run.wait_up()
    pid = run.pid("one")
    run.process.send_signal(signal.SIGINT)
    assert eventually(lambda: run.has("stopping"))
    run.process.send_signal(signal.SIGINT)
    assert run.process.wait(timeout=20) == 0
    assert not alive(pid)


def test_stubborn_child_is_killed_after_its_grace(start: Callable[..., Run]) -> None:
    run = start(one=STUBBORN)
    run.wait_up()
    pid = run.pid("one")
    run.process.send_signal(signal.SIGINT)
    assert run.process.wait(timeout=30) == 0
    assert not alive(pid)


@pytest.mark.parametrize("name", ["broken", "once"])
def test_child_that_dies_at_once_ends_the_start_with_its_last_lines(
    start: Callable[..., Run], name: str
) -> None:
    children = {"one": WAITS, name: "import sys; print('no such thing'); sys.exit(7)"}
    run = start(**children)
    assert run.process.wait(timeout=30) == 1
    kind, _, text, lines = run.events()[-1]
    assert kind == "error"
    assert f"{name} ended at once (exit code 7)" in text
    assert lines == ["no such thing"]
    assert not alive(run.pid("one"))


def test_stop_during_the_start_leaves_nothing(start: Callable[..., Run]) -> None:
    run = start(one=WAITS, never="import time; time.sleep(600)")
    assert eventually(lambda: run.has("starting", "never"))
    pid = run.pid("one")
    run.process.send_signal(signal.SIGTERM)
    assert run.process.wait(timeout=20) == 0
    assert not alive(pid)


def test_second_lock_names_the_holder(tmp_path: Path) -> None:
    assert holder_of(tmp_path) is None
    with DirectoryLock(tmp_path) as lock:
        lock.tell(url="http://127.0.0.1:8123")
        holder = holder_of(tmp_path)
        assert holder is not None
        assert (holder.pid, holder.url) == (os.getpid(), "http://127.0.0.1:8123")
        with pytest.raises(AlreadyRunningError, match=f"process {os.getpid()} at http://127.0"):
            DirectoryLock(tmp_path)
    assert holder_of(tmp_path) is None
    DirectoryLock(tmp_path).close()


def test_lock_waits_for_the_children_of_a_dead_holder(tmp_path: Path) -> None:
    lock = DirectoryLock(tmp_path)
    child = subprocess.Popen(
        [sys.executable, "-S", "-c", "import time; time.sleep(0.5)"], pass_fds=(lock.descriptor,)
    )
    (tmp_path / "lock").write_text(json.dumps({"pid": _dead_pid(), "url": ""}))
    lock.close()
    DirectoryLock(tmp_path, wait_seconds=20).close()
    assert child.wait() == 0  # it had ended before the lock was given


def test_lock_does_not_wait_for_ever_for_a_dead_holders_children(tmp_path: Path) -> None:
    with DirectoryLock(tmp_path):
        (tmp_path / "lock").write_text(json.dumps({"pid": _dead_pid(), "url": ""}))
        with pytest.raises(AlreadyRunningError, match="earlier run that was killed"):
            DirectoryLock(tmp_path, wait_seconds=0.1)


def _dead_pid() -> int:
    process = subprocess.Popen([sys.executable, "-S", "-c", ""])
    process.wait()
    return process.pid


def test_long_log_is_set_aside_at_the_start(tmp_path: Path) -> None:
    plan = ChildPlan(name="one", command=SLEEPER, environment=os.environ, log_directory=tmp_path)
    plan.log.write_bytes(b"x" * (6 << 20))
    child = Child(plan)
    child.start()
    child.kill_group()
    assert eventually(lambda: child.take_death() is not None)
    assert plan.log.stat().st_size == 0
    assert (tmp_path / "one.log.1").stat().st_size == 6 << 20


def test_exit_codes_are_said_in_words() -> None:
    assert describe_exit(3) == "exit code 3"
    assert describe_exit(-9) == "killed by SIGKILL"
