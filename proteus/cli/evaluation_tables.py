"""The tables of an evaluation, as a screen shows them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proteus.client import Document
from proteus.terminal.tables import cell, make_table

MOST_LABELS = 60
MEASURES = {
    "nearest_neighbour": "nearest neighbour",
    "first_tier": "first tier",
    "second_tier": "second tier",
    "e_measure": "E-measure",
    "dcg": "discounted cumulative gain",
    "map": "mean average precision",
}


@dataclass(frozen=True)
class Figures:
    """A table with a column for each model; several tables where the screen is too narrow for one.

    Attributes
    ----------
    first : str
        Heading of the rows' names.
    models : list of str
    rows : list of (name, a figure for each model)
        As markup.
    """

    first: str
    models: list[str]
    rows: list[tuple[str, list[str]]] = field(default_factory=list)

    def add(self, name: str, figures: list[str]) -> None:
        """Add a row."""
        self.rows.append((name, figures))

    def tables(self, width: int) -> Iterator[Table]:
        """Tables of at most this many characters, if one model fits: no figure is ever cut."""
        for chosen in self._blocks(width):
            heads = [escape(self.models[i]) for i in chosen]
            table = make_table(self.first, *heads, numbers=heads)
            table.columns[0].no_wrap = True
            for name, figures in self.rows:
                table.add_row(name, *(figures[i] for i in chosen))
            yield table

    def _blocks(self, width: int) -> Iterator[list[int]]:
        """Numbers of the models that stand side by side."""
        names = _width([escape(self.first), *(name for name, _ in self.rows)])
        block: list[int] = []
        used = names
        for i, model in enumerate(self.models):
            needed = _GAP + _width([escape(model), *(figures[i] for _, figures in self.rows)])
            if block and used + needed > width:
                yield block
                block, used = [], names
            block.append(i)
            used += needed
        yield block


_GAP = 2  # characters between columns


def _width(texts: Sequence[str]) -> int:
    """Characters of the longest."""
    return max(Text.from_markup(text).cell_len for text in texts)


def transformation_table(found: Document) -> Figures:
    """Table 1: mean average precision by transformation, the best of each row marked."""
    table = _table(found, "transformation")
    for name, row in found["table"].items():
        table.add(cell(name), _marked([row[model] for model in found["models"]]))
    _add_mean(table, found, "mean of rows", found["mean_of_rows"])
    return table


def strength_table(found: Document) -> Figures:
    """The same by strength."""
    table = _table(found, "transformation")
    for name, rows in found["by_strength"].items():
        for strength, row in rows.items():
            values = [row[model] for model in found["models"]]
            table.add(f"{cell(name)} {escape(strength)}", _marked(values))
    return table


def label_table(found: Document) -> Figures:
    """Mean average precision by label; of many labels those that are found worst."""
    models = found["models"]
    rows = {
        name: [row[model]["map"] for model in models] for name, row in found["by_label"].items()
    }
    kept = sorted(rows, key=lambda name: (max(rows[name]), name))[:MOST_LABELS]
    table = _table(found, "label")
    for name in sorted(kept):
        table.add(cell(name), _marked(rows[name]))
    _add_mean(table, found, "mean of queries", found["mean_intervals"])
    return table


def measures_table(found: Document) -> Figures:
    """Every measure over all queries."""
    table = _table(found, "measure")
    for key, name in MEASURES.items():
        table.add(name, _marked([found["measures"][model][key] for model in found["models"]]))
    return table


def difference_lines(found: Document) -> list[str]:
    """Return how far each model is above the first, and whether that may be chance."""
    lines = []
    for model, differences in found["differences"].items():
        its = differences.get("mean_of_rows") or differences["mean_average_precision"]
        sure = its["low"] is not None and (its["low"] > 0 or its["high"] < 0)
        doubt = "" if sure else " [dim](may be chance)[/]"
        first = escape(found["models"][0])
        lines.append(
            f"{escape(model)} - {first}: {its['value']:+.1f}{_bounds(its, sign='+')}{doubt}"
        )
    return lines


def worst_queries(found: Document, count: int) -> list[Document]:
    """Return the queries that the best model answers worst, by the rank of their first target."""
    best = best_model(found)
    missed = [row for row in found["ranks"] if row["model"] == best and row["rank"] > 1]
    return sorted(missed, key=lambda row: -row["rank"])[:count]


def worst_table(rows: Sequence[Document], names: Mapping[str, str]) -> Table:
    """Return queries with the rank of their first relevant target, and the first match instead."""
    table = make_table("query", "rank", "first instead", numbers=("rank",))
    for row in rows:
        table.add_row(cell(names[row["query"]]), str(row["rank"]), cell(names[row["top"][0]]))
    return table


def best_model(found: Document) -> str:
    """Return the model with the highest mean; of equals the first."""
    means = found["mean_of_rows"] or found["mean_intervals"]
    models: list[str] = found["models"]
    return max(models, key=lambda model: float(means[model]["value"]))


def _table(found: Document, first: str) -> Figures:
    return Figures(first, list(found["models"]))


def _add_mean(table: Figures, found: Document, name: str, means: Mapping[str, Document]) -> None:
    values = _marked([means[model]["value"] for model in found["models"]])
    table.add(f"[bold]{name}[/]", values)
    bounds = [_bounds(means[model]).strip() for model in found["models"]]
    table.add("[dim]95 % interval[/]", [f"[dim]{escape(text)}[/]" for text in bounds])


def _marked(values: Sequence[float]) -> list[str]:
    """Figures with one digit after the point; a star at the best, where there is a choice."""
    best = f"{max(values):.1f}"
    texts = [f"{value:.1f}" for value in values]
    if len(texts) < 2:
        return texts
    return [f"[bold]{text}*[/]" if text == best else f"{text} " for text in texts]


def _bounds(its: Document, *, sign: str = "") -> str:
    """Return an interval in brackets; nothing where all queries are of one label."""
    if its["low"] is None:
        return ""
    return f" ({its['low']:{sign}.1f} to {its['high']:{sign}.1f})"
