"""A child that is only slow is left alone; one that is silent for a minute is started again."""

import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from proteus.cli.serving import reporter
from proteus.terminal.output import Output
from service.supervisor.events import Event
from service.supervisor.health import (
    MISSES,
    PAUSE_SECONDS,
    PING_SECONDS,
    SILENCE_SECONDS,
    Ping,
    SocketPing,
    Watch,
)
from service.supervisor.processes import ChildPlan
from service.supervisor.supervise import Supervisor

SLEEPER = (sys.executable, "-S", "-c", "import time; time.sleep(600)")


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


class FakePing:
    """Answers after some seconds, or says at once that nobody listens."""

    def __init__(self, clock: Clock, seconds: float | None) -> None:
        self._clock = clock
        self._answer_at = None if seconds is None else clock.now + seconds

    def answered(self) -> bool | None:
        if self._answer_at is None:
            return False
        return True if self._clock.now >= self._answer_at else None

    def close(self) -> None:
        self._answer_at = None


def died_after(seconds_of_pings: Iterator[float | None], *, patience: float = 3600) -> float | None:
    """Seconds until the watch gives a child up whose pings take so long, or None."""
    clock = Clock()
    watch = Watch(lambda: FakePing(clock, next(seconds_of_pings)), clock=clock)
    started = clock.now
    while clock.now - started < patience:
        if watch.is_dead():
            return clock.now - started
        clock.now += 0.5
    return None


def always(seconds: float | None) -> Iterator[float | None]:
    while True:
        yield seconds


@pytest.mark.parametrize("seconds", [0, 1, 10, PING_SECONDS - 1])
def test_a_child_that_is_slow_to_answer_is_never_given_up(seconds: float) -> None:
    assert died_after(always(seconds)) is None


@pytest.mark.parametrize("seconds", [None, PING_SECONDS + 1, 1e9])
def test_a_silent_child_is_given_up_after_a_minute_and_several_questions(
    seconds: float | None,
) -> None:
    died = died_after(always(seconds))
    assert died is not None
    assert SILENCE_SECONDS <= 60 <= died <= SILENCE_SECONDS + PING_SECONDS + PAUSE_SECONDS
    assert MISSES >= 3


def test_one_answer_in_time_makes_good_for_all_silence_before() -> None:
    def now_and_then() -> Iterator[float | None]:
        while True:
            yield from [None] * 10  # ten refusals in 45 s
            yield 5.0

    assert died_after(now_and_then()) is None


def test_a_supervisor_that_was_held_up_itself_sees_the_answer_that_came_meanwhile() -> None:
    clock = Clock()
    watch = Watch(lambda: FakePing(clock, 1.0), clock=clock)
    for _ in range(20):
        assert not watch.is_dead()
        clock.now += 300  # not even asked for five minutes


@pytest.fixture
def listener(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "s"))
        server.listen(1)
        yield server


def test_a_ping_over_a_socket_never_waits(tmp_path: Path, listener: socket.socket) -> None:
    ping = SocketPing(tmp_path / "s")
    assert ping.answered() is None
    connection, _ = listener.accept()
    with connection:
        assert connection.recv(100) == b"PING\r\n"
        assert ping.answered() is None
        connection.sendall(b"-LOADING the data set\r\n")  # it lives
        assert ping.answered() is True
    ping.close()
    assert ping.answered() is False


def test_a_ping_without_a_listener_fails_at_once(tmp_path: Path, listener: socket.socket) -> None:
    assert SocketPing(tmp_path / "none").answered() is False
    pings = [SocketPing(tmp_path / "s") for _ in range(5)]  # more than the backlog takes
    assert [ping.answered() for ping in pings][-1] is False
    for ping in pings:
        ping.close()
    closing = SocketPing(tmp_path / "s")
    assert closing.answered() is False


def run_with(ping: Callable[[], Ping], clock: Clock, tmp_path: Path, *, until: str) -> list[Event]:
    """Run a supervisor over one sleeping child until an event's text says so."""
    events: list[Event] = []

    def report(event: Event) -> None:
        events.append(event)
        if until in event.text or len(events) > 50:
            os.kill(os.getpid(), signal.SIGINT)

    plan = ChildPlan(
        name="one", command=SLEEPER, environment=os.environ, log_directory=tmp_path, ping=ping
    )
    Supervisor([plan], report=report, clock=clock).run()
    return events


def test_the_supervisor_kills_what_is_silent_once_a_minute_is_over(tmp_path: Path) -> None:
    clock = Clock()

    def ask() -> Ping:
        clock.now += 10
        return FakePing(clock, None)

    events = run_with(ask, clock, tmp_path, until="starting it again")
    texts = [event.text for event in events if event.text]
    assert "one runs, but has not answered for more than 60 s" in texts[0]
    assert "one ended (killed by SIGKILL)" in texts[1]
    assert clock.now - 1000 > SILENCE_SECONDS


def test_the_supervisor_lets_a_slow_child_be_and_restarts_a_dead_one_at_once(
    tmp_path: Path,
) -> None:
    clock = Clock()
    asked = 0

    def ask() -> Ping:
        nonlocal asked
        asked += 1
        clock.now += PAUSE_SECONDS
        if asked == 3:  # it has missed two
            children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text()
            for pid in map(int, children.split()):
                if "time.sleep(600)" in Path(f"/proc/{pid}/cmdline").read_text():
                    os.kill(pid, signal.SIGKILL)
        return FakePing(clock, None)

    started = time.monotonic()
    events = run_with(ask, clock, tmp_path, until="one ended")
    first = next(event.text for event in events if event.text)
    assert first.startswith("one ended (killed by SIGKILL)")
    assert time.monotonic() - started < SILENCE_SECONDS


def test_every_line_of_the_supervisor_carries_a_time(capsys: pytest.CaptureFixture[str]) -> None:
    at = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)
    report = reporter(Output(as_json=True))
    for kind in ("ready", "done", "ended", "note", "stopping", "stopped"):
        report(Event(kind, "broker", f"something about {kind}", at=at))
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 6
    assert all("2026-03-01T09:30:00Z" in line for line in lines)
    assert abs((Event("up").at - datetime.now(UTC)).total_seconds()) < 60
