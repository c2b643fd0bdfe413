"""Domain errors become RFC 9457 problems; here alone stands which status each has."""

import json
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any
from urllib.parse import quote

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import BaseRoute, Match, Mount
from starlette.types import Scope

from workers import errors

log = structlog.get_logger(__name__)

PROBLEM_TYPE = "application/problem+json"
RETRY_SECONDS = 2
METHODS = ("DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT")
STATUS: Mapping[type[errors.ProteusError], int] = {
    errors.InvalidMeshError: 422,
    errors.UnsupportedFormatError: 415,
    errors.UploadTooLargeError: 413,
    errors.InvalidRequestError: 422,
    errors.KernelDomainError: 422,
    errors.SpectrumError: 422,
    errors.TimeLimitError: 422,
    errors.NotFoundError: 404,
    errors.ConflictError: 409,
    errors.ProteusError: 500,
}
BY_STATUS: Mapping[int, str] = {
    404: "not-found",
    405: "method-not-allowed",
    413: "upload-too-large",
    415: "unsupported-media-type",
}
WORK_STATUS: Mapping[str, int] = {
    **{cls("").kind: status for cls, status in STATUS.items()},
    "cancelled": 409,
}


class RefusedError(errors.ProteusError):
    """A problem that only the HTTP door knows, such as a key that is missing."""

    def __init__(
        self, kind: str, status: int, detail: str, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(detail)
        self._kind = kind
        self.status = status
        self.headers = dict(headers or {})

    @property
    def kind(self) -> str:
        """The kind it was made with."""
        return self._kind


def status_of(error: errors.ProteusError) -> int:
    """HTTP status of a domain error, by its narrowest known class."""
    if isinstance(error, RefusedError):
        return error.status
    if isinstance(error, errors.FailedWorkError):
        return WORK_STATUS.get(error.kind, 500)
    return next(STATUS[cls] for cls in type(error).__mro__ if cls in STATUS)


def problem_response(
    scope: Scope, *, status: int, kind: str, detail: str, headers: Mapping[str, str] | None = None
) -> Response:
    """Make an answer of type `application/problem+json`."""
    body = {
        "type": f"/problems/{kind}",
        "title": kind.replace("-", " ").capitalize(),
        "status": status,
        "detail": detail[:2000],
        "instance": quote(scope.get("path", "/"), errors="replace")[:500],
        "request_id": scope.get("state", {}).get("request_id", ""),
    }
    content = json.dumps(body)  # escapes all but ASCII, halves of surrogate pairs too
    return Response(content, status, dict(headers or {}), media_type=PROBLEM_TYPE)


def add_error_handlers(app: FastAPI) -> None:
    """Answer every kind of refusal with a problem."""
    app.add_exception_handler(errors.ProteusError, _answer_domain_error)
    app.add_exception_handler(RequestValidationError, _answer_validation_error)
    app.add_exception_handler(HTTPException, _answer_http_exception)
    for outage in (OperationalError, InterfaceError, PoolTimeoutError):
        app.add_exception_handler(outage, _answer_outage)


async def _answer_domain_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, errors.ProteusError)
    status = status_of(error)
    if status >= 500:
        log.error("unexpected domain error", kind=error.kind, detail=str(error))
    headers = error.headers if isinstance(error, RefusedError) else {}
    return problem_response(
        request.scope, status=status, kind=error.kind, detail=str(error), headers=headers
    )


async def _answer_http_exception(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    status = error.status_code
    if status < 400:
        return Response(status_code=status, headers=error.headers)
    phrase = HTTPStatus(status).phrase
    detail = error.detail
    if status == 400 and "parsing the body" in detail:  # nested too deep, a number too long
        status, detail = 422, "the body could not be read as JSON"
    if detail == phrase and status == 404:
        detail = f"there is nothing at {request.url.path[:200]}; see /docs"
    headers = dict(error.headers or {})
    if status == 405:
        headers = {"Allow": ", ".join(allowed_methods(request))}
        detail = f"{request.method} is not possible here, expected {headers['Allow']}"
    kind = "invalid-request" if status in {400, 422} else BY_STATUS.get(status, _slug(status))
    return problem_response(request.scope, status=status, kind=kind, detail=detail, headers=headers)


def allowed_methods(request: Request) -> list[str]:
    """Return the methods that some route answers at a request's path.

    The framework names those of one route alone, and a path may have a route for each method.
    """
    routes = request.app.router.routes
    root = request.scope.get("app_root_path", request.scope.get("root_path", ""))
    scope = {**request.scope, "root_path": root}  # a mount has made its own of it
    if any(isinstance(route, Mount) and _answers(route, scope) for route in routes):
        return ["GET", "HEAD"]  # what is mounted are files
    scopes = {method: {**scope, "method": method} for method in METHODS}
    return [
        method for method in METHODS if any(_answers(route, scopes[method]) for route in routes)
    ]


def _answers(route: BaseRoute, scope: Scope) -> bool:
    return route.matches(scope)[0] is Match.FULL


async def _answer_validation_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    found = error.errors()
    given = request.headers.get("content-type", "")
    of_body = any(tuple(e["loc"]) == ("body",) and isinstance(e["input"], bytes) for e in found)
    if of_body and "json" not in given:
        detail = f"the body is {given[:100] or 'of no declared type'}, expected application/json"
        return problem_response(
            request.scope, status=415, kind="unsupported-media-type", detail=detail
        )
    return problem_response(
        request.scope, status=422, kind="invalid-request", detail=explain_validation(found)
    )


async def _answer_outage(request: Request, error: Exception) -> Response:
    log.error("database unreachable", error=str(error)[:500])
    return problem_response(
        request.scope,
        status=503,
        kind="database-unavailable",
        detail="the database does not answer; try again in a moment",
        headers={"Retry-After": str(RETRY_SECONDS)},
    )


def explain_validation(found: Sequence[Any]) -> str:
    """Say in words what is wrong with a request: where, what was expected, what was found."""
    sentences = [_explain(error) for error in found[:5]]
    if len(found) > 5:
        sentences.append(f"and {len(found) - 5} more")
    return "; ".join(dict.fromkeys(sentences))


def _explain(error: Mapping[str, Any]) -> str:
    place = [str(part) for part in error["loc"]]
    if error["type"] == "json_invalid":
        reason = error.get("ctx", {}).get("error", "syntax error")
        return f"the body is no JSON: {reason} at character {place[-1]}"
    where = ".".join(place[1:]) or {"body": "the body"}.get(place[0], place[0])
    message = str(error["msg"]).removeprefix("Value error, ")
    message = message[0].lower() + message[1:]
    given = error.get("input")
    if isinstance(given, str | int | float | bool) and error["type"] != "missing":
        shown = repr(given)
        message += f", got {shown if len(shown) <= 60 else shown[:57] + '...'}"
    return f"{where[:200]}: {message}"


def _slug(status: int) -> str:
    return HTTPStatus(status).phrase.lower().replace(" ", "-")
