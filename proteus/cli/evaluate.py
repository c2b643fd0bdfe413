"""``proteus evaluate``: how well models find the shapes of a labelled collection."""

import csv
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from proteus import evaluations
from proteus.cli.connection import Session, connected
from proteus.cli.evaluation_tables import (
    MOST_LABELS,
    Figures,
    best_model,
    difference_lines,
    label_table,
    measures_table,
    strength_table,
    transformation_table,
    worst_queries,
    worst_table,
)
from proteus.client import Client, Document, ServiceError


@connected
def evaluate(
    session: Session,
    collection: Annotated[str, typer.Argument(metavar="COLLECTION", show_default=False)],
    models: Annotated[
        list[str] | None,
        typer.Option(
            "--model", "-m", help="Model to measure. Repeatable. Default: the collection's."
        ),
    ] = None,
    dissimilarity: Annotated[
        str, typer.Option(help="Another dissimilarity than the models'.")
    ] = "",
    by_strength: Annotated[
        bool, typer.Option("--by-strength", help="Show a row for each strength.")
    ] = False,
    worst: Annotated[int, typer.Option(min=0, help="Number of worst queries to show.")] = 10,
    csv_file: Annotated[
        Path | None, typer.Option("--csv", dir_okay=False, help="Also write the table as CSV.")
    ] = None,
) -> None:
    """Measure models on a collection whose shapes have labels.

    Transformed shapes, named <label>.<transformation>.<strength>.off, are the queries. All others
    are searched. An answer is right if it has the label of its query. If no shape is transformed,
    each shape is a query against the rest.
    """
    client = session.client
    chosen = models or [str(client.get(f"/v1/collections/{collection}")["model"])]
    found = evaluations.evaluate(
        client, session.output, collection, chosen, dissimilarity=dissimilarity
    )
    if session.output.as_json:
        session.output.document(found)
    else:
        show(session, found, by_strength=by_strength, worst=worst)
    if csv_file is not None:
        write_csv(csv_file, found)


def show(session: Session, found: Document, *, by_strength: bool, worst: int) -> None:
    """Print the tables of an evaluation."""
    console = session.output.console
    console.print(
        f"[bold]{escape(found['collection'])}[/]: {found['n_queries']} queries, "
        f"{found['n_targets']} targets" + ", leave one out" * found["leave_one_out"]
    )
    for group in found["skipped"]:
        names = ", ".join(shape["name"] for shape in group["shapes"][:3])
        more = ", …" if group["count"] > 3 else ""
        reason = group["reason"].replace("-", " ")
        console.print(f"[dim]not queries, {reason}: {group['count']} ({escape(names)}{more})[/]")
    lowest = f", the {MOST_LABELS} lowest of {len(found['by_label'])} labels"
    if found["leave_one_out"]:
        shown = lowest if len(found["by_label"]) > MOST_LABELS else ""
        _print(console, f"mean average precision, per cent{shown}", label_table(found))
    else:
        _print(console, "mean average precision, per cent", transformation_table(found))
    for line in difference_lines(found):
        console.print(line)
    if by_strength and found["by_strength"]:
        _print(console, "by strength", strength_table(found))
    _print(console, "over all queries, per cent", measures_table(found))
    if rows := worst_queries(found, worst):
        console.print(f"\n[italic]worst queries under {escape(best_model(found))}[/]")
        console.print(worst_table(rows, _names(session.client, rows)))


def _print(console: Console, title: str, figures: Figures) -> None:
    """Print a table under its title, in pieces where the screen is too narrow."""
    console.print(f"\n[italic]{title}[/]")
    for number, table in enumerate(figures.tables(console.width)):
        if number:
            console.print()
        console.print(table)


def write_csv(path: Path, found: Document) -> None:
    """Write the table, by strength too; where one was left out, by label."""
    models = found["models"]
    rows: list[list[object]] = []
    for name, row in found["table"].items():
        rows.append([name, "", *(row[model] for model in models)])
        for strength, cells in found["by_strength"][name].items():
            rows.append([name, strength, *(cells[model] for model in models)])
    if found["leave_one_out"]:
        for name, row in found["by_label"].items():
            rows.append([name, "", *(row[model]["map"] for model in models)])
    means = found["mean_of_rows"] or found["mean_intervals"]
    for name, bound in (("mean", "value"), ("mean, low", "low"), ("mean, high", "high")):
        rows.append([name, "", *(means[model][bound] for model in models)])
    head = "label" if found["leave_one_out"] else "transformation"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([head, "strength", *models])
        writer.writerows(rows)


def _names(client: Client, rows: list[Document]) -> dict[str, str]:
    """Names of the shapes in some ranks, by id; of those that are gone, their ids."""
    names = {}
    for shape_id in {row["query"] for row in rows} | {row["top"][0] for row in rows}:
        try:
            names[shape_id] = str(client.get(f"/v1/shapes/{shape_id}")["name"])
        except ServiceError as error:
            if error.status != 404:
                raise
            names[shape_id] = f"{shape_id} (deleted)"
    return names
