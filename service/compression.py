"""Answers compressed by gzip for clients that take it."""

from functools import partial

from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.gzip import (
    DEFAULT_EXCLUDED_CONTENT_TYPES,
    GZipResponder,
    IdentityResponder,
)
from starlette.types import ASGIApp, Message, Receive, Scope, Send

SMALLEST = 1024
"""Answers below so many bytes are not compressed."""

LEVEL = 6
"""Level 9 makes the list of models no smaller and takes seven times as long (decision 24)."""

UNCOMPRESSED = (*DEFAULT_EXCLUDED_CONTENT_TYPES, "image/*", "model/*", "application/octet-stream")
"""Pictures and events, and meshes and numbers at vertices: these take long for little gain."""


class Compression:
    """Middleware that compresses answers of 1 kB and more.

    An ETag names bytes. So a compressed answer has the weak form of its ETag, which names the
    content. Clients may send either form back.

    Parameters
    ----------
    app : ASGIApp
        Whose answers are compressed.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, compressed if the client takes it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        accepted = accepts_gzip(Headers(scope=scope).get("accept-encoding", ""))
        responder = (
            GZipResponder(self._app, SMALLEST, LEVEL, exclude_content_types=UNCOMPRESSED)
            if accepted
            else IdentityResponder(self._app, SMALLEST, exclude_content_types=UNCOMPRESSED)
        )  # the latter tells caches by Vary that other clients get other bytes
        await responder(scope, receive, partial(_send, responder, send))


def accepts_gzip(header: str) -> bool:
    """Whether an Accept-Encoding has gzip, or else what it does not name, at a weight above 0."""
    weights = {}
    for entry in header.lower().split(","):
        coding, *parameters = (part.strip() for part in entry.split(";"))
        weights[coding] = all(_weight(parameter) > 0.0 for parameter in parameters)
    return weights.get("gzip", weights.get("*", False))


async def _send(responder: IdentityResponder, send: Send, message: Message) -> None:
    """Send a message; the ETag becomes weak if the answer was compressed here."""
    if message["type"] == "http.response.start":
        headers = MutableHeaders(scope=message)
        tag = headers.get("etag", "")
        compressed = "content-encoding" in headers and not responder.content_encoding_set
        if compressed and tag.startswith('"'):
            headers["ETag"] = f"W/{tag}"
        if "vary" in headers:  # the application may have named Accept-Encoding too
            headers["Vary"] = ", ".join(dict.fromkeys(headers["vary"].split(", ")))
    await send(message)


def _weight(parameter: str) -> float:
    name, _, value = parameter.partition("=")
    try:
        return float(value) if name.strip() == "q" else 1.0
    except ValueError:
        return 0.0
