"""When a child that runs, but does not answer, counts as dead.

A busy machine makes every process slow, and a slow broker that is killed loses more time than it
would have taken. So one missing answer decides nothing: see decision 0025.
"""

import contextlib
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

PAUSE_SECONDS = 5.0
"""Between the end of one question and the next."""
PING_SECONDS = 20.0
"""How long an answer may take."""
MISSES = 3
"""So many questions in a row without an answer, at least."""
SILENCE_SECONDS = 60.0
"""So long without an answer, at least, since the first of them was asked."""
ANSWER_BYTES = 512


class Ping(Protocol):
    """One question to a child; nothing in it waits."""

    def answered(self) -> bool | None:
        """Whether an answer came; None while one may still come."""

    def close(self) -> None:
        """Forget the question."""


class Watch:
    """Asks a child whether it lives, one question at a time.

    Parameters
    ----------
    ask : callable
        Asks a new question.
    clock : callable
        Monotonic seconds.
    """

    def __init__(
        self, ask: Callable[[], Ping], *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._ask = ask
        self._clock = clock
        self._ping: Ping | None = None
        self._asked_at = self._silent_since = self._ask_at = clock()
        self._misses = 0

    def is_dead(self) -> bool:
        """Whether the child has been silent for too long; never waits, and is asked often."""
        now = self._clock()
        if self._ping is None:
            if now < self._ask_at:
                return False
            self._ping, self._asked_at = self._ask(), now
        answered = self._ping.answered()
        if answered is None and now - self._asked_at < PING_SECONDS:
            return False
        self.close()
        self._ask_at = now + PAUSE_SECONDS
        if answered:
            self._misses = 0
            return False
        if not self._misses:
            self._silent_since = self._asked_at
        self._misses += 1
        return self._misses >= MISSES and now - self._silent_since >= SILENCE_SECONDS

    def close(self) -> None:
        """Forget a question that is open."""
        if self._ping is not None:
            self._ping.close()
            self._ping = None


class SocketPing:
    """Asks a Redis or Valkey server on a unix socket. Any answer will do, an error too.

    Parameters
    ----------
    path : Path
        The socket.
    """

    def __init__(self, path: Path) -> None:
        self._socket: socket.socket | None = socket.socket(socket.AF_UNIX)
        self._socket.setblocking(False)
        try:
            self._socket.connect(str(path))
            self._socket.send(b"PING\r\n")
        except OSError:  # nobody listens, or too many wait already
            self.close()

    def answered(self) -> bool | None:
        """Whether an answer came; None while one may still come."""
        if self._socket is None:
            return False
        try:
            return bool(self._socket.recv(ANSWER_BYTES))
        except BlockingIOError:
            return None
        except OSError:
            return False

    def close(self) -> None:
        """Forget the question."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.close()
            self._socket = None
