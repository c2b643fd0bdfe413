"""The document says what the contract says, and its examples are what it says they are."""

import re
from typing import Any

import pytest

from tests.service.running import Api

Json = dict[str, Any]
JOB_STATUSES = {"200", "202"}
CONTRACT = {
    ("get", "/healthz"): {"200"},
    ("get", "/readyz"): {"200", "503"},
    ("get", "/metrics"): {"200"},
    ("post", "/v1/collections"): {"201", "409", "422"},
    ("get", "/v1/collections"): {"200"},
    ("get", "/v1/collections/{collection}"): {"200", "404"},
    ("patch", "/v1/collections/{collection}"): {"200", "404", "422"},
    ("delete", "/v1/collections/{collection}"): {"204", "404"},
    ("post", "/v1/collections/{collection}/shapes"): {
        "202",
        "201",
        "200",
        "404",
        "413",
        "415",
        "422",
    },
    ("get", "/v1/collections/{collection}/shapes"): {"200", "404", "422"},
    ("get", "/v1/shapes/{shape_id}"): {"200", "404"},
    ("patch", "/v1/shapes/{shape_id}"): {"200", "404", "422"},
    ("delete", "/v1/shapes/{shape_id}"): {"204", "404"},
    ("get", "/v1/shapes/{shape_id}/mesh"): {"200", "304", "404", "409"},
    ("get", "/v1/shapes/{shape_id}/thumbnail.png"): {"200", "304", "404", "409"},
    ("get", "/v1/shapes/{shape_id}/spectrum"): {"200", "404", "409"},
    ("get", "/v1/shapes/{shape_id}/signature"): {"200", "304", "404", "409", "422"},
    ("get", "/v1/shapes/{shape_id}/eigenfunction"): {"200", "304", "404", "409", "422"},
    ("get", "/v1/shapes/{shape_id}/distribution"): {"200", "404", "409", "422"},
    ("get", "/v1/shapes/{shape_id}/comparison"): {"200", "404", "409", "422"},
    ("get", "/v1/shapes/{shape_id}/correspondence"): {*JOB_STATUSES, "304", "404", "409", "422"},
    ("post", "/v1/collections/{collection}/query"): {*JOB_STATUSES, "404", "409", "422"},
    ("post", "/v1/collections/{collection}/query/mesh"): {
        *JOB_STATUSES,
        "404",
        "413",
        "415",
        "422",
    },
    ("get", "/v1/queries/{query_id}"): {*JOB_STATUSES, "404", "422"},
    ("get", "/v1/queries/{query_id}/mesh"): {"200", "304", "404", "409"},
    ("get", "/v1/queries/{query_id}/spectrum"): {"200", "404", "409"},
    ("get", "/v1/queries/{query_id}/signature"): {"200", "304", "404", "409", "422"},
    ("get", "/v1/queries/{query_id}/eigenfunction"): {"200", "304", "404", "409", "422"},
    ("get", "/v1/queries/{query_id}/correspondence"): {*JOB_STATUSES, "304", "404", "409", "422"},
    ("post", "/v1/collections/{collection}/query/batch"): {"200", "404", "409", "422"},
    ("get", "/v1/models"): {"200"},
    ("post", "/v1/models"): {"201", "202", "404", "409", "422"},
    ("get", "/v1/models/{name}"): {"200", "404"},
    ("delete", "/v1/models/{name}"): {"204", "404", "409"},
    ("put", "/v1/collections/{collection}/model"): {*JOB_STATUSES, "404", "409"},
    ("post", "/v1/evaluations"): {"202", "201", "404", "409", "422"},
    ("get", "/v1/evaluations"): {"200"},
    ("get", "/v1/evaluations/{evaluation_id}"): {"200", "404"},
    ("get", "/v1/jobs"): {"200"},
    ("get", "/v1/jobs/{job_id}"): {"200", "304", "404"},
    ("post", "/v1/jobs/{job_id}/cancel"): {"200", "404", "409"},
    ("post", "/v1/jobs/{job_id}/retry"): {"200", "404", "409"},
    ("get", "/v1/jobs/{job_id}/events"): {"200", "404"},
    ("get", "/v1/prune"): {"200"},
    ("post", "/v1/prune"): {*JOB_STATUSES},
}
"""The table of the contract, and what was added: operations, and statuses each speaks of."""
LISTS = {
    ("get", f"/v1/{name}")
    for name in ("collections", "collections/{collection}/shapes", "models", "evaluations", "jobs")
}


