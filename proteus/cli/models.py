"""``proteus models``: list, show, train, activate."""

from typing import Annotated

import typer
from rich.table import Table

from proteus.cli.connection import Session, connected
from proteus.cli.training import Method, show_training, train
from proteus.client import Document
from proteus.terminal.tables import cell, errors_table, facts_table, make_table, state_cell
from proteus.terminal.waiting import require_success, wait_for_job

app = typer.Typer(
    help="Models, which say how shapes are described and compared: list, show, train, activate.",
    no_args_is_help=True,
)
app.command("train")(train)

NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="The model's name.")]
CHANNEL_FIELDS = ("name", "view", "feature", "normalisation", "dissimilarity", "scale", "weight")


@app.command("list")
@connected
def list_models(session: Session) -> None:
    """List all models."""
    found = list(session.client.pages("/v1/models"))
    table = make_table("name", "method", "state", "channels", "parameters", numbers=("channels",))
    for model in found:
        table.add_row(
            cell(model["name"]), cell(model["method"]), state_cell(model["state"]),
            str(len(model["channels"])), cell(model["parameters"] or None),
        )  # fmt: skip
    session.output.show(found, table)


@app.command("show")
@connected
def show_model(session: Session, name: NameArgument) -> None:
    """Show one model, its channels, and the report of its training."""
    found = session.client.get(f"/v1/models/{name}")
    facts = {**found, "views": [_steps(view) for view in found["views"]]}
    hidden = ["channels", "kernels", "training"]
    session.output.show(found, facts_table(facts, leave_out=hidden))
    if session.output.as_json:
        return
    if not (found["method"] == Method.BANK and found["training"]):
        session.output.console.print(_channels_table(found["channels"]))
    show_training(session.output, found)


def _steps(view: Document) -> str:
    """Return a view in one line: its steps and its number of eigenpairs."""
    steps = []
    for step in view["steps"]:
        numbers = ", ".join(f"{name} {value:g}" for name, value in step["parameters"].items())
        steps.append(f"{step['name']} ({numbers})" if numbers else step["name"])
    steps.append(f"{view['eigenpairs']} eigenpairs")
    return f"{view['name']}: {', '.join(steps)}"


def _channels_table(channels: list[Document]) -> Table:
    table = make_table(*CHANNEL_FIELDS, title="channels", numbers=("scale", "weight"))
    for channel in channels:
        table.add_row(*(cell(channel.get(name)) for name in CHANNEL_FIELDS))
    return table


@app.command("activate")
@connected
def activate_model(
    session: Session,
    name: NameArgument,
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Which to move.")
    ] = "default",
    wait: Annotated[bool, typer.Option(help="Wait until the collection has moved.")] = True,
) -> None:
    """Move a collection to another model.

    Its shapes are described under the new model first. Until then searches use the old one.
    Nothing is uploaded again.
    """
    path = f"/v1/collections/{collection}/model"
    job: Document = session.client.request("PUT", path, json={"model": name}).json()["job"]
    if wait:
        job = wait_for_job(session.client, session.output, job, title=f"describing under {name}")
        if not session.output.as_json:
            require_success(job)
            if job["errors"]:
                table = errors_table(job["errors"], title=f"[red]not found under {cell(name)}[/]")
                session.output.console.print(table)
    done = "is searched under" if wait else "moves to"
    session.output.show(job, f"[bold]{cell(collection)}[/] {done} [bold]{cell(name)}[/]")
    if wait and job["state"] != "succeeded":
        raise typer.Exit(1)
