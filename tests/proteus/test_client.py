"""The HTTP client, in front of the real application."""

from pathlib import Path

import httpx
import pytest

from proteus import Client, JobWatch, ServiceError, UnreachableError
from tests.proteus.real_service import Fault, RealService
from tests.service.running import zoo_files


class Unreachable(httpx.HTTPTransport):
    """The network, which fails for the first requests."""

    def __init__(self, failures: int) -> None:
        super().__init__()
        self.failures = failures

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        if self.failures:
            self.failures -= 1
            raise httpx.ConnectError("refused")
        return super().handle_request(request)


@pytest.mark.parametrize(
    ("path", "params", "query"),
    [
        ("/v1/collections?limit=7", None, "limit=7"),
        ("/v1/collections", {"limit": 7, "cursor": None}, "limit=7"),
        ("/v1/collections", None, ""),
    ],
)
def test_a_path_keeps_its_own_query(
    service: RealService, path: str, params: dict[str, object] | None, query: str
) -> None:
    with service.client() as client:
        client.request("GET", path, params=params)
    assert service.requests[-1].query == query


def test_patient_client_outlasts_a_restart(service: RealService) -> None:
    service.faults.extend([Fault(), Fault(503), Fault(429, headers={"Retry-After": "0.1"})])
    with Client(service.url, patience_seconds=60, transport=Unreachable(1)) as client:
        assert client.get("/healthz")["status"] == "ok"
    assert len(service.requests) == 4


def test_impatient_client_gives_up_at_once(service: RealService) -> None:
    with Client(service.url, transport=Unreachable(1)) as client:
        with pytest.raises(UnreachableError, match="refused"):
            client.get("/healthz")
        assert client.get("/healthz")["status"] == "ok"


def test_client_does_not_wait_beyond_its_patience(service: RealService) -> None:
    service.faults.append(Fault(429, headers={"Retry-After": "3600"}))
    with (
        Client(service.url, patience_seconds=5) as client,
        pytest.raises(ServiceError) as refusal,
    ):
        client.get("/healthz")
    assert refusal.value.status == 429


def test_patient_client_does_not_repeat_a_refusal(service: RealService) -> None:
    with service.client() as client, pytest.raises(ServiceError) as refusal:
        client.get("/v1/collections/nowhere")
    assert refusal.value.status == 404
    assert "nowhere" in str(refusal.value)
    assert refusal.value.problem["type"] == "/problems/collection-not-found"
    assert len(service.requests) == 1


def test_pages_are_followed_and_stop_at_the_limit(service: RealService) -> None:
    names = sorted(zoo_files())
    with service.client() as client:
        paged = [s["name"] for s in client.pages("/v1/collections/zoo/shapes?limit=2")]
        assert [*client.pages("/v1/collections/zoo/shapes", limit=0)] == []
        some = [s["name"] for s in client.pages("/v1/collections/zoo/shapes", limit=2)]
        labelled = [s["name"] for s in client.pages("/v1/collections/zoo/shapes", label="ball")]
    assert sorted(paged) == names
    assert some == paged[:2]
    assert sorted(labelled) == ["ball.null.0.off", "ball.scale.2.off"]


def test_a_job_is_followed_and_an_unchanged_one_costs_no_body(
    service: RealService, tmp_path: Path
) -> None:
    with service.client() as client:
        client.post("/v1/collections", {"name": "followed"})
        files = [("files", ("crate.stl", zoo_files()["crate.stl"]))]
        with service.idle():
            answer = client.request("POST", "/v1/collections/followed/shapes", files=files)
            watch = JobWatch(client, answer.json()["job"])
            first = watch.poll()
            assert first["state"] == "queued"
            assert watch.poll() is first  # 304: it has not changed
            assert service.requests[-1].headers["if-none-match"]
        states = [job["state"] for job in watch.changes()]
    assert states[-1] == "succeeded"
    count = len(service.requests)
    watch.poll()
    assert len(service.requests) == count  # it has ended: nothing is asked
