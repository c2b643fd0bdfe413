"""Bodies are what their schemas say, neither more nor less."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.schemas.filters import Condition
from service.schemas.queries import ShapeQuery
from service.schemas.training import NewModel
from tests.service.running import Api
from workers.storage.paging import decode_cursor, encode_cursor


@pytest.mark.parametrize("limit", [True, "10", 10.5, [10], None])
def test_no_truth_value_and_no_text_stands_for_a_number(zoo: Api, limit: object) -> None:
    shape = next(iter(zoo.shape_ids.values()))
    zoo.ask("zoo", 422, shape_id=shape, limit=limit)
    zoo.ask("zoo", 200, shape_id=shape, limit=10)


def test_a_whole_number_may_be_written_with_a_point() -> None:
    query = ShapeQuery.model_validate({"shape_id": "x", "limit": 10.0, "max_distance": 1})
    assert (query.limit, query.max_distance) == (10, 1.0)
    body = {"name": "b", "method": "bank", "training": {"seed": 3.0, "strengths": [1.0, 2.0]}}
    training = NewModel.model_validate(body).root.training
    assert training is not None
    assert (training.seed, training.strengths) == (3, [1, 2])


@pytest.mark.parametrize(
    "test", [{}, {"in": None}, {"range": None}, {"equals": 1, "in": [1]}, {"in": []}]
)
def test_a_condition_has_exactly_one_test(test: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"exactly one|at least 1"):
        Condition.model_validate({"field": "label", **test})


@given(st.text(st.characters(codec="utf-8", exclude_characters="\x00"), max_size=200))
def test_a_cursor_is_read_as_it_was_made(key: str) -> None:
    assert decode_cursor(encode_cursor(key)) == (key or None)


@given(st.from_regex(r"\A([2-7][0-9a-f])*\Z"))
def test_every_text_of_a_cursors_form_is_a_cursor(cursor: str) -> None:
    key = decode_cursor(cursor)
    assert key is None if not cursor else key and "\x00" not in key