@pytest.fixture
def document(api: Api) -> Json:
    found: Json = api.get("/openapi.json")
    return found


def operations(document: Json) -> list[tuple[str, str, Json]]:
    return [
        (method, path, operation)
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]


def check(document: Json, schema: Json, value: Any, where: str) -> None:
    """Assert that a value is what a schema says: the part of JSON Schema that is used here."""
    if "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    if "anyOf" in schema:
        for option in schema["anyOf"]:
            try:
                check(document, option, value, where)
                return
            except AssertionError:
                continue
        raise AssertionError(f"{where}: {value!r} is nothing of {schema['anyOf']}")
    assert value in schema.get("enum", [value]), where
    assert value == schema.get("const", value), where
    kinds: dict[str, Any] = {
        "object": dict, "array": list, "string": str, "boolean": bool, "null": type(None),
        "integer": int, "number": (int, float),
    }  # fmt: skip
    if "type" in schema:
        assert isinstance(value, kinds[schema["type"]]), (
            f"{where}: {value!r} is no {schema['type']}"
        )
    if isinstance(value, dict):
        known = schema.get("properties", {})
        assert set(schema.get("required", [])) <= value.keys(), where
        if schema.get("additionalProperties") is False:
            assert value.keys() <= known.keys(), where
        for key in value.keys() & known.keys():
            check(document, known[key], value[key], f"{where}.{key}")
    elif isinstance(value, list):
        for item in value:
            check(document, schema.get("items", {}), item, f"{where}[]")
    elif isinstance(value, str):
        assert re.search(schema.get("pattern", ""), value), where
    elif isinstance(value, int | float):
        assert schema.get("minimum", value) <= value <= schema.get("maximum", value), where


def test_the_document_is_openapi_3_1(document: Json) -> None:
    assert document["openapi"].startswith("3.1")
    assert document["info"]["title"] == "Proteus"
    assert {tag["name"] for tag in document["tags"]} >= {
        tag for _, _, operation in operations(document) for tag in operation["tags"]
    }


def test_every_operation_of_the_contract_is_there_and_no_other(document: Json) -> None:
    found = {
        (method, path): set(operation["responses"])
        for method, path, operation in operations(document)
    }
    assert found.keys() == CONTRACT.keys()
    for operation, statuses in CONTRACT.items():
        assert statuses <= found[operation], operation
    identifiers = [operation["operationId"] for _, _, operation in operations(document)]
    assert len(set(identifiers)) == len(identifiers)


def test_without_keys_no_operation_demands_one(document: Json) -> None:
    assert "securitySchemes" not in document["components"]
    assert "security" not in document
    for method, path, operation in operations(document):
        assert "security" not in operation, (method, path)


def test_a_cursor_has_a_declared_form(document: Json, zoo: Api) -> None:
    found = 0
    for _, _path, operation in operations(document):
        for parameter in operation.get("parameters", []):
            if parameter["name"] == "cursor":
                (schema,) = [s for s in parameter["schema"]["anyOf"] if s["type"] == "string"]
                assert schema["maxLength"] < 5000
                given = zoo.get("/v1/models?limit=1")["next_cursor"]
                assert re.search(schema["pattern"], given)
                assert not re.search(schema["pattern"], "not a cursor!")
                found += 1
    assert found == sum(1 for m, p, _ in operations(document) if (m, p) in LISTS)


def test_a_method_that_is_not_there_is_answered_with_all_that_are(document: Json, api: Api) -> None:
    for path, methods in document["paths"].items():
        place = re.sub(r"\{\w+\}", "heat", path)
        for method in ("OPTIONS", "TRACE", "PUT", "HEAD"):
            if method.lower() in methods:
                continue
            answer = api.client.request(method, place)
            assert answer.status_code == 405, (method, place)
            assert answer.headers["Allow"] == ", ".join(sorted(methods)).upper()
    for place in ("/", "/openapi.json", "/docs/assets/swagger-ui.css"):
        assert api.client.post(place).headers["Allow"] == "GET, HEAD"
        assert api.client.head(place).status_code == 200


