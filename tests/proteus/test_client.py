"""The HTTP client that the command line and the benchmarks ask with."""

import pytest

from proteus.client import Client
from tests.proteus.fake_service import FakeService


@pytest.mark.parametrize(
    ("path", "params", "asked"),
    [
        ("/v1/collections?limit=7", None, b"limit=7"),
        ("/v1/collections", {"limit": 7, "cursor": None}, b"limit=7"),
        ("/v1/collections", None, b""),
    ],
)
def test_a_path_keeps_what_it_asks(
    fake: FakeService, path: str, params: dict[str, object] | None, asked: bytes
) -> None:
    with Client("http://service.test", transport=fake.transport()) as client:
        client.request("GET", path, params=params)
    assert fake.requests[-1].url.query == asked
