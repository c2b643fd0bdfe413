"""Counts of requests: shared by a fleet in Redis, in memory while that is away."""

import socket
import time
import uuid
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
import redis
import structlog
from limits import parse

from service.app import create_app
from service.rates import RateCounts, open_counts
from service.security import Gate
from service.supervisor.api import api_config
from tests.servers import redis_server, valkey_server
from tests.service.running import TestClient, make_settings
from workers.settings import Settings
from workers.storage.migrate import migrate

RATE = parse("3/hour")
LOST = "requests are counted in memory: Redis does not answer"
BACK = "requests are counted in Redis again"


@pytest.fixture
def shared(tmp_path: Path) -> Iterator[Settings]:
    """Settings of a fleet whose key space in the real Redis is its own."""
    prefix = f"proteus-test-{uuid.uuid4().hex}"
    with redis_server() as url:
        yield Settings(data_dir=tmp_path, broker_url=url, queue_prefix=prefix)
        with redis.Redis.from_url(url) as client:
            keys = list(client.scan_iter(f"{prefix}*"))
            assert all(client.ttl(key) > 0 for key in keys)  # nothing stays for ever
            if keys:
                client.delete(*keys)


def test_a_count_is_its_names_own_and_says_when_the_window_ends() -> None:
    with closing(RateCounts()) as counts:
        assert [counts.take(RATE, "a") for _ in range(3)] == [0, 0, 0]
        assert 3590 < counts.take(RATE, "a") <= 3600
        assert 3590 < counts.look(RATE, "a") <= 3600
        assert [counts.look(RATE, "b") for _ in range(5)] == [0] * 5
        assert not counts.may_wait


@pytest.mark.server
def test_two_processes_of_a_fleet_count_together(shared: Settings) -> None:
    with closing(open_counts(shared)) as one, closing(open_counts(shared)) as other:
        assert one.may_wait
        assert [counts.take(RATE, "a") for counts in (one, other, one)] == [0, 0, 0]
        assert 3590 < other.take(RATE, "a") <= 3600
        assert 3590 < one.look(RATE, "a") <= 3600


@pytest.mark.server
def test_a_secret_is_guessed_against_the_whole_fleet(shared: Settings) -> None:
    settings = shared.model_copy(
        update={"api_keys": f"a:{'0' * 64}:read", "key_attempts": "2/hour"}
    )
    with closing(Gate(settings)) as one, closing(Gate(settings)) as other:
        for gate in (one, other):
            with pytest.raises(Exception, match="not valid"):
                gate.admit("proteus_a_wrong", "read", address="192.0.2.1")
        for gate in (one, other):
            with pytest.raises(Exception, match="at most 2 per 1 hour wrong keys"):
                gate.admit("proteus_a_wrong", "read", address="192.0.2.1")


@pytest.mark.server
def test_another_fleet_in_the_same_redis_counts_for_itself(shared: Settings) -> None:
    second = shared.model_copy(update={"queue_prefix": f"{shared.queue_prefix}-b"})
    with closing(open_counts(shared)) as one, closing(open_counts(second)) as other:
        assert [one.take(RATE, "a") for _ in range(3)] == [0, 0, 0]
        assert other.take(RATE, "a") == 0


def test_the_bundled_broker_has_one_api_which_counts_in_memory(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    resolved = Settings(data_dir=tmp_path, broker_url=settings.resolved_broker_url)  # as `serve`
    with closing(open_counts(settings)) as one, closing(open_counts(resolved)) as other:
        assert not one.may_wait
        assert not other.may_wait


def test_without_redis_requests_are_counted_in_memory_and_that_is_said_once() -> None:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        url = f"redis://127.0.0.1:{probe.getsockname()[1]}/0"  # bound, but nobody listens
        with closing(RateCounts(url)) as counts, structlog.testing.capture_logs() as logs:
            assert [counts.take(RATE, "a") for _ in range(3)] == [0, 0, 0]
            assert counts.take(RATE, "a") > 3590
    assert [entry["event"] for entry in logs] == [LOST]


def test_a_redis_that_hangs_delays_one_request_by_a_moment_and_no_other() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"redis://127.0.0.1:{silent.getsockname()[1]}/0"
        with closing(RateCounts(url)) as counts:
            seconds = []
            for number in range(20):
                started = time.perf_counter()
                assert counts.take(RATE, f"client {number}") == 0
                seconds.append(time.perf_counter() - started)
    assert seconds[0] < 5  # the time limit is 0.2 s; this machine may be busy
    assert sum(seconds[1:]) < 19 * 0.2  # had each waited, it were more


@pytest.mark.server
def test_counting_goes_back_to_redis_when_that_is_back(tmp_path: Path) -> None:
    with valkey_server(tmp_path) as url:
        counts = RateCounts(url)
        assert counts.take(RATE, "a") == 0
    with closing(counts), structlog.testing.capture_logs() as logs:
        assert counts.take(RATE, "a") == 0
        with valkey_server(tmp_path):
            until = time.monotonic() + 30
            while BACK not in [entry["event"] for entry in logs] and time.monotonic() < until:
                counts.look(RATE, "a")
                time.sleep(0.02)
            with closing(RateCounts(url)) as other:
                assert [counts.take(RATE, "a") for _ in range(3)] == [0, 0, 0]
                assert other.take(RATE, "a") > 0
    assert [entry["event"] for entry in logs] == [LOST, BACK]


@pytest.mark.parametrize(("proxies", "second"), [("", 429), ("10.0.0.9", 429), ("10.0.0.1", 200)])
def test_a_forwarded_address_is_believed_of_a_named_proxy_only(
    tmp_path: Path, proxies: str, second: int
) -> None:
    settings = make_settings(tmp_path, rate_limit="1/hour", trusted_proxies=proxies)
    migrate(settings)
    config = api_config(settings)
    config.app = lambda: create_app(settings)
    config.load()
    statuses = []
    with TestClient(config.loaded_app, client=("10.0.0.1", 5000)) as client:
        for address in ("192.0.2.1", "192.0.2.2", "192.0.2.2"):
            answer = client.get("/v1/jobs", headers={"X-Forwarded-For": address})
            statuses.append(answer.status_code)
    assert statuses == [200, second, 429]
