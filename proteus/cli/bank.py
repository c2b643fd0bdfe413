"""The report of a bank's training, as tables."""

from collections.abc import Mapping
from typing import Any

from rich.markup import escape
from rich.table import Table

from proteus.client import Document
from proteus.terminal.output import Output
from proteus.terminal.tables import cell, facts_table, make_table

FACTS = {
    "n_references": "shapes learned from",
    "n_queries": "transformed copies",
    "n_groups": "groups of similar shapes",
    "n_failed_variants": "variants that failed",
    "n_candidates": "candidate channels",
    "share_that_sees_scale": "weight of channels that see scale",
}
PARTS = {"training": "learned from", "held_out": "held out"}
OF_WINDOWS = {"bank": "bank alone", "with_windows": "with windows"}


def show_bank(output: Output, model: Document) -> None:
    """Show a bank's channels, and the report of its training."""
    report = model["training"]
    output.console.print(facts_table({FACTS[key]: report.get(key) for key in FACTS}))
    output.console.print(rows_table(report["rows"], PARTS))
    output.console.print(channels_table(model["channels"], report["ablation"]))
    if report["similarity"]:
        output.console.print(similarity_table(report["similarity"]))
    if "windows" in report:
        _show_windows(output, report["windows"])


def _show_windows(output: Output, report: Document) -> None:
    """Show what windows add on groups not learned from, or why they were not learned."""
    if report["learned"]:
        output.console.print(rows_table(report["rows"], OF_WINDOWS))
    else:
        reason = escape(report["reason"])
        output.console.print(f"windows are compared as the model proteus does: {reason}")


def rows_table(rows: Document, names: Mapping[str, str]) -> Table:
    """Return mean average precision by transformation, a column for each name that has rows."""
    parts = [part for part in names if part in rows]
    headings = [names[part] for part in parts]
    title = "copies that find their shape, mean average precision in per cent"
    table = make_table("transformation", *headings, title=title, numbers=headings)
    for transformation in rows[parts[0]]["map"]:
        values = (rows[part]["map"].get(transformation) for part in parts)
        table.add_row(cell(transformation), *map(_figure, values))
    table.add_section()
    table.add_row("mean of the rows", *(_figure(rows[part]["mean"]) for part in parts))
    intervals = (rows[part]["interval"] for part in parts)
    table.add_row("95 % of a bootstrap", *map(_interval, intervals))
    return table


def channels_table(channels: list[Document], ablation: list[Document]) -> Table:
    """Return channels with their weights, and what is lost without each."""
    lost = {entry["channel"]: entry["lost"] for entry in ablation}
    headings = ("weight", "scale", "lost without it")
    table = make_table("channel", *headings, title="channels", numbers=headings)
    for channel in channels:
        weight, scale = f"{channel['weight']:.3f}", f"{channel['scale']:.3g}"
        table.add_row(cell(channel["name"]), weight, scale, _figure(lost.get(channel["name"])))
    return table


def similarity_table(similarity: list[Document]) -> Table:
    """Return the share of impostors that come closer: as similarity promises, and as found."""
    headings = ("promised", "found among held out")
    title = "share of impostors that come closer"
    table = make_table(*headings, title=title, numbers=headings)
    for entry in similarity:
        table.add_row(f"{entry['promised']:.1%}", f"{entry['found']:.1%}")
    return table


def _figure(value: Any) -> str:
    return "-" if value is None else f"{round(value, 1) + 0.0:.1f}"  # no -0.0


def _interval(ends: list[float] | None) -> str:
    return "-" if ends is None else f"{ends[0]:.1f} to {ends[1]:.1f}"
