"""The lock on a data directory: at most one service lives in it."""

import contextlib
import errno
import fcntl
import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from service.supervisor.events import StartError

LOCK_NAME = "lock"


class AlreadyRunningError(StartError):
    """The data directory is held by another running service."""


@dataclass(frozen=True)
class Holder:
    """Who holds a data directory.

    Attributes
    ----------
    pid : int
        Process id of the supervisor; 0 if the lock file does not say.
    url : str
        Where its API listens; empty if not known yet.
    """

    pid: int
    url: str

    @property
    def alive(self) -> bool:
        """Whether a process of that id exists."""
        if self.pid <= 0:
            return False
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        except PermissionError:
            return True
        return True


class DirectoryLock:
    """An exclusive lock on a directory, held until closed.

    The children of the supervisor inherit the descriptor. After a supervisor was killed, the
    directory stays locked until the last of them has ended. So two brokers never write to one
    append-only file.

    Parameters
    ----------
    directory : Path
        An existing directory.
    wait_seconds : float
        How long to wait for the children of a *dead* supervisor; a live one fails at once.

    Raises
    ------
    AlreadyRunningError
        A live supervisor, or what is left of a dead one, holds the directory.
    """

    def __init__(self, directory: Path, *, wait_seconds: float = 20.0) -> None:
        path = directory / LOCK_NAME
        self.descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        until = time.monotonic() + wait_seconds
        while not _try_lock(self.descriptor):
            holder = _read(path)
            if holder.alive or time.monotonic() > until:
                os.close(self.descriptor)
                raise AlreadyRunningError(_explain(directory, holder))
            time.sleep(0.1)
        self.tell(url="")

    def tell(self, *, url: str) -> None:
        """Write into the lock file who holds it and where the API listens."""
        content = json.dumps({"pid": os.getpid(), "url": url}).encode()
        os.ftruncate(self.descriptor, 0)
        os.pwrite(self.descriptor, content, 0)

    def close(self) -> None:
        """Let go of the directory, as far as this process is concerned."""
        with contextlib.suppress(OSError):
            os.close(self.descriptor)

    def __enter__(self) -> "DirectoryLock":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def holder_of(directory: Path) -> Holder | None:
    """Who holds the directory, or None if nobody does (or it does not exist)."""
    path = directory / LOCK_NAME
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        return None if _try_lock(descriptor, shared=True) else _read(path)
    finally:
        os.close(descriptor)


def _try_lock(descriptor: int, *, shared: bool = False) -> bool:
    """Take the lock if it is free."""
    kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in {errno.EWOULDBLOCK, errno.EACCES}:
            return False
        raise
    return True


def _read(path: Path) -> Holder:
    """What the lock file says; an unreadable one names nobody."""
    try:
        content = json.loads(path.read_text() or "{}")
        return Holder(pid=int(content.get("pid", 0)), url=str(content.get("url", "")))
    except (OSError, ValueError, AttributeError):
        return Holder(pid=0, url="")


def _explain(directory: Path, holder: Holder) -> str:
    if holder.alive:
        where = f" at {holder.url}" if holder.url else ""
        return (
            f"{directory} is already served by process {holder.pid}{where}; "
            f"stop that one first (kill {holder.pid}) or choose another data directory"
        )
    return (
        f"{directory} is still locked by processes of an earlier run that was killed "
        f"(it was process {holder.pid}); end them and start again"
    )
