"""Health, figures, request ids."""

import os
import re
import shutil
import time
from collections.abc import Callable

import pytest
import structlog
from prometheus_client.parser import text_string_to_metric_families

from service.readiness import BrokerWatch
from tests.service.running import ZOO, Api


def figures(api: Api) -> dict[str, float]:
    """Samples of /metrics by their names and labels."""
    text = api.get("/metrics").decode()
    return {
        f"{sample.name}{sorted(sample.labels.items())}": sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_a_service_with_a_broker_is_ready(api: Api) -> None:
    assert api.get("/healthz") == {"status": "ok"}
    assert api.get("/readyz") == {"status": "ok", "database": "ok", "index": "ok", "broker": "ok"}


def test_trouble_with_the_broker_degrades_and_with_the_database_stops(
    api: Api, monkeypatch: pytest.MonkeyPatch
) -> None:
    api.services.dispatcher.alive = False  # type: ignore[attr-defined]
    found = api.get("/readyz")
    assert (found["status"], found["broker"], found["database"]) == ("degraded", "down", "ok")
    api.services.database.dispose()
    for path in api.settings.data_path.glob("proteus.sqlite3*"):
        path.unlink()
    answer = api.client.get("/readyz")
    assert answer.status_code == 503
    assert answer.json() == {
        "status": "down",
        "database": "down",
        "index": "down",
        "broker": "down",
    }
    assert api.get("/healthz") == {"status": "ok"}
    api.get("/v1/collections", 503)
    assert api.get("/metrics")


def test_a_broker_that_says_nothing_holds_nobody_up() -> None:
    asked = 0

    def slow() -> bool:
        nonlocal asked
        asked += 1
        time.sleep(1.0)
        return True

    watch = BrokerWatch(slow)
    assert not watch.alive()
    assert not watch.alive()
    assert asked == 1  # one question at a time
    time.sleep(0.5)
    assert watch.alive()
    watch.close()


def test_a_request_keeps_the_id_that_it_brings(api: Api) -> None:
    given = {"X-Request-ID": "trace-17.a_b"}
    assert api.client.get("/healthz", headers=given).headers["X-Request-ID"] == "trace-17.a_b"
    problem = api.client.get("/nope", headers=given).json()
    assert problem["request_id"] == "trace-17.a_b"
    for bad in ("", "a b", "x" * 129, "a\tb", "é"):
        made = api.client.get("/healthz", headers={"X-Request-ID": bad.encode()})
        assert re.fullmatch(r"[0-9a-f]{32}", made.headers["X-Request-ID"])


def test_the_log_has_one_line_a_request_with_its_id(api: Api) -> None:
    with structlog.testing.capture_logs([structlog.contextvars.merge_contextvars]) as lines:
        api.client.get("/v1/models", headers={"X-Request-ID": "abc"})
    requests = [line for line in lines if line["event"] == "request"]
    assert len(requests) == 1
    assert (requests[0]["request_id"], requests[0]["status"]) == ("abc", 200)
    assert (requests[0]["method"], requests[0]["path"]) == ("GET", "/v1/models")


def test_figures_count_requests_by_route_and_not_by_path(zoo: Api) -> None:
    zoo.get(f"/v1/shapes/{zoo.shape_ids[ZOO[0]]}")
    zoo.get(f"/v1/shapes/{zoo.shape_ids[ZOO[1]]}")
    zoo.get("/nope", 404)
    zoo.client.request("BREW", "/coffee")
    zoo.ask("zoo", shape_id=zoo.shape_ids[ZOO[0]])
    zoo.upload("zoo", {"a.off": b"x"})
    found = figures(zoo)

    def requests(method: str, route: str, status: int) -> float | None:
        labels = [("method", method), ("route", route), ("status", str(status))]
        return found.get(f"proteus_http_requests_total{labels}")

    assert requests("GET", "/v1/shapes/{shape_id}", 200) == 2
    assert requests("GET", "unmatched", 404) == 1
    assert requests("other", "unmatched", 404) == 1
    assert found["proteus_shapes[]"] == 6
    assert found["proteus_jobs[('kind', 'ingest'), ('state', 'queued')]"] == 1
    assert found["proteus_parts[('queue', 'ingest'), ('state', 'queued')]"] == 1
    rows = [value for name, value in found.items() if name.startswith("proteus_index_rows")]
    assert rows == [5]


def test_two_applications_count_apart(start: Callable[..., Api]) -> None:
    first, second = start("a"), start("b")
    first.get("/v1/models")
    assert not [name for name in figures(second) if "/v1/models" in name]


def test_what_a_crash_left_behind_is_removed_at_the_next_start(start: Callable[..., Api]) -> None:
    first = start("a")
    data = first.settings.data_path
    old, young = data / "uploads" / "old", data / "uploads" / "young"
    for folder in (old, young):
        folder.mkdir(parents=True)
        (folder / "000000").write_bytes(b"x")
    (data / "cache").mkdir()
    (data / "cache" / "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c.00.index").write_bytes(b"x")
    os.utime(old, (0, 0))
    shutil.rmtree(data / "blobs")
    start("a")
    assert young.exists()
    assert not old.exists()
    assert not list((data / "cache").iterdir())
