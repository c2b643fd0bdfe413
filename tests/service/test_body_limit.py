"""The body's limit at the level of ASGI, where one sees what was read."""

import asyncio
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from starlette.exceptions import HTTPException

from service.body_limit import BodyLimit

Message = MutableMapping[str, Any]
Application = Callable[[Any, Any, Any], Awaitable[None]]


async def read_all(scope: Any, receive: Any, send: Any) -> None:
    """An application that reads the body and says how long it is."""
    size, more = 0, True
    try:
        while more:
            message = await receive()
            size += len(message["body"])
            more = message["more_body"]
        status = 200
    except HTTPException as error:
        status = error.status_code
    await send({"type": "http.response.start", "status": status, "headers": []})
    await send({"type": "http.response.body", "body": b"%d" % size})


async def refuse(scope: Any, receive: Any, send: Any) -> None:
    """An application that refuses without a look at the body."""
    await send({"type": "http.response.start", "status": 404, "headers": []})
    await send({"type": "http.response.body", "body": b""})


def run(
    app: Application,
    chunks: list[bytes],
    *,
    limit: int,
    **headers: str,
) -> tuple[int, int]:
    """Status, and how many chunks were read by then."""
    queue: list[Message] = [
        {"type": "http.request", "body": chunk, "more_body": n < len(chunks) - 1}
        for n, chunk in enumerate(chunks)
    ]
    read = 0
    statuses: list[tuple[int, int]] = []

    async def receive() -> Message:
        nonlocal read
        if read == len(queue):
            await asyncio.sleep(3600)
        read += 1
        return queue[read - 1]

    async def send(message: Message) -> None:
        if message["type"] == "http.response.start":
            statuses.append((message["status"], read))

    given = [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()]
    scope = {"type": "http", "path": "/", "headers": given}
    limited = BodyLimit(
        app,
        lambda path, kind: limit,
        linger_bytes=40,
        linger_seconds=0.1,
    )
    asyncio.run(limited(scope, receive, send))
    return statuses[0]


def test_a_body_up_to_the_limit_passes_and_one_byte_more_does_not() -> None:
    assert run(read_all, [b"x" * 5, b"x" * 5], limit=10, transfer_encoding="chunked") == (200, 2)
    status, _ = run(read_all, [b"x" * 5, b"x" * 6], limit=10, transfer_encoding="chunked")
    assert status == 413


def test_a_body_that_declares_too_much_is_refused_before_it_is_read() -> None:
    status, _ = run(read_all, [b"x" * 11], limit=10, content_length="11")
    assert status == 413
    expecting = {"content_length": "11", "expect": "100-continue"}
    assert run(read_all, [b"x" * 11], limit=10, **expecting) == (413, 0)


def test_a_false_length_does_not_help() -> None:
    for length in ("1", "-1", "x", "9" * 30, "+5"):
        body = [b"x" * 6, b"x" * 6]
        status, _ = run(read_all, body, limit=10, content_length=length)
        assert status == 413 or length == "9" * 30


def test_the_rest_of_a_refused_body_is_read_away_so_that_the_answer_is_seen() -> None:
    assert run(refuse, [b"x" * 10] * 3, limit=100, content_length="30") == (404, 3)
    assert run(refuse, [b"x" * 10] * 30, limit=10, content_length="300") == (404, 4)
    # a client that stops sending holds up nothing
    assert run(refuse, [b"x"], limit=10, content_length="2") == (404, 1)
