"""How many bytes a request's body may have, whether it declares them or not."""

import asyncio
import contextlib
from collections.abc import Callable

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LINGER_BYTES = 32 << 20
"""So much of a refused body is read, and thrown away."""
LINGER_SECONDS = 10.0
"""So long at most."""


class BodyLimit:
    """Middleware that refuses a body beyond its limit with 413 as soon as that is known.

    When a request is refused before its body was read, some of the rest is read and thrown away.
    Otherwise the connection closes while the client still sends, and it never sees the answer.

    Parameters
    ----------
    app : ASGIApp
        What is limited.
    limit : callable
        From the path and content type to the most bytes.
    linger_bytes, linger_seconds : float
        How much of a refused body is read, and for how long.
    """

    def __init__(
        self,
        app: ASGIApp,
        limit: Callable[[str, str], int],
        *,
        linger_bytes: int = LINGER_BYTES,
        linger_seconds: float = LINGER_SECONDS,
    ) -> None:
        self._app = app
        self._limit = limit
        self._linger_bytes = linger_bytes
        self._linger_seconds = linger_seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, counting what it receives."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        limit = self._limit(scope["path"], headers.get("content-type", ""))
        body = _CountedBody(receive, limit, headers)

        async def send_after_body(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] >= 400:
                await body.drain(self._linger_bytes, self._linger_seconds)
            await send(message)

        await self._app(scope, body.receive, send_after_body)


class _CountedBody:
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

    async def drain(self, most_bytes: int, seconds: float) -> None:
        """Read on for a while, without keeping anything."""
        most = self._count + most_bytes
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
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
