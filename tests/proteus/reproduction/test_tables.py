import csv
import io

import pytest

from proteus.reproduction import paper
from proteus.reproduction.tables import (
    HEADINGS,
    MEAN,
    PAPER_HEADINGS,
    Table,
    difference,
    measured_table,
    paper_table,
)
from workers.transformations import PAPER_TRANSFORMATIONS

NAMES = {"learned": "model-a", "commute": "model-b"}
EVALUATION = {
    "table": {
        "holes": {"model-a": 60.0, "model-b": 70.004},
        "scale": {"model-a": 90.0, "model-b": 70.0},
    }
}


def test_the_papers_table_has_its_rows_in_order_and_its_known_means() -> None:
    table = paper_table(PAPER_TRANSFORMATIONS)
    assert tuple(table.rows) == (*PAPER_TRANSFORMATIONS, MEAN)
    assert table.rows["partial"] == [5.54, 6.01, 7.37, 8.06, 31.03]
    means = [round(x or 0.0, 1) for x in table.rows[MEAN]]
    assert means == [76.2, 77.4, 76.8, 80.6, 82.9]
    assert [paper.row_mean(key) for key in paper.COLUMNS] == pytest.approx(table.rows[MEAN])


def test_measured_rows_keep_their_order_and_end_with_their_mean() -> None:
    table = measured_table(EVALUATION, NAMES)
    assert table.columns == ("learned", "commute")
    assert table.rows["holes"] == [60.0, 70.004]
    assert table.rows[MEAN] == [75.0, pytest.approx(70.002)]
    assert table.best("holes") == {1}
    assert table.best(MEAN) == {0}


def test_equal_numbers_are_best_together_and_what_is_missing_never() -> None:
    table = Table(("a", "b", "c"), {"row": [1.001, 1.0, None], "none": [None, None, None]})
    assert table.best("row") == {0, 1}
    assert table.best("none") == set()


def test_a_difference_is_of_the_rows_that_both_have() -> None:
    first = measured_table(EVALUATION, NAMES)
    second = Table(first.columns, {"holes": [61.0, 70.004], "noise": [1.0, 2.0]})
    assert difference(first, second).rows == {"holes": [1.0, 0.0]}


def test_csv_has_a_heading_and_two_decimals() -> None:
    rows = list(csv.reader(io.StringIO(measured_table(EVALUATION, NAMES).to_csv(HEADINGS))))
    assert rows[0] == ["transformation", "Optimal non-param.", "Commute time"]
    assert rows[1] == ["holes", "60.00", "70.00"]
    assert rows[-1][0] == MEAN
    assert len(paper_table(["holes"]).to_csv(PAPER_HEADINGS).splitlines()) == 3
