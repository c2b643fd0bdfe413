"""Tables of an evaluation: a worked example, and a second implementation."""

import json
from dataclasses import astuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from workers.geometry.arrays import FloatArray
from workers.retrieval.evaluation import row_order, summarise
from workers.retrieval.protocol import EvaluatedShape, Protocol, make_protocol
from workers.retrieval.ranking import Ranking, rank_queries

KINDS = ("all", "holes", "scale", "melted")


def benchmark(n_labels: int = 6, strengths: int = 3) -> Protocol:
    """One null shape a label, four distractors, each label transformed in four ways."""
    shapes = [EvaluatedShape(f"t{i}", "", f"label{i}", "null", 0) for i in range(n_labels)]
    shapes += [EvaluatedShape(f"u{i}", "", "chair") for i in range(4)]
    shapes += [
        EvaluatedShape(f"q{kind}{i}{s}", "", f"label{i}", kind, s)
        for kind in KINDS
        for i in range(n_labels)
        for s in range(1, strengths + 1)
    ]
    return make_protocol(shapes)


def distances(protocol: Protocol, seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return rng.random((len(protocol.queries), len(protocol.targets)))


def rankings(protocol: Protocol, *seeds: int) -> dict[str, Ranking]:
    return {
        f"model-{seed}": rank_queries(protocol, distances(protocol, seed).__getitem__)
        for seed in seeds
    }


def test_a_worked_example() -> None:
    """Two labels, two transformations; relevant targets at ranks 1, 2, 3 and 1."""
    protocol = make_protocol(
        [EvaluatedShape(f"t{i}", "", label, "null", 0) for i, label in enumerate("abc")]
        + [
            EvaluatedShape("u0", "", "a", "noise", 1),
            EvaluatedShape("u1", "", "b", "noise", 2),
            EvaluatedShape("u2", "", "a", "scale", 1),
            EvaluatedShape("u3", "", "b", "scale", 1),
        ]
    )
    matrix = np.array([[1, 2, 3], [1, 2, 3], [3, 1, 2], [2, 1, 3]], dtype=np.float64)
    found = summarise(protocol, {"m": rank_queries(protocol, matrix.__getitem__)}).to_json()
    assert found["table"] == {
        "scale": {"m": pytest.approx(100 * (1 / 3 + 1) / 2)},
        "noise": {"m": pytest.approx(100 * (1 + 1 / 2) / 2)},
    }
    assert list(found["table"]) == ["scale", "noise"]  # the order of Table 1
    assert found["by_strength"]["noise"] == {"1": {"m": 100.0}, "2": {"m": 50.0}}
    assert found["mean_average_precision"] == {"m": pytest.approx(100 * 17 / 24)}
    assert found["mean_of_rows"]["m"]["value"] == pytest.approx(100 * 17 / 24)
    measures = found["measures"]["m"]
    assert measures["nearest_neighbour"] == measures["first_tier"] == 50.0
    assert measures["second_tier"] == 75.0
    assert measures["map"] == pytest.approx(100 * 17 / 24)
    assert found["by_label"]["a"]["m"]["map"] == pytest.approx(100 * 2 / 3)
    assert found["precision_recall"]["m"][0] == [0.0, pytest.approx(100 * 17 / 24)]
    assert found["precision_recall"]["m"][-1][0] == 100.0
    assert found["differences"] == {}


def test_tables_are_means_over_their_queries() -> None:
    protocol = benchmark()
    ranked = rankings(protocol, 1, 2)
    found = summarise(protocol, ranked)
    assert list(found.table) == ["holes", "scale", "all", "melted"]
    for model, ranking in ranked.items():
        by_row: dict[str, list[float]] = {}
        by_cell: dict[tuple[str, int], list[float]] = {}
        for query, outcome in zip(protocol.queries.tolist(), ranking.outcomes, strict=True):
            shape = protocol.shapes[query]
            score = 1.0 / outcome.rank  # one relevant target a query
            by_row.setdefault(str(shape.transformation), []).append(score)
            by_cell.setdefault((str(shape.transformation), shape.strength or 0), []).append(score)
        for name, scores in by_row.items():
            assert found.table[name][model] == pytest.approx(np.mean(scores))
        for (name, strength), scores in by_cell.items():
            assert found.by_strength[name][strength][model] == pytest.approx(np.mean(scores))
        rows = [np.mean(scores) for scores in by_row.values()]
        assert found.mean_of_rows[model].value == pytest.approx(np.mean(rows))
        everything = np.concatenate(list(by_row.values()))
        assert found.mean_average_precision[model] == pytest.approx(everything.mean())
        assert found.mean_intervals[model].value == pytest.approx(everything.mean())
        measures = np.mean([astuple(one.measures) for one in ranking.outcomes], axis=0)
        assert_allclose(astuple(found.measures[model]), measures, rtol=1e-12)


def test_all_is_a_row_and_no_mean() -> None:
    protocol = benchmark()
    matrix = np.ones((len(protocol.queries), len(protocol.targets)))
    for place, query in enumerate(protocol.queries.tolist()):
        if protocol.shapes[query].transformation == "all":
            own = protocol.classes[protocol.targets] == protocol.classes[query]
            matrix[place, own] = 0.0  # only these are found at once
    found = summarise(protocol, {"m": rank_queries(protocol, matrix.__getitem__)})
    assert found.table["all"]["m"] == 1.0
    assert found.table["holes"]["m"] < 0.6
    assert found.mean_of_rows["m"].value == pytest.approx(
        np.mean([row["m"] for row in found.table.values()])
    )


def test_differences_are_paired_and_against_the_first_model() -> None:
    protocol = benchmark()
    ranked = rankings(protocol, 1, 2)
    found = summarise(protocol, {**ranked, "copy": ranked["model-1"]})
    assert list(found.differences) == ["model-2", "copy"]
    copy = found.differences["copy"]["mean_of_rows"]
    assert (copy.value, copy.low, copy.high) == (0.0, 0.0, 0.0)
    other = found.differences["model-2"]
    for name, means in (
        ("mean_of_rows", found.mean_of_rows),
        ("mean_average_precision", found.mean_intervals),
    ):
        expected = means["model-2"].value - means["model-1"].value
        assert other[name].value == pytest.approx(expected)


def test_the_result_does_not_depend_on_the_order_of_models() -> None:
    protocol = benchmark()
    ranked = rankings(protocol, 1, 2, 3)
    forth = summarise(protocol, ranked).to_json()
    back = summarise(protocol, dict(reversed(ranked.items()))).to_json()
    for name in ("table", "by_strength", "by_label", "measures", "mean_average_precision"):
        assert back[name] == forth[name]
    for model, its in forth["mean_of_rows"].items():
        assert back["mean_of_rows"][model] == pytest.approx(its, rel=1e-12)
    assert json.loads(json.dumps(forth)) == forth


def test_left_one_out_has_labels_but_no_rows() -> None:
    protocol = make_protocol(EvaluatedShape(f"{i:02}", "", "abc"[i % 3]) for i in range(12))
    matrix = np.random.default_rng(3).random((12, 12))
    found = summarise(protocol, {"m": rank_queries(protocol, matrix.__getitem__)})
    assert (found.table, found.by_strength, found.mean_of_rows) == ({}, {}, {})
    assert list(found.by_label) == ["a", "b", "c"]
    its = found.mean_intervals["m"]
    assert its.low is not None
    assert its.high is not None
    assert its.low <= its.value <= its.high
    assert its.value == pytest.approx(found.mean_average_precision["m"])


def test_unknown_transformations_come_last_by_name() -> None:
    names = ["zebra", "noise", "blur", "isometry", "view", "all", "noise", "affine"]
    expected = ["isometry", "noise", "all", "affine", "view", "blur", "zebra"]
    assert row_order(names) == expected
