"""The supervisor: children started in order, restarted when they die, stopped in reverse."""

import contextlib
import os
import select
import signal
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from types import FrameType

from service.supervisor.events import Event, Report, StartError
from service.supervisor.health import SILENCE_SECONDS, Watch
from service.supervisor.processes import Child, ChildPlan, describe_exit

RESTART_SECONDS = (0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 15.0)
"""Pause before the first, second, ... restart in a row."""
WELL_SECONDS = 30.0
"""A child that ran this long has recovered: its next death counts as the first."""
ATTEMPTS = 2
"""Starts that a child gets before its first readiness, if its repair did something."""


class _StopRequestedError(Exception):
    """A signal asked for the end."""


class Supervisor:
    """Runs the plans as one program; ``run`` must be called in the main thread.

    Parameters
    ----------
    plans : sequence of ChildPlan
        In the order of their start.
    report : callable
        Is told what happens.
    clock : callable
        Monotonic seconds, by which the silence of a child is measured.
    """

    def __init__(
        self,
        plans: Sequence[ChildPlan],
        *,
        report: Report,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._children = [Child(plan) for plan in plans]
        self._report = report
        self._clock = clock
        self._watches: dict[str, Watch] = {}
        self._stop_requests = 0
        self._wake: socket.socket | None = None

    def run(self) -> None:
        """Start all, look after them until a signal asks to stop, stop all.

        SIGINT, SIGTERM and SIGHUP end it in order; a second one kills at once.

        Raises
        ------
        StartError
            A child could not be brought up; everything is stopped again.
        """
        with self._signals():
            try:
                for child in self._children:
                    self._bring_up(child)
                self._report(Event("up"))
                while True:
                    self._sleep(self._pause())
                    self._look_after()
            except _StopRequestedError:
                pass
            finally:
                self._stop()

    # -- start -----------------------------------------------------------------------------

    def _bring_up(self, child: Child) -> None:
        """Start a child and wait until it is ready, looking after the earlier ones meanwhile."""
        self._report(Event("starting", child.plan.name))
        for attempt in range(1, ATTEMPTS + 1):
            child.start()
            code = self._wait_until_ready(child)
            if code is None or (code == 0 and child.plan.once):
                self._report(Event("done" if child.plan.once else "ready", child.plan.name))
                return
            lines = child.last_lines()
            remedy = child.plan.repair(child.log_since_start())
            if remedy is None or attempt == ATTEMPTS:
                name, log = child.plan.name, child.plan.log
                raise StartError(
                    f"{name} ended at once ({describe_exit(code)}); its log is {log}", lines=lines
                )
            self._report(Event("note", child.plan.name, remedy, lines))

    def _wait_until_ready(self, child: Child) -> int | None:
        """Return None once the child is ready, or its exit code if it died before."""
        while True:
            code = child.take_death()
            if code is not None:
                return code
            if not child.plan.once and child.plan.ready():
                child.is_ready = True
                return None
            if child.age > child.plan.ready_seconds:
                raise StartError(
                    f"{child.plan.name} was not ready after {child.plan.ready_seconds:.0f} s; "
                    f"its log is {child.plan.log}",
                    lines=child.last_lines(),
                )
            self._sleep(0.05)
            self._look_after(until=child)

    # -- run -------------------------------------------------------------------------------

    def _look_after(self, *, until: Child | None = None) -> None:
        """Notice deaths and readiness, and restart what is due, up to but not ``until``."""
        for child in self._children:
            if child is until:
                return
            if child.plan.once:
                continue
            was_ready, code = child.is_ready, child.take_death()
            if code is not None:
                self._end_watch(child)
                lines = () if was_ready else child.last_lines()
                self._plan_restart(child, describe_exit(code), lines)
            elif child.restart_at is not None and time.monotonic() >= child.restart_at:
                self._restart(child)
            elif child.running and not child.is_ready:
                self._ask_whether_ready(child)
            elif child.running:
                self._ask_whether_alive(child)

    def _restart(self, child: Child) -> None:
        """Start a dead child again; where even that fails, later."""
        try:
            child.start()
        except (OSError, StartError) as error:
            self._plan_restart(child, f"it could not be started: {error}")

    def _plan_restart(self, child: Child, reason: str, lines: tuple[str, ...] = ()) -> None:
        """Decide when a dead child starts again, and say so."""
        was_early = child.age < WELL_SECONDS
        child.failures = child.failures + 1 if was_early else 1
        pause = RESTART_SECONDS[min(child.failures, len(RESTART_SECONDS)) - 1]
        child.restart_at = time.monotonic() + pause
        text = f"{child.plan.name} ended ({reason}); starting it again in {pause:g} s"
        remedy = child.plan.repair(child.log_since_start()) if lines else None
        self._report(Event("ended", child.plan.name, text, lines))
        if remedy is not None:
            self._report(Event("note", child.plan.name, remedy))

    def _ask_whether_ready(self, child: Child) -> None:
        """Mark a restarted child as ready once it is; kill one that takes too long."""
        if child.plan.ready():
            child.is_ready = True
            self._report(Event("ready", child.plan.name))
        elif child.age > child.plan.ready_seconds:
            text = f"{child.plan.name} was not ready after {child.plan.ready_seconds:.0f} s"
            self._report(Event("note", child.plan.name, f"{text}; it is killed"))
            child.kill_group()

    def _ask_whether_alive(self, child: Child) -> None:
        """Kill a ready child that has been silent for too long; its death restarts it."""
        if child.plan.ping is None:
            return
        name = child.plan.name
        if name not in self._watches:
            self._watches[name] = Watch(child.plan.ping, clock=self._clock)
        if self._watches[name].is_dead():
            self._end_watch(child)
            text = f"{name} runs, but has not answered for more than {SILENCE_SECONDS:.0f} s"
            self._report(Event("note", name, f"{text}; it is killed"))
            child.kill_group()

    def _end_watch(self, child: Child) -> None:
        watch = self._watches.pop(child.plan.name, None)
        if watch is not None:
            watch.close()

    def _pause(self) -> float:
        """How long nothing is due; a signal, such as a child's death, ends the sleep early."""
        if any(child.running and not child.is_ready for child in self._children):
            return 0.1
        due = [c.restart_at - time.monotonic() for c in self._children if c.restart_at is not None]
        return max(0.01, min([1.0, *due]))

    # -- stop ------------------------------------------------------------------------------

    def _stop(self) -> None:
        """End the children in reverse order; a further signal kills them all."""
        self._report(Event("stopping"))
        enough = min(self._stop_requests, 1)
        for child in reversed(self._children):
            child.terminate()
            until = time.monotonic() + child.plan.grace_seconds
            while child.running and child.take_death() is None:
                if self._stop_requests > enough or time.monotonic() > until:
                    child.kill_group()
                self._rest(0.05)
            child.restart_at = None
        self._report(Event("stopped"))

    # -- signals ---------------------------------------------------------------------------

    @contextlib.contextmanager
    def _signals(self) -> Iterator[None]:
        """Count requests to stop, and let every signal end a sleep."""
        reader, writer = socket.socketpair()
        reader.setblocking(False)
        writer.setblocking(False)
        handlers = {
            signal.SIGINT: self._request_stop,
            signal.SIGTERM: self._request_stop,
            signal.SIGHUP: self._request_stop,
            signal.SIGCHLD: _ignore,
        }
        if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:  # started by nohup
            del handlers[signal.SIGHUP]
        before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
        wakeup = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
        self._wake = reader
        try:
            yield
        finally:
            self._wake = None
            signal.set_wakeup_fd(wakeup)
            for number, handler in before.items():
                signal.signal(number, handler)
            reader.close()
            writer.close()

    def _request_stop(self, number: int, frame: FrameType | None) -> None:
        self._stop_requests += 1

    def _sleep(self, seconds: float) -> None:
        """Rest, then heed a request to stop."""
        if not self._stop_requests:
            self._rest(seconds)
        if self._stop_requests:
            raise _StopRequestedError

    def _rest(self, seconds: float) -> None:
        """Wait until the time is over or a signal came."""
        if self._wake is None:
            time.sleep(seconds)
            return
        if select.select([self._wake], [], [], seconds)[0]:
            with contextlib.suppress(BlockingIOError):
                os.read(self._wake.fileno(), 4096)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Take a signal whose only use is to end a sleep."""
