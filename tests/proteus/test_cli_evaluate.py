"""``proteus evaluate``: what is asked, what is shown, what is written."""

import csv
import io
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from typer.testing import CliRunner, Result

from proteus.cli.evaluation_tables import Figures, best_model, difference_lines, worst_queries
from proteus.cli.program import app
from proteus.client import Client
from tests.proteus.fake_service import FakeService

Json = dict[str, Any]
Run = Callable[..., Result]


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
    "skipped": [
        {"reason": "no-label", "count": 5, "shapes": [{"id": f"{i}", "name": f"x{i}.off"}
                                                      for i in range(5)]}
    ],
    "ranks": [
        {"query": f"shape-{i}", "model": model, "rank": rank, "top": ["shape-0", "shape-1"]}
        for i, ranks in enumerate([(9, 1), (2, 3), (1, 2)], 1)
        for model, rank in zip(("heat", "mine"), ranks, strict=True)
    ],
    "created_at": "2026-01-01T00:00:00Z",
}  # fmt: skip


@pytest.fixture
def fake() -> FakeService:
    fake = FakeService()
    fake.evaluation = EVALUATION
    for name in ("cat.null.0.off", "cat.holes.3.off", "dog.holes.3.off"):
        fake.add_shape("shrec", name, name[:3], name.encode())
    fake.collections["shrec"] = {"name": "shrec", "model": "heat"}
    return fake


