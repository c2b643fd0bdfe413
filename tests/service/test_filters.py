"""Filters mean the same whatever the database: conditions on plain dictionaries."""

from typing import Any

import numpy as np
import pytest

from service.schemas.filters import Condition, Filter
from service.search.filters import holds, matching_shapes, passes
from tests.service.running import EGG, Api
from workers.storage.collections import get_collection

CAT = {
    "label": "cat",
    "name": "cat.holes.3.off",
    "path": "zoo/cats/cat.holes.3.off",
    "transformation": "holes",
    "strength": 3,
    "metadata": {"year": 2024, "tags": ["a", "b"], "scan": {"by": "Ada", "ok": True}, "none": None},
}


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ({"field": "label", "equals": "cat"}, True),
        ({"field": "label", "equals": "Cat"}, False),
        ({"field": "label", "equals": None}, False),
        ({"field": "label", "in": ["dog", "cat"]}, True),
        ({"field": "name", "range": {"gte": "cat", "lt": "cau"}}, True),
        ({"field": "strength", "equals": 3.0}, True),
        ({"field": "strength", "equals": "3"}, False),
        ({"field": "strength", "equals": True}, False),
        ({"field": "strength", "range": {"gt": 3}}, False),
        ({"field": "strength", "range": {"gte": 3, "lte": 3}}, True),
        ({"field": "strength", "range": {"lt": "x"}}, False),
        ({"field": "path", "equals": "zoo/cats/cat.holes.3.off"}, True),
        ({"field": "path", "under": "zoo/cats"}, True),
        ({"field": "path", "under": "zoo/cats/"}, True),
        ({"field": "path", "under": "zoo/cat"}, False),
        ({"field": "path", "under": "Zoo"}, False),
        ({"field": "path", "under": "zoo/cats/cat.holes.3.off"}, True),
        ({"field": "path", "under": ""}, True),
        ({"field": "metadata.year", "range": {"gt": 2023.5, "lt": 2024.5}}, True),
        ({"field": "metadata.tags", "equals": "b"}, True),
        ({"field": "metadata.tags", "in": ["c"]}, False),
        ({"field": "metadata.scan.by", "equals": "Ada"}, True),
        ({"field": "metadata.scan.ok", "equals": True}, True),
        ({"field": "metadata.scan.ok", "equals": 1}, False),
        ({"field": "metadata.scan.ok", "range": {"gte": 0}}, False),
        ({"field": "metadata.scan", "equals": None}, False),
        ({"field": "metadata.none", "equals": None}, True),
        ({"field": "metadata.missing.deeper", "equals": None}, True),
        ({"field": "metadata.missing", "range": {"lt": 5}}, False),
    ],
)
def test_a_condition_compares_values_of_one_type(condition: dict[str, Any], expected: bool) -> None:
    assert holds(Condition.model_validate(condition).to_value(), CAT) is expected


def test_must_must_not_and_should_are_all_none_and_any() -> None:
    true, false = {"field": "label", "equals": "cat"}, {"field": "label", "equals": "dog"}
    for must in ([], [true], [true, true], [true, false], [false]):
        for must_not in ([], [false], [true, false]):
            for should in ([], [false, true], [false]):
                wanted = Filter.model_validate(
                    {"must": must, "must_not": must_not, "should": should}
                ).to_value()
                expected = (
                    all(c is true for c in must)
                    and not any(c is true for c in must_not)
                    and (not should or true in should)
                )
                assert passes(wanted, CAT) is expected


def test_the_rows_that_are_read_less_of_are_the_rows_that_pass(zoo: Api) -> None:
    """What SQL narrows is decided again in Python: both must agree with Python alone."""
    rng = np.random.default_rng(7)
    for number, shape in enumerate(zoo.shape_ids.values()):
        zoo.patch(f"/v1/shapes/{shape}", json={"metadata": {"n": number}})
    shapes = zoo.get("/v1/collections/zoo/shapes")["items"]
    values: dict[str, list[Any]] = {
        "label": ["ball", "ring", None, 1],
        "transformation": ["null", "scale", None],
        "strength": [0, 2, 2.0, True, None, 2**40, "0"],
        "name": ["crate.stl", "x"],
        "path": ["crate.stl", "x"],
        "metadata.n": [0, 1, 4, None],
    }

    def draw() -> dict[str, Any]:
        field = list(values)[rng.integers(len(values))]
        options = values[field]
        if field == "path" and rng.integers(2):
            return {"field": field, "under": ["", "crate.stl", "x", "cr_te.stl"][rng.integers(4)]}
        picked = [options[i] for i in rng.integers(len(options), size=rng.integers(1, 3))]
        return {"field": field, **({"equals": picked[0]} if len(picked) == 1 else {"in": picked})}

    with zoo.services.database.read() as session:
        collection = get_collection(session, "zoo").id
        for _ in range(200):
            body = {
                part: [draw() for _ in range(rng.integers(0, 3))]
                for part in ("must", "must_not", "should")
            }
            wanted = Filter.model_validate(body).to_value()
            expected = {shape["id"] for shape in shapes if passes(wanted, shape)}
            assert matching_shapes(session, collection, wanted) == expected, body


@pytest.mark.parametrize(
    "condition",
    [
        {"field": "path", "under": "a", "equals": "a"},
        {"field": "path", "under": None},
        {"field": "path", "under": 3},
    ],
)
def test_under_takes_a_text_and_no_other_test_beside_it(condition: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="under"):
        Condition.model_validate(condition)


def test_lists_and_queries_are_filtered_by_folder(api: Api) -> None:
    """The folders "50%" and "50_" would be patterns in SQL; upper and lower case differ."""
    api.post("/v1/collections", 201, json={"name": "zoo"})
    paths = ["zoo/50%/a.off", "zoo/50%x/b.off", "ZOO/50_/c.off", "zoo/50%/deep/d.off"]
    eggs = {path: EGG + b"\n" * number for number, path in enumerate(paths)}
    shapes = api.upload("zoo", eggs)["shapes"]
    api.work()
    assert [shape["path"] for shape in shapes] == paths
    for folder, expected in {
        "zoo/50%": [0, 3],
        "zoo/50%/": [0, 3],
        "zoo": [0, 1, 3],
        "zoo/50_": [],
        "ZOO/50_": [2],
        "zoo/50%/a.off": [0],
        "": [0, 1, 2, 3],
    }.items():
        found = api.get("/v1/collections/zoo/shapes", params={"path": folder})["items"]
        assert sorted(shape["path"] for shape in found) == sorted(paths[i] for i in expected)
        body = {"must": [{"field": "path", "under": folder}]}
        matches = api.ask("zoo", shape_id=shapes[0]["id"], include_self=True, filter=body)
        assert matches["searched"] == len(expected)
