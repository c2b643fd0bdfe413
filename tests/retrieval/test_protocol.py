"""Who is asked and who is searched, and who is neither."""

import numpy as np
import pytest

from workers.errors import InvalidRequestError
from workers.retrieval.protocol import (
    NO_LABEL,
    NO_RELEVANT_TARGET,
    EvaluatedShape,
    make_protocol,
)


def shape(
    number: int, label: str | None, transformation: str | None = None, strength: int | None = None
) -> EvaluatedShape:
    return EvaluatedShape(f"id-{number:02}", f"{number}.off", label, transformation, strength)


BENCHMARK = [
    shape(0, "cat", "null", 0),
    shape(1, "dog", "null", 0),
    shape(2, "cat", "holes", 1),
    shape(3, "cat", "holes", 2),
    shape(4, "dog", "scale", 1),
    shape(5, "chair"),  # a distractor
    shape(6, None),
]


def test_transformed_shapes_are_asked_with_and_all_others_searched() -> None:
    found = make_protocol(BENCHMARK)
    assert found.queries.tolist() == [2, 3, 4]
    assert found.targets.tolist() == [0, 1, 5, 6]
    assert not found.leave_one_out
    assert found.left_out == ()
    assert found.labels == ("cat", "chair", "dog")
    assert found.classes.tolist() == [0, 2, 0, 0, 2, 1, -1]


def test_order_of_the_shapes_changes_nothing() -> None:
    expected = make_protocol(BENCHMARK)
    for seed in range(5):
        order = np.random.default_rng(seed).permutation(len(BENCHMARK))
        found = make_protocol([BENCHMARK[i] for i in order])
        assert found.shapes == expected.shapes
        assert found.queries.tolist() == expected.queries.tolist()
        assert found.targets.tolist() == expected.targets.tolist()


def test_queries_that_nothing_could_answer_are_named() -> None:
    lost = [shape(7, "bird", "noise", 1), shape(8, None, "noise", 1), shape(9, "", "noise", 2)]
    found = make_protocol([*BENCHMARK, *lost])
    assert found.queries.tolist() == [2, 3, 4]
    assert found.targets.tolist() == [0, 1, 5, 6]
    assert [(one.id, one.reason) for one in found.left_out] == [
        ("id-07", NO_RELEVANT_TARGET),
        ("id-08", NO_LABEL),
        ("id-09", NO_LABEL),
    ]


@pytest.mark.parametrize("untransformed", [None, "", "null"])
def test_without_transformations_each_is_asked_against_the_rest(untransformed: str | None) -> None:
    labels = ["a", "a", "b", None, "b", "alone"]
    found = make_protocol([shape(i, label, untransformed) for i, label in enumerate(labels)])
    assert found.leave_one_out
    assert found.queries.tolist() == [0, 1, 2, 4]
    assert found.targets.tolist() == list(range(6))
    assert [(one.name, one.reason) for one in found.left_out] == [
        ("3.off", NO_LABEL),
        ("5.off", NO_RELEVANT_TARGET),
    ]


@pytest.mark.parametrize(
    ("shapes", "words"),
    [
        ([], "found 0 shapes"),
        ([shape(0, None), shape(1, None)], "0 of them with a label"),
        ([shape(0, "a"), shape(1, "b")], r"2 of them with a label \(2 different ones\)"),
        ([shape(0, "a", "holes"), shape(1, "a", "noise")], "2 with a transformation"),
        ([shape(0, "a", "holes"), shape(1, "b", "null")], "1 with a transformation"),
        ([shape(0, None, "holes"), shape(1, "b", "null")], "1 of them with a label"),
    ],
)
def test_what_cannot_be_evaluated_says_what_is_there_and_what_is_needed(
    shapes: list[EvaluatedShape], words: str
) -> None:
    with pytest.raises(InvalidRequestError, match=words) as refused:
        make_protocol(shapes)
    assert "expected a transformed shape and another of its label" in str(refused.value)