@pytest.fixture
def run(fake: FakeService, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.setattr(
        "proteus.cli.connection.Client", partial(Client, transport=fake.transport())
    )
    monkeypatch.setattr("proteus.client.time.sleep", lambda seconds: None)
    return lambda *arguments: CliRunner().invoke(app, ["evaluate", *arguments])


def lines(result: Result) -> list[list[str]]:
    assert result.exit_code == 0, result.output
    return [line.split() for line in result.stdout.splitlines()]


def test_the_table_is_shown_with_the_best_of_each_row_marked(run: Run, fake: FakeService) -> None:
    shown = lines(run("shrec", "-m", "heat", "-m", "mine"))
    assert fake.queries == [{"collection": "shrec", "models": ["heat", "mine"]}]
    assert ["holes", "70.0", "88.5*"] in shown
    assert ["all", "61.0*", "61.0*"] in shown  # level as far as they are shown
    assert ["mean", "of", "rows", "65.5", "74.7*"] in shown
    text = " ".join(" ".join(line) for line in shown)
    assert "shrec: 4 queries, 3 targets" in text
    assert "(41.2 to 90.1) (58.8 to 91.3)" in text
    assert "mine - heat: +9.2 (-1.5 to +17.3) (may be chance)" in text
    assert "not asked with, no label: 5 (x0.off, x1.off, x2.off, …)" in text
    assert "mean average precision 65.5 74.7*" in text


def test_the_worst_queries_of_the_best_model_are_named(run: Run) -> None:
    """The third is gone meanwhile."""
    shown = lines(run("shrec", "-m", "heat", "-m", "mine"))
    at = shown.index(["worst", "queries", "under", "mine"])
    assert shown[at + 2] == ["dog.holes.3.off", "3", "cat.null.0.off"]
    assert shown[at + 3] == ["shape-3", "(deleted)", "2", "cat.null.0.off"]
    assert len(shown) == at + 4  # the query that found its shape at once is none of them
    assert not any("worst" in line for line in lines(run("shrec", "--worst", "0")))


def test_without_a_model_it_is_the_collections_own(run: Run, fake: FakeService) -> None:
    lines(run("shrec", "--dissimilarity", "chi-squared"))
    assert fake.queries == [
        {"collection": "shrec", "models": ["heat"], "dissimilarity": "chi-squared"}
    ]


def test_strengths_are_shown_when_asked_for(run: Run) -> None:
    row = ["holes", "3", "70.0", "88.5*"]
    assert row not in lines(run("shrec"))
    assert row in lines(run("shrec", "--by-strength"))


def test_json_is_the_evaluation_and_nothing_else(run: Run) -> None:
    assert json.loads(run("shrec", "--json").stdout) == EVALUATION


def test_csv_has_all_digits(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    lines(run("shrec", "--csv", str(path)))
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [
        ["transformation", "strength", "heat", "mine"],
        ["holes", "", "70.04", "88.5"],
        ["holes", "3", "70.04", "88.5"],
        ["all", "", "61.0", "60.98"],
        ["all", "3", "61.0", "60.98"],
        ["mean", "", "65.5", "74.7"],
        ["mean, low", "", "41.2", "58.8"],
        ["mean, high", "", "90.1", "91.3"],
    ]
    result = run("shrec", "--csv", str(tmp_path / "none" / "table.csv"))
    assert result.exit_code == 1
    assert "No such file" in result.stderr


def test_left_one_out_it_is_a_table_by_label(run: Run, fake: FakeService, tmp_path: Path) -> None:
    alone = {"table": {}, "by_strength": {}, "mean_of_rows": {}, "leave_one_out": True}
    differences = {"mine": {"mean_average_precision": its(9.2, 1.5, 17.3)}}
    fake.evaluation = {**EVALUATION, **alone, "differences": differences}
    path = tmp_path / "labels.csv"
    shown = lines(run("shrec", "-m", "heat", "-m", "mine", "--csv", str(path)))
    assert ["dog", "41.0", "58.4*"] in shown
    assert ["mean", "of", "queries", "65.5", "74.7*"] in shown
    text = " ".join(" ".join(line) for line in shown)
    assert "leave one out" in text
    assert "may be chance" not in text
    assert path.read_text().splitlines()[1] == "cat,,90.0,91.0"


def test_of_many_labels_the_lowest_are_shown(run: Run, fake: FakeService) -> None:
    many = {f"label-{i}": {"heat": measures(float(i)), "mine": measures(0.0)} for i in range(99)}
    alone = {"table": {}, "by_strength": {}, "mean_of_rows": {}, "leave_one_out": True}
    fake.evaluation = {**EVALUATION, **alone, "by_label": many}
    text = run("shrec").stdout
    assert "the 60 lowest of 99 labels" in text
    assert "label-59 " in text
    assert "label-60 " not in text


def test_one_label_has_no_interval_and_one_model_no_star() -> None:
    alone = {**EVALUATION, "models": ["mine"], "differences": {}}
    assert best_model(alone) == "mine"
    assert difference_lines(alone) == []
    unsure = {"mine": {"mean_of_rows": its(9.2, None, None)}}
    (line,) = difference_lines({**EVALUATION, "differences": unsure})
    assert line == "mine - heat: +9.2 [dim](may be chance)[/]"
    assert [row["query"] for row in worst_queries(EVALUATION, 1)] == ["shape-2"]


def test_a_failed_job_says_why(
    run: Run, fake: FakeService, monkeypatch: pytest.MonkeyPatch
) -> None:
    new_job = fake.new_job
    lost = [
        {"item": "mine", "type": "model-not-found", "detail": "there is no model named 'mine'"}
    ] * 9
    monkeypatch.setattr(fake, "new_job", partial(new_job, errors=lost))
    result = run("shrec")
    assert result.exit_code == 1
    assert "there is no model named 'mine'" in result.stderr


@pytest.mark.parametrize("width", [48, 80, 200])
def test_no_figure_and_no_name_is_cut_on_a_narrow_screen(width: int) -> None:
    models = [f"a-model-of-some-length-{i}" for i in range(11)]
    figures = Figures("transformation", models)
    figures.add("holes", [f"{60 + i}.5" for i in range(11)])
    console = Console(width=width, record=True, file=io.StringIO())
    for table in figures.tables(width):
        console.print(table)
    lines = console.export_text().splitlines()
    assert max(map(len, lines)) <= width
    heads = [name for line in lines if line.startswith("transformation") for name in line.split()]
    shown = [text for line in lines if line.startswith("holes") for text in line.split()]
    assert [name for name in heads if name != "transformation"] == models
    assert [text for text in shown if text != "holes"] == [f"{60 + i}.5" for i in range(11)]
