"""The report of a kernel's training, as tables."""

from rich.table import Table

from proteus.client import Document
from proteus.terminal.output import Output
from proteus.terminal.tables import cell, facts_table, make_table

KERNELS = {"learned": "learned", "commute-time": "commute time", "heat": "heat, best time"}
FIGURES = {
    "heat_time": "best heat time t*",
    "slope": "slope of ln K² on ln λ",
    "trained_range": "eigenvalues learned from",
    "unit": "unit of eigenvalues",
    "n_pairs": "pairs learned from",
    "n_held_out_pairs": "pairs held out",
    "n_failed_pairs": "pairs that failed",
}


def show_kernel(output: Output, report: Document) -> None:
    """Show the report of a kernel's training."""
    low, high = report["trained_range"]
    shown = {**report, "trained_range": f"{low:.4g} to {high:.4g}"}
    output.console.print(facts_table({FIGURES[key]: shown.get(key) for key in FIGURES}))
    output.console.print(criteria_table(report["criterion"]))


def criteria_table(criterion: Document) -> Table:
    """Return the criterion of eq. (7), positives by negatives, of the learned and other kernels."""
    columns = ("classes learned from", "classes held out")
    title = "criterion (7): change by transformations / difference between shapes"
    table = make_table("kernel", *columns, title=title, numbers=columns)
    held_out = criterion["held-out"] or {}
    for key, name in KERNELS.items():
        table.add_row(name, cell(criterion["training"].get(key)), cell(held_out.get(key)))
    return table
