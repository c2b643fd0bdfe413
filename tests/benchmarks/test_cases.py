"""What is expected of a case, in the words of the index, is held against what came of it."""

from dataclasses import replace

import pytest

from benchmarks.cases.judging import Outcome, Surface, Verdict, judge

CLEAN = Surface(966, 3751.33, 1, 0, diagonal=100.0)
SAME = "ready; the same surface as the clean mesh: 966 vertices, area 3751.33 (× scale²), 1 com"
GIVEN = "ready; area and components as given; area 3751.3300, 1 components, 0 loops"
NAMED = "read, or refused with a reason that names the cause"


def found(surface: Surface = CLEAN, distance: float = 0.0, rank: int = 1) -> Outcome:
    return Outcome(ready=("a.ply",), surface=surface, distance=distance, rank=rank)


def refused(reason: str = "it is damaged") -> Outcome:
    return Outcome(failed=(("a.ply", reason),), stored_failures=1)


@pytest.mark.parametrize(
    ("expected", "outcome", "verdict"),
    [
        (SAME, found(), "ok"),
        (SAME, found(replace(CLEAN, area=4 * CLEAN.area, diagonal=200.0)), "ok"),
        (SAME, found(replace(CLEAN, area=1.01 * CLEAN.area)), "wrong"),
        (SAME, found(replace(CLEAN, components=2)), "wrong"),
        (SAME, found(replace(CLEAN, loops=1)), "wrong"),
        (SAME, found(replace(CLEAN, vertices=1000)), "judge by eye"),
        (SAME, found(distance=0.4), "wrong"),
        (SAME, found(rank=2), "wrong"),
        (SAME, refused(), "wrong"),
        ("ready; the clean mesh within rounding", found(replace(CLEAN, area=3760.0)), "ok"),
        (GIVEN, found(distance=2.0, rank=20), "ok"),
        (GIVEN, found(replace(CLEAN, area=1.0)), "wrong"),
        (GIVEN, found(replace(CLEAN, components=3)), "wrong"),
        ("ready; the clean mesh is rank 1 with a small distance", found(distance=0.2), "ok"),
        ("ready; the clean mesh is rank 1 with a small distance", found(rank=2), "wrong"),
        (NAMED, found(), "ok"),
        (NAMED, found(rank=2), "wrong"),
        (NAMED, refused(), "judge by eye"),
        (NAMED, refused("it misled"), "wrong"),
        (NAMED, Outcome(), "wrong"),
        ("a failed shape with a reason", refused(), "judge by eye"),
        ("a failed shape with a reason", found(), "wrong"),
        ("read or refused", refused(), "ok"),
        ("only a.ply becomes a shape; others not stored", found(), "ok"),
        ("only b.ply becomes a shape; others not stored", found(), "wrong"),
        (
            "only a.ply becomes a shape; others not stored",
            replace(found(), stored_failures=1),
            "wrong",
        ),
    ],
)
def test_the_words_of_the_index_are_checked(expected: str, outcome: Outcome, verdict: str) -> None:
    case = {"expected": expected, "got": {"error": "it misled"}, "verdict": "wrong"}
    assert judge(case, outcome, CLEAN)[0] == verdict


def test_a_reason_that_was_judged_right_before_is_right() -> None:
    case = {"expected": NAMED, "got": {"error": "it is damaged"}, "verdict": "reported"}
    assert judge(case, refused(), CLEAN)[0] is Verdict.OK
