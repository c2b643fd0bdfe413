"""Whether the broker answers, asked in a way that holds nobody up."""

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as NotYet

PATIENCE_SECONDS = 0.4
FRESH_SECONDS = 2.0


class BrokerWatch:
    """Asks whether the broker is alive, one question at a time, and remembers the answer.

    A broker on a host that is gone takes seconds to say nothing; a health check has less.

    Parameters
    ----------
    ask : callable
        Whether it is alive; may take long.
    patience_seconds : float
        How long one asker waits for an answer.
    """

    def __init__(
        self, ask: Callable[[], bool], *, patience_seconds: float = PATIENCE_SECONDS
    ) -> None:
        self._ask = ask
        self._patience_seconds = patience_seconds
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="broker-watch")
        self._lock = threading.Lock()
        self._asked: Future[bool] | None = None
        self._asked_at = 0.0

    def alive(self) -> bool:
        """Whether it answered just now; False if it does not within a moment."""
        with self._lock:
            old = time.monotonic() - self._asked_at > FRESH_SECONDS
            if self._asked is None or (self._asked.done() and old):
                self._asked = self._pool.submit(self._ask)
                self._asked_at = time.monotonic()
            asked = self._asked
        try:
            return asked.result(timeout=self._patience_seconds)
        except NotYet:
            return False

    def close(self) -> None:
        """Ask no more."""
        self._pool.shutdown(wait=False, cancel_futures=True)
