"""The command line, against a service that answers from memory."""

from functools import partial

import pytest
from typer.testing import CliRunner

from proteus.cli.program import app
from proteus.client import Client
from tests.proteus.fake_service import FakeService, Run


@pytest.fixture
def fake() -> FakeService:
    """A service that answers the client from memory."""
    return FakeService()


@pytest.fixture
def run(fake: FakeService, monkeypatch: pytest.MonkeyPatch) -> Run:
    """The command line, which talks to it."""
    monkeypatch.delenv("PROTEUS_URL", raising=False)
    monkeypatch.setattr(
        "proteus.cli.connection.Client", partial(Client, transport=fake.transport())
    )
    monkeypatch.setattr("proteus.client.time.sleep", lambda seconds: None)
    return lambda *arguments: CliRunner().invoke(app, list(arguments))
