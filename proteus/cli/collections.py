"""``proteus collections``: list, create, show, delete."""

from typing import Annotated

import typer
from rich.table import Table

from proteus.cli.connection import Session, connected
from proteus.client import Document
from proteus.terminal.tables import cell, facts_table, make_table, time_cell

app = typer.Typer(help="Collections of shapes: list, create, show, delete.", no_args_is_help=True)

NameArgument = Annotated[
    str,
    typer.Argument(metavar="NAME", help="Lower-case letters, digits, - and _.", show_default=False),
]


@app.command("list")
@connected
def list_collections(session: Session) -> None:
    """List all collections."""
    found = list(session.client.pages("/v1/collections"))
    session.output.show(found, _table(found))


def _table(found: list[Document]) -> Table | str:
    if not found:
        return "No collections yet; [bold]proteus upload[/] makes one."
    numbers = ("shapes", "ready", "failed")
    table = make_table("name", "model", *numbers, "created", "description", numbers=numbers)
    for item in found:
        counts = [item["shape_count"], item["ready_count"], item["failed_count"]]
        table.add_row(
            cell(item["name"]), cell(item["model"]), *map(cell, counts),
            time_cell(item["created_at"]), cell(item["description"]),
        )  # fmt: skip
    return table


@app.command("create")
@connected
def create_collection(
    session: Session,
    name: NameArgument,
    description: Annotated[str, typer.Option(help="What is in it.")] = "",
    model: Annotated[
        str, typer.Option(help="Model of the collection. Default: the service's.")
    ] = "",
) -> None:
    """Create a collection."""
    body = {"name": name, "description": description or None, "model": model or None}
    body = {key: value for key, value in body.items() if value is not None}
    made = session.client.post("/v1/collections", body)
    session.output.show(made, f"created [bold]{cell(made['name'])}[/], model {cell(made['model'])}")


@app.command("show")
@connected
def show_collection(session: Session, name: NameArgument) -> None:
    """Show one collection."""
    found = session.client.get(f"/v1/collections/{name}")
    session.output.show(found, facts_table(found))


@app.command("delete")
@connected
def delete_collection(
    session: Session,
    name: NameArgument,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
) -> None:
    """Delete a collection and all of its shapes."""
    if not yes:
        found = session.client.get(f"/v1/collections/{name}")
        count = found["shape_count"]
        typer.confirm(f"Delete {name} with its {count} shapes?", abort=True, err=True)
    session.client.request("DELETE", f"/v1/collections/{name}")
    session.output.show({"deleted": name}, f"deleted [bold]{cell(name)}[/]")
