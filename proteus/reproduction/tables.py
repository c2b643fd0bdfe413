"""Table 1 and the table of open against closed, as rows of numbers."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from proteus.client import Document
from proteus.reproduction import paper

COLUMNS = ("heat-short", "heat-best", "heat-long", "learned", "commute", "distance")
HEADINGS: Mapping[str, str] = {
    "heat-short": "Heat, 0.7 t*",
    "heat-best": "Heat, t* (optimal param.)",
    "heat-long": "Heat, 1.7 t*",
    "learned": "Optimal non-param.",
    "commute": "Commute time",
    "distance": "Learned on distances, λ/λ₁",
}
PAPER_HEADINGS: Mapping[str, str] = {
    "heat-short": "Heat, t = 700",
    "heat-best": "Heat, t* = 1011",
    "heat-long": "Heat, t = 1700",
    "learned": "Optimal non-param.",
    "commute": "Commute time",
}
MEAN = "mean of the rows"


@dataclass(frozen=True)
class Table:
    """Mean average precision in per cent.

    Attributes
    ----------
    columns : tuple of str
        Keys of columns.
    rows : dict
        By transformation, and ``MEAN`` last: a number for each column, None where there is none.
    """

    columns: tuple[str, ...]
    rows: dict[str, list[float | None]]

    def best(self, row: str) -> set[int]:
        """Return which columns of a row have its highest number, to two decimals."""
        numbers = [None if x is None else round(x, 2) for x in self.rows[row]]
        known = [x for x in numbers if x is not None]
        return {i for i, x in enumerate(numbers) if known and x == max(known)}

    def to_json(self) -> dict[str, Any]:
        """Return it as ``{row: {column: number}}``."""
        return {name: dict(zip(self.columns, row, strict=True)) for name, row in self.rows.items()}

    def to_csv(self, headings: Mapping[str, str]) -> str:
        """Return it as CSV with a line of headings."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["transformation", *(headings[key] for key in self.columns)])
        for name, row in self.rows.items():
            writer.writerow([name, *("" if x is None else f"{x:.2f}" for x in row)])
        return text.getvalue()


def measured_table(evaluation: Document, names: Mapping[str, str]) -> Table:
    """Return an evaluation's table.

    Parameters
    ----------
    evaluation : dict
        As the service answers it.
    names : mapping
        Column to model, in the order of the columns.
    """
    rows: dict[str, list[float | None]] = {
        row: [found.get(model) for model in names.values()]
        for row, found in evaluation["table"].items()
    }
    return Table(tuple(names), with_mean(rows))


def paper_table(rows: Sequence[str]) -> Table:
    """Return some rows of the paper's Table 1."""
    known: dict[str, list[float | None]] = {
        row: [paper.TABLE[row][key] for key in paper.COLUMNS] for row in rows if row in paper.TABLE
    }
    return Table(paper.COLUMNS, with_mean(known))


def with_mean(rows: dict[str, list[float | None]]) -> dict[str, list[float | None]]:
    """Return the rows followed by the mean of each column."""
    if not rows:
        return {}
    means: list[float | None] = []
    for column in zip(*rows.values(), strict=True):
        numbers = [x for x in column if x is not None]
        means.append(sum(numbers) / len(numbers) if len(numbers) == len(column) else None)
    return {**rows, MEAN: means}


def difference(first: Table, second: Table) -> Table:
    """Return the second table minus the first, in points."""
    rows = {
        name: [
            None if a is None or b is None else b - a
            for a, b in zip(row, second.rows[name], strict=True)
        ]
        for name, row in first.rows.items()
        if name in second.rows
    }
    return Table(first.columns, rows)
