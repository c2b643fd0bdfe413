"""Tables of evaluations that no small collection gives, held to the service's own description."""

import io
from typing import Any

import jsonschema_rs
import pytest
from rich.console import Console

from proteus.cli.evaluation_tables import (
    Figures,
    best_model,
    difference_lines,
    label_table,
    transformation_table,
    worst_queries,
)
from service.app import create_app
from workers.settings import Settings

Json = dict[str, Any]


def its(value: float, low: float | None, high: float | None) -> Json:
    return {"value": value, "low": low, "high": high}


def measures(average_precision: float) -> Json:
    names = ("nearest_neighbour", "first_tier", "second_tier", "e_measure", "dcg")
    return {**dict.fromkeys(names, 50.0), "map": average_precision}


TABLE = {"holes": {"heat": 70.04, "mine": 88.5}, "all": {"heat": 61.0, "mine": 60.98}}
EVALUATION: Json = {
    "id": "evaluation-0", "job_id": "job-0", "collection": "shrec", "models": ["heat", "mine"],
    "dissimilarity": None, "state": "succeeded", "n_queries": 4, "n_targets": 3,
    "leave_one_out": False,
    "mean_average_precision": {"heat": 65.5, "mine": 74.7},
    "table": TABLE,
    "by_strength": {name: {"3": row} for name, row in TABLE.items()},
    "by_label": {
        "cat": {"heat": measures(90.0), "mine": measures(91.0)},
        "dog": {"heat": measures(41.0), "mine": measures(58.4)},
    },
    "measures": {"heat": measures(65.5), "mine": measures(74.7)},
    "precision_recall": {},
    "mean_of_rows": {"heat": its(65.5, 41.2, 90.1), "mine": its(74.7, 58.8, 91.3)},
    "mean_intervals": {"heat": its(65.5, 41.2, 90.1), "mine": its(74.7, 58.8, 91.3)},
    "differences": {
        "mine": {"mean_of_rows": its(9.2, -1.5, 17.3), "mean_average_precision": its(9.2, 1, 2)}
    },
    "skipped": [],
    "ranks": [
        {"query": f"shape-{i}", "model": model, "rank": rank, "top": ["shape-0", "shape-1"]}
        for i, ranks in enumerate([(9, 1), (2, 3), (1, 2)], 1)
        for model, rank in zip(("heat", "mine"), ranks, strict=True)
    ],
    "created_at": "2026-01-01T00:00:00Z",
}  # fmt: skip
LEFT_ONE_OUT: Json = {
    **EVALUATION,
    "table": {}, "by_strength": {}, "mean_of_rows": {}, "leave_one_out": True,
    "differences": {
        "mine": {"mean_of_rows": None, "mean_average_precision": its(9.2, 1.5, 17.3)}
    },
    "by_label": {
        f"label-{i}": {"heat": measures(float(i)), "mine": measures(0.0)} for i in range(99)
    },
}  # fmt: skip


def printed(figures: Figures, width: int = 140) -> list[str]:
    """Lines of a table."""
    console = Console(width=width, record=True, file=io.StringIO())
    for table in figures.tables(width):
        console.print(table)
    return console.export_text().splitlines()


@pytest.mark.parametrize("document", [EVALUATION, LEFT_ONE_OUT])
def test_these_evaluations_are_such_as_the_service_answers(document: Json) -> None:
    schema = create_app(Settings()).openapi()
    wanted = {"$ref": "#/components/schemas/EvaluationAnswer", "components": schema["components"]}
    jsonschema_rs.validate(wanted, document)
    with pytest.raises(jsonschema_rs.ValidationError):
        jsonschema_rs.validate(wanted, {**document, "state": "asleep"})


def test_the_best_of_each_row_is_marked_and_both_where_they_look_alike() -> None:
    rows = [line.split() for line in printed(transformation_table(EVALUATION))]
    assert ["holes", "70.0", "88.5*"] in rows
    assert ["all", "61.0*", "61.0*"] in rows
    assert ["mean", "of", "rows", "65.5", "74.7*"] in rows
    assert "(41.2 to 90.1) (58.8 to 91.3)" in " ".join(" ".join(row) for row in rows)


def test_a_difference_that_may_be_chance_says_so() -> None:
    (line,) = difference_lines(EVALUATION)
    assert line == "mine - heat: +9.2 (-1.5 to +17.3) [dim](may be chance)[/]"
    (sure,) = difference_lines(LEFT_ONE_OUT)
    assert sure == "mine - heat: +9.2 (+1.5 to +17.3)"


def test_of_many_labels_the_lowest_are_shown() -> None:
    text = "\n".join(printed(label_table(LEFT_ONE_OUT)))
    assert "label-59 " in text
    assert "label-60 " not in text


def test_the_worst_queries_are_those_of_the_best_model_that_miss() -> None:
    worst = worst_queries(EVALUATION, 5)
    assert [(row["query"], row["rank"]) for row in worst] == [("shape-2", 3), ("shape-3", 2)]
    assert [row["query"] for row in worst_queries(EVALUATION, 1)] == ["shape-2"]


def test_one_label_has_no_interval_and_one_model_no_difference() -> None:
    alone = {**EVALUATION, "models": ["mine"], "differences": {}}
    assert best_model(alone) == "mine"
    assert difference_lines(alone) == []
    unsure = {"mine": {"mean_of_rows": its(9.2, None, None)}}
    (line,) = difference_lines({**EVALUATION, "differences": unsure})
    assert line == "mine - heat: +9.2 [dim](may be chance)[/]"


@pytest.mark.parametrize("width", [48, 80, 200])
def test_no_figure_and_no_name_is_cut_on_a_narrow_screen(width: int) -> None:
    models = [f"a-model-of-some-length-{i}" for i in range(11)]
    figures = Figures("transformation", models)
    figures.add("holes", [f"{60 + i}.5" for i in range(11)])
    lines = printed(figures, width)
    assert max(map(len, lines)) <= width
    heads = [name for line in lines if line.startswith("transformation") for name in line.split()]
    shown = [text for line in lines if line.startswith("holes") for text in line.split()]
    assert [name for name in heads if name != "transformation"] == models
    assert [text for text in shown if text != "holes"] == [f"{60 + i}.5" for i in range(11)]
