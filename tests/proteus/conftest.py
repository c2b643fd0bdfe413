"""The command line and the client, against the real application on loopback."""

import logging
from collections.abc import Callable, Iterator

import pytest
import structlog
from typer.testing import CliRunner, Result

from proteus.cli.program import app
from proteus.client import Client
from proteus.jobs import JobWatch
from tests.proteus.real_service import RealService, real_service
from tests.service.running import zoo_files

Run = Callable[..., Result]
"""The command line: its arguments, and what came of them."""

MOST_BYTES = 300_000
"""Of one file; the zoo's have less."""


@pytest.fixture(autouse=True)
def _quiet() -> Iterator[None]:
    """No lines of the service among those of the command line, while a test runs."""
    usual = structlog.get_config()
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.CRITICAL))
    yield
    structlog.configure(**usual)


@pytest.fixture(scope="session")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealService]:
    """A service for all tests of this folder; the collection "zoo" is computed."""
    folder = tmp_path_factory.mktemp("service")
    with real_service(folder, max_upload_bytes=MOST_BYTES) as service:
        with service.client() as client:
            upload_files(client, "zoo", zoo_files())
        yield service


@pytest.fixture
def service(running: RealService) -> Iterator[RealService]:
    """The service, without requests or faults of another test."""
    running.requests.clear()
    yield running
    unmet = [*running.faults]
    running.faults.clear()
    assert unmet == [], "faults that no request met"


@pytest.fixture
def run(service: RealService, monkeypatch: pytest.MonkeyPatch) -> Run:
    """The command line, which talks to the service."""
    monkeypatch.setenv("PROTEUS_URL", service.url)
    monkeypatch.delenv("PROTEUS_KEY", raising=False)
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


def upload_files(client: Client, collection: str, files: dict[str, bytes]) -> None:
    """Make a collection of files, and wait until their shapes are computed."""
    client.post("/v1/collections", {"name": collection})
    parts = [("files", item) for item in files.items()]
    answer = client.request("POST", f"/v1/collections/{collection}/shapes", files=parts)
    assert [*JobWatch(client, answer.json()["job"]).changes()][-1]["state"] == "succeeded"
