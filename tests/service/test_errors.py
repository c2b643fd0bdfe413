"""Problems: whatever is sent, the answer is one, and it tells nothing it should not."""

import json
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NoReturn, cast

import pytest
import structlog
from sqlalchemy.exc import OperationalError, ProgrammingError

from service.errors import STATUS, RefusedError, status_of
from service.search.indexes import SearchIndexes
from tests.service.running import ZOO, Api
from workers import errors
from workers.errors import FailedWorkError

JSON_TYPE = {"Content-Type": "application/json"}


def test_every_domain_error_has_the_status_of_the_conventions() -> None:
    expected = {
        **dict.fromkeys(("InvalidMesh", "InvalidRequest", "KernelDomain", "Spectrum"), 422),
        **{"TimeLimit": 422},
        **{"UnsupportedFormat": 415, "UploadTooLarge": 413, "InsufficientTrainingData": 409},
        **dict.fromkeys(("NameTaken", "ModelNotReady", "ShapeNotReady", "Conflict"), 409),
        **dict.fromkeys(("NotFound", "ShapeNotFound", "CollectionNotFound", "BlobNotFound"), 404),
        **dict.fromkeys(
            ("ModelNotFound", "JobNotFound", "QueryNotFound", "EvaluationNotFound"), 404
        ),
        **{"Proteus": 500},
    }
    for name, status in expected.items():
        cls = getattr(errors, f"{name}Error")
        assert status_of(cls("x")) == status
    known = {cls for cls in vars(errors).values() if isinstance(cls, type)}
    known = {cls for cls in known if issubclass(cls, errors.ProteusError)} - {FailedWorkError}
    assert len(expected) == len(known)
    assert set(STATUS) <= known


def test_failed_work_has_the_status_of_its_reason() -> None:
    for kind, status in (("invalid-mesh", 422), ("unsupported-format", 415), ("cancelled", 409)):
        error = FailedWorkError.of([{"item": "a", "type": kind, "detail": "why"}])
        assert (error.kind, status_of(error), str(error)) == (kind, status, "why")
    lost = FailedWorkError.of([{"item": "a", "type": "computation-lost", "detail": "why"}])
    assert status_of(lost) == 500
    assert status_of(FailedWorkError.of([])) == 409


def all_kinds(cls: type[errors.ProteusError]) -> list[type[errors.ProteusError]]:
    return [cls, *(kind for below in cls.__subclasses__() for kind in all_kinds(below))]


class BrokenIndexes:
    """Search indexes of which every search ends in one error."""

    def __init__(self, error: errors.ProteusError) -> None:
        self._error = error

    def snapshot(self, *_: object) -> NoReturn:
        raise self._error

    def close(self) -> None:
        pass


@pytest.mark.parametrize("cls", all_kinds(errors.ProteusError))
def test_any_error_of_a_question_in_a_batch_keeps_its_kind_and_status(
    zoo: Api, cls: type[errors.ProteusError]
) -> None:
    headers = {"Retry-After": "7"} if cls is RefusedError else {}
    made: dict[type[errors.ProteusError], Callable[[], errors.ProteusError]] = {
        RefusedError: lambda: RefusedError("busy", 409, "why", headers),
        FailedWorkError: lambda: FailedWorkError("invalid-mesh", "why"),
    }
    error = made.get(cls, lambda: cls("why"))()
    kind, status = error.kind, status_of(error)
    indexes = cast(SearchIndexes, BrokenIndexes(error))
    zoo.services = replace(zoo.services, indexes=indexes)
    body = {"queries": [{"shape_id": shape_id} for shape_id in zoo.shape_ids.values()]}
    answer = zoo.client.post("/v1/collections/zoo/query/batch", json=body)
    assert answer.status_code == status
    assert answer.headers.get("Retry-After") == headers.get("Retry-After")
    problem = answer.json()
    assert (problem["type"], problem["detail"]) == (f"/problems/{kind}", "queries.0: why")


@pytest.mark.parametrize(
    "path",
    ["/nope", "/v1", "/v1/collections/", "/v1/shapes/..%2f..", "/v1/shapes/../../etc"],
)
def test_unknown_paths_are_problems(api: Api, path: str) -> None:
    problem = api.get(path, 404)
    assert problem["title"]