def test_every_operation_says_what_it_does_and_how_it_fails(document: Json) -> None:
    for method, path, operation in operations(document):
        assert operation["summary"], path
        assert operation["description"], path
        for status, answer in operation["responses"].items():
            if status >= "400" and path != "/readyz":
                content = answer["content"]["application/problem+json"]
                assert content["schema"] == {"$ref": "#/components/schemas/Problem"}
                assert content["example"]["status"] == int(status)
        if path.startswith("/v1"):
            assert {"401", "403", "429", "500", "503"} <= set(operation["responses"]), (
                method,
                path,
            )


def test_no_answer_is_left_as_the_framework_would_have_it(document: Json) -> None:
    assert "HTTPValidationError" not in str(document)
    references = set(re.findall(r"#/components/schemas/([\w.-]+)", str(document)))
    assert references <= document["components"]["schemas"].keys()


def test_examples_are_what_their_schemas_say(document: Json) -> None:
    checked = 0
    for name, schema in document["components"]["schemas"].items():
        for example in schema.get("examples", []):
            check(document, schema, example, name)
            checked += 1
    for _, path, operation in operations(document):
        for status, answer in operation["responses"].items():
            for content in answer.get("content", {}).values():
                if "example" in content:
                    check(document, content["schema"], content["example"], f"{path} {status}")
                    checked += 1
    assert checked > 100


def test_bodies_and_answers_of_the_contract_have_examples(document: Json) -> None:
    schemas = document["components"]["schemas"]
    for _, path, operation in operations(document):
        contents = [
            *operation.get("requestBody", {}).get("content", {}).items(),
            *operation["responses"].get("200", {}).get("content", {}).items(),
        ]
        for kind, content in contents:
            reference = content.get("schema", {}).get("$ref", "")
            if kind == "application/json" and not reference.rpartition("/")[2].startswith(
                "PageAnswer"
            ):
                assert schemas[reference.rpartition("/")[2]]["examples"], path


def test_the_meaning_of_similarity_is_stated(document: Json) -> None:
    match = document["components"]["schemas"]["Match"]
    meaning = match["properties"]["similarity"]["description"]
    assert "median distance" in meaning
    assert "no probability" in meaning


def test_real_answers_are_what_the_document_says(zoo: Api) -> None:
    document = zoo.get("/openapi.json")
    shape = next(iter(zoo.shape_ids.values()))
    ask = {"shape_id": shape}
    of_shape = "/v1/shapes/{shape_id}"
    job = zoo.get("/v1/jobs")["items"][0]["id"]
    real = [
        ("get", "/v1/collections/{collection}", zoo.get("/v1/collections/zoo")),
        ("get", "/v1/collections", zoo.get("/v1/collections")),
        ("get", "/v1/collections/{collection}/shapes", zoo.get("/v1/collections/zoo/shapes")),
        ("get", "/v1/shapes/{shape_id}", zoo.get(f"/v1/shapes/{shape}")),
        ("get", "/v1/shapes/{shape_id}/spectrum", zoo.get(f"/v1/shapes/{shape}/spectrum")),
        ("get", "/v1/shapes/{shape_id}/distribution", zoo.get(f"/v1/shapes/{shape}/distribution")),
        ("get", of_shape + "/comparison", zoo.get(f"/v1/shapes/{shape}/comparison", params=ask)),
        ("post", "/v1/collections/{collection}/query", zoo.ask("zoo", **ask)),
        ("get", "/v1/models", zoo.get("/v1/models")),
        ("get", "/v1/models/{name}", zoo.get("/v1/models/shape-dna")),
        ("get", "/v1/jobs", zoo.get("/v1/jobs")),
        ("get", "/v1/jobs/{job_id}", zoo.get(f"/v1/jobs/{job}")),
        ("get", "/readyz", zoo.get("/readyz")),
    ]
    for method, path, answer in real:
        content = document["paths"][path][method]["responses"]["200"]["content"]
        check(document, content["application/json"]["schema"], answer, path)
