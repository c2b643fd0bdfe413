"""Answers compressed for clients that take it, and what must stay as it is."""

import asyncio
import gzip
from collections.abc import MutableMapping
from typing import Any

import pytest

from service.compression import SMALLEST, Compression
from tests.service.running import ZOO, Api

Message = MutableMapping[str, Any]
Events = list[tuple[str, bytes]]
GZIP = {"Accept-Encoding": "gzip"}
PLAIN = {"Accept-Encoding": "identity"}


def fetch(api: Api, path: str, headers: dict[str, str]) -> tuple[dict[str, str], bytes]:
    """Headers of an answer, and its bytes as they were sent."""
    with api.client.stream("GET", path, headers=headers) as answer:
        assert answer.status_code == 200
        raw = b"".join(answer.iter_raw())
    assert int(answer.headers["Content-Length"]) == len(raw)
    return dict(answer.headers), raw


@pytest.mark.parametrize("accepted", ["gzip", "br, gzip;q=0.5", "*", "GZIP"])
def test_a_long_answer_is_compressed_for_a_client_that_takes_it(zoo: Api, accepted: str) -> None:
    headers, raw = fetch(zoo, "/v1/models", {"Accept-Encoding": accepted})
    plain_headers, plain = fetch(zoo, "/v1/models", PLAIN)
    assert headers["content-encoding"] == "gzip"
    assert gzip.decompress(raw) == plain
    assert len(raw) < len(plain) / 3
    assert "content-encoding" not in plain_headers
    for found in (headers, plain_headers):
        assert found["vary"] == "Accept-Encoding"
        assert found["content-type"] == "application/json"


@pytest.mark.parametrize("refused", ["gzip;q=0", "br", "", "*;q=0", "identity"])
def test_no_answer_is_compressed_for_another_client(zoo: Api, refused: str) -> None:
    headers, raw = fetch(zoo, "/v1/models", {"Accept-Encoding": refused})
    assert "content-encoding" not in headers
    assert raw.startswith(b"{")


def test_a_short_answer_is_not_compressed(zoo: Api) -> None:
    headers, raw = fetch(zoo, "/v1/collections/zoo", GZIP)
    assert len(raw) < SMALLEST
    assert "content-encoding" not in headers


@pytest.mark.parametrize("name", ["mesh", "mesh?format=glb", "signature", "thumbnail.png"])
def test_meshes_pictures_and_numbers_keep_their_bytes_and_strong_tags(zoo: Api, name: str) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[ZOO[0]]}/{name}"
    headers, raw = fetch(zoo, path, GZIP)
    assert "content-encoding" not in headers
    assert len(raw) > 500
    assert headers["etag"].startswith('"')
    assert raw == fetch(zoo, path, PLAIN)[1]
    again = zoo.client.get(path, headers={"If-None-Match": headers["etag"], **GZIP})
    assert (again.status_code, again.content) == (304, b"")


def test_the_tag_of_a_compressed_job_is_weak_and_is_known_again(zoo: Api) -> None:
    files = {f"{number}{'x' * 150}.off": b"no mesh %d" % number for number in range(8)}
    job = zoo.upload("zoo", files)["job"]
    zoo.work()
    path = f"/v1/jobs/{job['id']}"
    headers, raw = fetch(zoo, path, GZIP)
    plain_headers, plain = fetch(zoo, path, PLAIN)
    assert gzip.decompress(raw) == plain
    strong = plain_headers["etag"]
    assert headers["etag"] == f"W/{strong}"
    for tag in (strong, f"W/{strong}", f'"other", W/{strong}', "*"):
        for encoding in (GZIP, PLAIN):
            again = zoo.client.get(path, headers={"If-None-Match": tag, **encoding})
            assert (again.status_code, again.content) == (304, b"")
    assert zoo.client.get(path, headers={"If-None-Match": '"other"', **GZIP}).status_code == 200


def test_files_that_are_compressed_already_keep_their_tags(zoo: Api) -> None:
    answer = zoo.client.get("/", headers=GZIP)
    assert answer.headers["Content-Encoding"] == "gzip"
    assert answer.headers["ETag"].endswith('.gz"')
    assert not answer.headers["ETag"].startswith("W/")


def test_events_of_a_job_are_sent_as_they_are(zoo: Api) -> None:
    job = zoo.get("/v1/jobs")["items"][0]
    with zoo.client.stream("GET", f"/v1/jobs/{job['id']}/events", headers=GZIP) as answer:
        assert "Content-Encoding" not in answer.headers
        raw = b"".join(answer.iter_raw())
    assert b"event: job" in raw


@pytest.mark.parametrize("accepted", ["gzip", "identity"])
def test_each_event_leaves_before_the_next_is_made(accepted: str) -> None:
    order: Events = []

    async def send_events(scope: Any, receive: Any, send: Any) -> None:
        kind = [(b"content-type", b"text/event-stream; charset=utf-8")]
        await send({"type": "http.response.start", "status": 200, "headers": kind})
        for number in range(3):
            event = b"data: %d %s\n\n" % (number, b"x" * SMALLEST)
            order.append(("made", event))
            await send({"type": "http.response.body", "body": event, "more_body": True})
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    async def receive() -> Message:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: Message) -> None:
        if message.get("body"):
            order.append(("sent", message["body"]))

    headers = [(b"accept-encoding", accepted.encode())]
    scope = {"type": "http", "method": "GET", "path": "/", "headers": headers}
    asyncio.run(Compression(send_events)(scope, receive, send))
    assert [step for step, _ in order] == ["made", "sent"] * 3
    assert [event for step, event in order if step == "made"] == [
        event for step, event in order if step == "sent"
    ]
