"""One supervised process: its plan, its start, its log, its death."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from service.supervisor.health import Ping

LOG_BYTES = 5 << 20
"""A log longer than this is set aside when its process starts."""

_SET_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of <linux/prctl.h>
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None


def _nothing() -> None:
    """Do nothing."""


def _always() -> bool:
    """Say yes."""
    return True


def _no_repair(log: str) -> str | None:
    """Know no remedy."""
    return None


@dataclass(frozen=True)
class ChildPlan:
    """How a child is started, watched and stopped.

    Attributes
    ----------
    name : str
        Names the log file and the child in messages.
    command : tuple of str
        Program and arguments.
    environment : mapping
        The whole environment of the child.
    log_directory : Path
        Where ``<name>.log`` is written.
    ready : callable
        Whether the running child can do its work; asked often, must answer within a second.
    ping : callable, optional
        Asks a child that was ready whether it lives; one that is silent for too long is killed
        and started again, see :class:`service.supervisor.health.Watch`.
    prepare : callable
        Called before each start.
    repair : callable
        Gets the log of a child that died before it was ready; mends what it can and says
        what it did, or returns None.
    once : bool
        A step that has to end with exit code 0, rather than go on.
    ready_seconds, grace_seconds : float
        Patience with its start and with its end.
    descriptors : tuple of int
        File descriptors the child inherits.
    """

    name: str
    command: tuple[str, ...]
    environment: Mapping[str, str]
    log_directory: Path
    ready: Callable[[], bool] = _always
    ping: Callable[[], Ping] | None = None
    prepare: Callable[[], None] = _nothing
    repair: Callable[[str], str | None] = _no_repair
    once: bool = False
    ready_seconds: float = 120.0
    grace_seconds: float = 10.0
    descriptors: tuple[int, ...] = ()

    @property
    def log(self) -> Path:
        """The log file."""
        return self.log_directory / f"{self.name}.log"


@dataclass
class Child:
    """A plan and the process that carries it out, if one does.

    Attributes
    ----------
    plan : ChildPlan
        What is to run.
    is_ready : bool
        Whether it was found ready since its last start.
    started_at : float
        Monotonic time of the last start.
    restart_at : float or None
        Monotonic time at which a dead child is started again.
    failures : int
        Deaths since it last ran well.
    """

    plan: ChildPlan
    is_ready: bool = False
    started_at: float = 0.0
    restart_at: float | None = None
    failures: int = 0
    _process: "subprocess.Popen[bytes] | None" = field(default=None, repr=False)
    _log_start: int = 0

    @property
    def pid(self) -> int | None:
        """Process id while it runs."""
        return self._process.pid if self._process else None

    @property
    def running(self) -> bool:
        """Whether there is a process that was not yet found dead."""
        return self._process is not None

    @property
    def age(self) -> float:
        """Seconds since the last start."""
        return time.monotonic() - self.started_at

    def start(self) -> None:
        """Start the process in a group of its own, bound to die with this one."""
        plan = self.plan
        plan.prepare()
        plan.log_directory.mkdir(parents=True, exist_ok=True)
        _set_aside(plan.log)
        with plan.log.open("ab") as log:
            self._log_start = log.tell()
            self._process = subprocess.Popen(
                plan.command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=dict(plan.environment),
                pass_fds=plan.descriptors,
                process_group=0,
                preexec_fn=partial(die_with, os.getpid()),
            )
        self.started_at = time.monotonic()
        self.restart_at = None
        self.is_ready = False

    def take_death(self) -> int | None:
        """Return the exit code if the process has died, after killing what is left of its group.

        Returns
        -------
        int or None
            Exit code, negative for a signal as in :mod:`subprocess`; None while it runs.
        """
        if self._process is None:
            return None
        # The dead leader is left unreaped until its group is gone, so that the group's id
        # cannot have been given to anybody else.
        options = os.WEXITED | os.WNOHANG | os.WNOWAIT
        if os.waitid(os.P_PID, self._process.pid, options) is None:
            return None
        self.kill_group()
        code = self._process.wait()
        self._process = None
        self.is_ready = False
        return code

    def kill_group(self) -> None:
        """Kill the process and all of its group, at once."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def terminate(self) -> None:
        """Ask the process to end."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._process.pid, signal.SIGTERM)

    def log_since_start(self) -> str:
        """What the process has written since its last start, at most the last 64 kB."""
        try:
            with self.plan.log.open("rb") as log:
                size = log.seek(0, os.SEEK_END)
                log.seek(max(min(self._log_start, size), size - (64 << 10)))
                return log.read().decode(errors="replace")
        except OSError:
            return ""

    def last_lines(self, count: int = 12) -> tuple[str, ...]:
        """Return the last lines that the process has written since its start."""
        lines = [line.rstrip() for line in self.log_since_start().splitlines()]
        return tuple([line for line in lines if line][-count:])


def describe_exit(code: int) -> str:
    """Say an exit code in words, e.g. ``exit code 1`` or ``killed by SIGKILL``."""
    if code >= 0:
        return f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"killed by signal {-code}"


def die_with(parent: int) -> None:
    """Have the kernel end this process when its parent dies; runs between fork and exec."""
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    if _LIBC is None:
        return
    _LIBC.prctl(_SET_PARENT_DEATH_SIGNAL, int(signal.SIGTERM))
    if os.getppid() != parent:  # it died before the call above
        os._exit(1)


def _set_aside(log: Path) -> None:
    """Rename a long log, replacing the one renamed before."""
    with contextlib.suppress(FileNotFoundError):
        if log.stat().st_size > LOG_BYTES:
            log.replace(log.with_suffix(".log.1"))
