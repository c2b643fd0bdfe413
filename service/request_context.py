"""What surrounds every request: its id, its log line, its figures, and the last resort."""

import re
import time
import uuid

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import problem_response
from service.metrics import Metrics

log = structlog.get_logger("service.requests")

REQUEST_ID = re.compile(r"[A-Za-z0-9._-]{1,128}")
QUIET = frozenset({"/healthz", "/readyz", "/metrics"})


class RequestContext:
    """Outermost middleware.

    A request's id is the client's X-Request-ID, if that is a usable one, else new; it is in
    the answer, in every log line below, and in problems. An exception that nobody expected
    becomes a problem without a traceback, which goes to the log.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, whatever happens."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get("x-request-id", "")
        request_id = given if REQUEST_ID.fullmatch(given) else uuid.uuid4().hex
        scope.setdefault("state", {})["request_id"] = request_id
        exchange = _Exchange(send, request_id)
        started = time.perf_counter()
        with structlog.contextvars.bound_contextvars(request_id=request_id):
            try:
                await self._app(scope, receive, exchange.send)
            except ClientDisconnect:
                log.info("client left", method=scope["method"], path=scope["path"])
                exchange.status = exchange.status or 499
            except Exception:  # the border of the request
                log.exception("request failed", method=scope["method"], path=scope["path"])
                await self._apologise(scope, receive, exchange)
            self._record(scope, exchange.status, time.perf_counter() - started)

    async def _apologise(self, scope: Scope, receive: Receive, exchange: "_Exchange") -> None:
        if exchange.status:
            return
        response = problem_response(
            scope,
            status=500,
            kind="internal-error",
            detail="something went wrong here; the log has the reason under this request_id",
        )
        await response(scope, receive, exchange.send)

    def _record(self, scope: Scope, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "unmatched")
        self._metrics.count_request(scope["method"], route, status, seconds)
        looked = scope["method"] in {"GET", "HEAD"} and status < 400
        tell = log.debug if looked or scope["path"] in QUIET else log.info
        tell(
            "request",
            method=scope["method"],
            path=scope["path"],
            status=status,
            milliseconds=round(1000 * seconds, 1),
        )


class _Exchange:
    """Notes the status of an answer and adds headers to it."""

    def __init__(self, send: Send, request_id: str) -> None:
        self._send = send
        self._request_id = request_id
        self.status = 0

    async def send(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self.status = message["status"]
            headers = MutableHeaders(scope=message)
            headers["X-Request-ID"] = self._request_id
            headers["X-Content-Type-Options"] = "nosniff"
        await self._send(message)
