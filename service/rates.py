"""How often a client may do something, counted by a sliding window.

A fleet of API processes counts in Redis, so that a client has one count whichever process it
reaches. A single process counts in memory, and so does a fleet while Redis is away. No request is
refused because Redis is away, and none is delayed after the first failure.
"""

import math
import threading
import time
from collections.abc import Callable
from typing import TypeVar

import structlog
from limits import RateLimitItem, parse
from limits.errors import StorageError
from limits.storage import MemoryStorage, RedisStorage
from limits.strategies import MovingWindowRateLimiter
from redis import ConnectionPool
from redis.backoff import NoBackoff
from redis.retry import Retry

from service.readiness import BrokerWatch
from workers.settings import Settings, SettingsError

log = structlog.get_logger(__name__)

TIMEOUT_SECONDS = 0.2
PROBE_KEEPS_SECONDS = 10
Answer = TypeVar("Answer")


def read_rate(variable: str, text: str) -> RateLimitItem | None:
    """Read a rate such as ``600/minute``; an empty text means no rate.

    Raises
    ------
    SettingsError
        The text is no rate; the message names the variable.
    """
    if not text:
        return None
    try:
        return parse(text)
    except ValueError:
        raise SettingsError(f"{variable} is {text!r}, expected e.g. 600/minute") from None


def open_counts(settings: Settings) -> "RateCounts":
    """Return the counts of this process: shared if its broker is, else its own."""
    if settings.has_embedded_broker:
        return RateCounts()
    return RateCounts(settings.broker_url, prefix=f"{settings.queue_prefix}:rates")


class RateCounts:
    """Counts by name, each against a rate.

    Parameters
    ----------
    url : str
        Redis to count in, as Celery writes it. Empty: count in memory.
    prefix : str
        What the keys in Redis begin with.
    """

    def __init__(self, url: str = "", *, prefix: str = "rates") -> None:
        self._own = MovingWindowRateLimiter(MemoryStorage())
        self._pool = _redis_pool(url) if url else None
        self._shared = _shared_counts(self._pool, prefix) if self._pool else None
        self._lock = threading.Lock()
        self._watch: BrokerWatch | None = None

    @property
    def may_wait(self) -> bool:
        """Whether counting talks to another process, and so belongs into a thread."""
        return self._shared is not None

    def take(self, rate: RateLimitItem, name: str) -> int:
        """Count one more under a name, if the rate allows it.

        Returns
        -------
        Seconds until it is allowed again; 0 if it was counted.
        """
        return self._ask(lambda counts: 0 if counts.hit(rate, name) else _wait(counts, rate, name))

    def look(self, rate: RateLimitItem, name: str) -> int:
        """Return what `take` would, without counting."""
        return self._ask(lambda counts: 0 if counts.test(rate, name) else _wait(counts, rate, name))

    def close(self) -> None:
        """Let go of Redis."""
        with self._lock:
            self._stop_watching()
        if self._pool is not None:
            self._pool.disconnect()

    def _ask(self, question: Callable[[MovingWindowRateLimiter], Answer]) -> Answer:
        """Ask Redis. Without Redis, or while it is away, ask the memory of this process."""
        if self._shared is not None and self._reaches_redis():
            try:
                return question(self._shared)
            except StorageError as error:
                self._note_loss(error)
        return question(self._own)

    def _reaches_redis(self) -> bool:
        """Whether Redis was not lost, or is back; never waits."""
        watch = self._watch
        if watch is None:
            return True
        if not watch.alive():
            return False
        with self._lock:
            if self._watch is watch:
                self._stop_watching()
                log.info("requests are counted in Redis again")
        return True

    def _note_loss(self, error: StorageError) -> None:
        """Say once that Redis is away, and watch for its return."""
        with self._lock:
            if self._watch is None:
                self._watch = BrokerWatch(self._can_count, patience_seconds=0)
                reason = str(error.storage_error)[:200]
                log.warning("requests are counted in memory: Redis does not answer", error=reason)

    def _can_count(self) -> bool:
        """Whether Redis takes a count: one that is full or loading answers a ping, but does not."""
        assert self._shared is not None
        try:
            self._shared.storage.incr("probe", PROBE_KEEPS_SECONDS)
        except StorageError:
            return False
        return True

    def _stop_watching(self) -> None:
        if self._watch is not None:
            self._watch.close()
            self._watch = None


def _redis_pool(url: str) -> ConnectionPool:
    """Return connections with little patience and no second attempt."""
    return ConnectionPool.from_url(
        url.replace("redis+socket://", "unix://", 1),
        socket_timeout=TIMEOUT_SECONDS,
        socket_connect_timeout=TIMEOUT_SECONDS,
        retry=Retry(NoBackoff(), 0),
    )


def _shared_counts(pool: ConnectionPool, prefix: str) -> MovingWindowRateLimiter:
    storage = RedisStorage(
        "redis://", connection_pool=pool, key_prefix=prefix, wrap_exceptions=True
    )
    return MovingWindowRateLimiter(storage)


def _wait(counts: MovingWindowRateLimiter, rate: RateLimitItem, name: str) -> int:
    """Whole seconds until the oldest of the counted leaves the window, at least 1."""
    return max(1, math.ceil(counts.get_window_stats(rate, name).reset_time - time.time()))
