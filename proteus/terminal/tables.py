"""Tables and their cells, as the command line shows them."""

import json
from collections.abc import Mapping, Sequence

from rich.markup import escape
from rich.table import Table


def make_table(*columns: str, title: str | None = None, numbers: Sequence[str] = ()) -> Table:
    """Return a quiet table; the columns named in ``numbers`` are set to the right."""
    table = Table(box=None, header_style="bold", title=title, title_justify="left", pad_edge=False)
    for name in columns:
        table.add_column(
            name,
            justify="right" if name in numbers else "left",
            no_wrap=name in {"id", *numbers},
            overflow="fold",
        )
    return table


def cell(value: object) -> str:
    """Return a value as the text of a table's cell."""
    if value is None or value == "" or value == []:
        return "[dim]-[/]"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return escape("\n".join(str(item) for item in value))
    if isinstance(value, dict):
        return escape(json.dumps(value, ensure_ascii=False))
    return escape(str(value))


def time_cell(text: str | None) -> str:
    """Return a moment without its parts of a second."""
    return cell(text[:19].replace("T", " ") if text else None)


STATE_STYLES = {
    "ready": "green",
    "succeeded": "green",
    "failed": "red",
    "cancelled": "yellow",
    "processing": "cyan",
    "running": "cyan",
}


def state_cell(state: str) -> str:
    """Return a state in its colour."""
    style = STATE_STYLES.get(state)
    return f"[{style}]{escape(state)}[/]" if style else escape(state)


def facts_table(document: dict[str, object], *, leave_out: Sequence[str] = ()) -> Table:
    """Return one object as a table of two columns."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in document.items():
        if name not in leave_out:
            table.add_row(name, state_cell(str(value)) if name == "state" else cell(value))
    return table


def errors_table(errors: Sequence[Mapping[str, object]], *, title: str) -> Table:
    """Return a table of items that failed, each with its reason."""
    table = make_table("item", "reason", title=title)
    for error in errors:
        table.add_row(cell(error.get("item")), cell(error.get("detail") or error.get("type")))
    return table
