"""How many bytes a request's body may have, whether it declares them or not."""

import asyncio
import contextlib
from collections.abc import Callable

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LINGER_BYTES = 32 << 20
LINGER_SECONDS = 10.0


class BodyLimit:
    """Middleware that refuses a body beyond its limit with 413 as soon as that is known.

    A request that is refused before its body was read has some of the rest read and thrown
    away: a client that is still sending when the connection closes never sees the answer.

    Parameters
    ----------
    app : ASGIApp
        What is limited.
    limit : callable
        From the path and content type to the most bytes.
    """

    def __init__(self, app: ASGIApp, limit: Callable[[str, str], int]) -> None:
        self._app = app
        self._limit = limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, counting what it receives."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        limit = self._limit(scope["path"], headers.get("content-type", ""))
        body = _Body(receive, limit, headers)

        async def send_after_body(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] >= 400:
                await body.drain()
            await send(message)

        await self._app(scope, body.receive, send_after_body)


class _Body:
    def __init__(self, receive: Receive, limit: int, headers: Headers) -> None:
        self._receive = receive
        self._limit = limit
        self._count = 0
        declared = headers.get("content-length", "")
        self._declared = int(declared) if declared.isdecimal() and len(declared) < 20 else 0
        has_body = self._declared > 0 or "chunked" in headers.get("transfer-encoding", "")
        awaits_leave = "100-continue" in headers.get("expect", "").lower()
        self._more = has_body
        self._may_drain = not awaits_leave

    async def receive(self) -> Message:
        if self._declared > self._limit:
            raise self._too_large()
        message = await self._receive()
        self._note(message)
        if self._count > self._limit:
            raise self._too_large()
        return message

    async def drain(self) -> None:
        """Read on for a while, without keeping anything."""
        most = self._count + LINGER_BYTES
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(LINGER_SECONDS):
                while self._more and self._may_drain and self._count < most:
                    self._note(await self._receive())

    def _note(self, message: Message) -> None:
        if message["type"] == "http.request":
            self._count += len(message.get("body", b""))
            self._more = message.get("more_body", False)
        else:
            self._more = False
        self._may_drain = True

    def _too_large(self) -> HTTPException:
        return HTTPException(413, f"the request's body may have at most {self._limit} bytes")