def test_a_wrong_method_is_told_the_right_ones(api: Api) -> None:
    answer = api.client.put("/v1/collections", json={})
    assert answer.status_code == 405
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert answer.headers["Allow"]
    assert answer.headers["Allow"] in answer.json()["detail"]


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b'"text"',
        b'{"name": "zoo",}',
        b'{"name": "zoo", "description": "\xff"}',
        b'{"name": "zoo", "description": "\\u0000"}',
        b'{"name": "zoo", "description": "\\ud800"}',
        b'{"name": "zoo", "description": 1e999}',
        b'{"name": ' + b"[" * 100_000,
        b'{"name": ' + b"9" * 10_000 + b"}",
        b'{"name": "zoo", "\\ud800": 1}',
        b'{"name": NaN}',
        b'{"name": true}',
        b"\xff\xfe{",
    ],
)
def test_bodies_that_are_no_usable_json_are_422(api: Api, body: bytes) -> None:
    problem = api.post("/v1/collections", 422, content=body, headers=JSON_TYPE)
    assert problem["type"] == "/problems/invalid-request"
    assert len(problem["detail"]) <= 2000
    assert api.get("/v1/collections")["items"] == []


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_are_none_are_refused_wherever_they_stand(zoo: Api, number: str) -> None:
    shape = zoo.shape_ids[ZOO[0]]
    equal = f'{{"field": "strength", "equals": {number}}}'
    above = f'{{"field": "strength", "range": {{"gt": {number}}}}}'
    bodies = [
        f'{{"shape_id": "{shape}", "max_distance": {number}}}',
        f'{{"shape_id": "{shape}", "limit": {number}}}',
        f'{{"shape_id": "{shape}", "filter": {{"must": [{equal}]}}}}',
        f'{{"shape_id": "{shape}", "filter": {{"must": [{above}]}}}}',
    ]
    for body in bodies:
        zoo.post("/v1/collections/zoo/query", 422, content=body, headers=JSON_TYPE)
    patch = f'{{"metadata": {{"a": [{number}]}}}}'
    zoo.patch(f"/v1/shapes/{shape}", 422, content=patch, headers=JSON_TYPE)


@pytest.mark.parametrize(
    "kind", ["text/plain", "application/x-www-form-urlencoded", "", "multipart/form-data"]
)
def test_a_body_of_another_type_is_415(api: Api, kind: str) -> None:
    headers = {"Content-Type": kind} if kind else {}
    problem = api.post("/v1/collections", 415, content=b'{"name": "zoo"}', headers=headers)
    assert "expected application/json" in problem["detail"]
    api.post(
        "/v1/collections",
        201,
        content=b'{"name": "zoo"}',
        headers={"Content-Type": "application/vnd.proteus+json; charset=utf-8"},
    )


@pytest.mark.parametrize(
    "query", ["%00", "%ff", "%ed%a0%80", "x" * 5000, "'; DROP TABLE shapes; --"]
)
def test_texts_in_the_address_do_no_harm(zoo: Api, query: str) -> None:
    for path in ("/v1/collections/zoo/shapes?label=", "/v1/jobs?collection=", "/v1/models?cursor="):
        status = zoo.client.get(path + query).status_code
        assert status in {200, 422}
    for path in ("/v1/collections/", "/v1/models/", "/v1/shapes/", "/v1/jobs/"):
        assert zoo.client.get(path + query).status_code == 404
    zoo.get(f"/v1/collections/zoo/shapes?limit={'9' * 5000}", 422)
    assert zoo.get("/v1/collections/zoo")["shape_count"] == 5


def test_an_unexpected_error_tells_nothing_but_its_request(
    api: Api, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise ZeroDivisionError("secret: /etc/passwd")

    monkeypatch.setattr("service.api.models.page_of_models", fail)
    with structlog.testing.capture_logs() as lines:
        problem = api.get("/v1/models", 500)
    assert "request failed" in [line["event"] for line in lines]
    assert problem["type"] == "/problems/internal-error"
    assert "secret" not in json.dumps(problem)
    assert "ZeroDivision" not in json.dumps(problem)


@pytest.mark.parametrize(
    ("raised", "status"),
    [
        (OperationalError("SELECT 1", {}, sqlite3.OperationalError("unable to open")), 503),
        (ProgrammingError("SELECT 1", {}, sqlite3.ProgrammingError("broken")), 500),
        (RefusedError("teapot", 418, "short and stout"), 418),
    ],
)
def test_a_database_that_is_away_is_503_and_a_slip_of_ours_500(
    api: Api, monkeypatch: pytest.MonkeyPatch, raised: Exception, status: int
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise raised

    monkeypatch.setattr("service.api.models.page_of_models", fail)
    with structlog.testing.capture_logs():
        answer = api.client.get("/v1/models")
    assert answer.status_code == status
    assert ("Retry-After" in answer.headers) == (status == 503)
    assert "SELECT" not in answer.text


def test_a_validation_problem_names_at_most_a_few_fields(api: Api) -> None:
    body = {f"field{n}": n for n in range(100)} | {"name": 1}
    detail = api.post("/v1/collections", 422, json=body)["detail"]
    assert "name: " in detail
    assert detail.endswith("and 96 more")
