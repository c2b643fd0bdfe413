"""The OpenAPI document: what every operation may answer, with examples."""

from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel

from service.errors import PROBLEM_TYPE
from service.schemas.problems import Problem
from service.schemas.queries import QueryOptions
from service.schemas.text import Answer, Body

ALWAYS = (401, 403, 429, 500, 503)
Responses = dict[int | str, dict[str, Any]]
EXAMPLES = {
    401: ("unauthorized", "a key is needed: Authorization: Bearer proteus_<id>_<secret>"),
    403: ("forbidden", "this needs the scope 'write', the key 'web' has read"),
    404: ("collection-not-found", "there is no collection named 'zoo'"),
    409: ("conflict", "the job has succeeded already, so it cannot be cancelled"),
    413: ("upload-too-large", "the file 'cat.off' has more than 268435456 bytes"),
    415: ("unsupported-media-type", "the body is text/plain, expected application/json"),
    422: ("invalid-request", "limit: input should be less than or equal to 1000, got 5000"),
    429: ("too-many-requests", "at most 600 per 1 minute are allowed; try again in 7 s"),
    500: ("internal-error", "something went wrong here; the log has the reason"),
    503: ("database-unavailable", "the database does not answer; try again in a moment"),
}
RETRY_AFTER = {
    "description": "seconds until it is worth asking again",
    "schema": {"type": "integer"},
}
LOCATION = {"description": "where the answer can be fetched again", "schema": {"type": "string"}}
REFERENCE = "#/components/schemas/{model}"
NO_HEADERS: dict[str, Any] = {}
ETAG = {"description": "what If-None-Match takes", "schema": {"type": "string"}}
TAGS = [
    {"name": "collections", "description": "Named sets of shapes, each searched under one model."},
    {"name": "shapes", "description": "Meshes, what was computed of them, and their uploads."},
    {"name": "search", "description": "Which shapes are most like a mesh or a stored shape."},
    {"name": "models", "description": "How shapes are described and compared."},
    {"name": "evaluations", "description": "How well models find shapes again: Table 1."},
    {"name": "jobs", "description": "Long work: progress, errors, cancelling, retrying."},
    {"name": "service", "description": "Health and figures of the service itself."},
]
DESCRIPTION = """
Finds a 3D shape again after it has changed: another pose, another scale, noise, holes, a
coarser mesh. Upload meshes into a *collection*; each is cleaned, its Laplace-Beltrami spectrum is
computed, and a *model* turns the spectrum into a descriptor. Then ask with a mesh or a stored
shape.

Work that takes longer than a moment answers `202` with a *job*; `?wait=SECONDS` (0 to 60) holds
on for it, and the answer is `200` or `201` if it ended in time. Uploads are idempotent by
content: the same bytes in the same collection are the same shape. Errors are
`application/problem+json` (RFC 9457). Lists are paged by `limit` and `cursor`.
"""


def problems(*statuses: int) -> Responses:
    """Responses of an operation that may refuse with these statuses, besides the common ones."""
    return {status: _problem(status) for status in sorted({*statuses, *ALWAYS})}


def job_answers(
    *,
    ended: int | tuple[int, ...] = 200,
    accepted: type[BaseModel],
    result: type[BaseModel],
    headers: dict[str, Any] = NO_HEADERS,
) -> Responses:
    """Responses of an operation that makes a job: 202, or ``ended`` once it has."""
    statuses = ended if isinstance(ended, tuple) else (ended,)
    answers: Responses = {
        202: {
            "model": accepted,
            "description": "the job goes on; ask for it, or for its events",
            "headers": {"Retry-After": RETRY_AFTER, **headers},
        }
    }
    for status in statuses:
        answers[status] = {"model": result, "description": "the job has ended"}
        if headers:
            answers[status]["headers"] = headers
    return answers


def content(*types: str, description: str, etag: bool = True) -> dict[str, Any]:
    """Response whose body is bytes."""
    schema = {"type": "string", "format": "binary"}
    headers = {"ETag": ETAG} if etag else {}
    return {
        "description": description,
        "content": {kind: {"schema": schema} for kind in types},
        "headers": headers,
    }


def form_fields(body: type[BaseModel]) -> dict[str, Any]:
    """Return the fields of a body as parts of a form, where what is left out stands for null."""
    fields: dict[str, Any] = body.model_json_schema(ref_template=REFERENCE)["properties"]
    return {name: _without_null(schema) for name, schema in sorted(fields.items())}


def _without_null(schema: dict[str, Any]) -> dict[str, Any]:
    options = [option for option in schema.get("anyOf", []) if option != {"type": "null"}]
    rest = {key: value for key, value in schema.items() if key not in {"anyOf", "default"}}
    return {**options[0], **rest} if len(options) == 1 else schema


def multipart_body(properties: dict[str, Any], *, required: str) -> dict[str, Any]:
    """Describe a form that the endpoint reads itself."""
    schema = {
        "type": "object",
        "properties": properties,
        "required": [required],
        "additionalProperties": False,
    }
    return {
        "requestBody": {"required": True, "content": {"multipart/form-data": {"schema": schema}}}
    }


def install_openapi(app: FastAPI, *, has_keys: bool) -> None:
    """Make the document at its first use.

    Parameters
    ----------
    app : FastAPI
        What is described.
    has_keys : bool
        Whether requests need a key. Without keys the document speaks of none.
    """

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            made = get_openapi(
                title=app.title,
                version=app.version,
                openapi_version=app.openapi_version,
                summary=app.summary,
                description=app.description,
                routes=app.routes,
                tags=app.openapi_tags,
                license_info=app.license_info,
            )
            schemas = made["components"]["schemas"]
            schemas["Problem"] = Problem.model_json_schema()
            for unused in ("HTTPValidationError", "ValidationError"):
                schemas.pop(unused, None)
            _put_back_nulls(schemas)
            if not has_keys:
                _take_out_keys(made)
            app.openapi_schema = made
        return app.openapi_schema

    app.openapi = document  # type: ignore[method-assign]


def _take_out_keys(document: dict[str, Any]) -> None:
    """Remove the demand for a key; the answers 401 and 403 stay, as clients must know them."""
    document["components"].pop("securitySchemes", None)
    for operations in document["paths"].values():
        for operation in operations.values():
            operation.pop("security", None)


def _put_back_nulls(schemas: dict[str, Any]) -> None:
    """Write the examples again: the framework takes every null out of them."""
    for body in [*Answer.__subclasses__(), *Body.__subclasses__(), *QueryOptions.__subclasses__()]:
        extra = body.model_config.get("json_schema_extra")
        if body.__name__ in schemas and isinstance(extra, dict):
            schemas[body.__name__].update(extra)


def _problem(status: int) -> dict[str, Any]:
    kind, detail = EXAMPLES[status]
    example = {
        "type": f"/problems/{kind}",
        "title": kind.replace("-", " ").capitalize(),
        "status": status,
        "detail": detail,
        "instance": "/v1/collections/zoo",
        "request_id": "4f0c9b0e7d1a4a52",
    }
    schema = {"$ref": "#/components/schemas/Problem"}
    answer: dict[str, Any] = {
        "description": HTTPStatus(status).phrase,
        "content": {PROBLEM_TYPE: {"schema": schema, "example": example}},
    }
    if status in {429, 503}:
        answer["headers"] = {"Retry-After": RETRY_AFTER}
    return answer
