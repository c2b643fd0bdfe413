"""``proteus models train``: make a model, or learn one."""

from collections.abc import Iterable
from enum import StrEnum
from typing import Annotated, Any

import typer

from proteus.cli.bank import show_bank
from proteus.cli.connection import Session, connected
from proteus.cli.kernel import show_kernel
from proteus.client import Document
from proteus.terminal.output import CommandError, Output
from proteus.terminal.tables import cell, errors_table
from proteus.terminal.waiting import require_success, wait_for_job

PAPER = "paper"


class Method(StrEnum):
    """How a model is made."""

    SPLINE = "spline"
    GRID = "grid"
    HEAT_TIME = "heat-time"
    BANK = "bank"
    HEAT = "heat"
    COMMUTE_TIME = "commute-time"
    BIHARMONIC = "biharmonic"
    SHAPE_DNA = "shape-dna"


LEARNED = (Method.SPLINE, Method.GRID, Method.HEAT_TIME, Method.BANK)


@connected
def train(
    session: Session,
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Name of the model.", show_default=False)
    ],
    method: Annotated[
        Method, typer.Option(help="spline, grid, heat-time and bank are learned.")
    ] = Method.SPLINE,
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Shapes to learn from. Default: creatures.")
    ] = "",
    transformations: Annotated[
        list[str] | None,
        typer.Option(
            "--transformation",
            "-t",
            help="What to be invariant to. Repeatable. Default: paper, the paper's eleven.",
        ),
    ] = None,
    strengths: Annotated[
        list[int] | None,
        typer.Option("--strength", help="Strength, 1 to 5. Repeatable. Default: all."),
    ] = None,
    correspondence: Annotated[
        str,
        typer.Option(
            help="simulated (by transformations), or vertex-order (same in all files of a label)."
        ),
    ] = "",
    shapes: Annotated[int | None, typer.Option(help="Most shapes to learn from.")] = None,
    creatures: Annotated[
        int | None,
        typer.Option(help="Creatures that a bank learns from, with a collection or alone."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all that is random.")] = None,
    criterion: Annotated[
        str, typer.Option(help="What should change least: distance or kernel.")
    ] = "",
    unit: Annotated[
        str, typer.Option(help="Unit of eigenvalues: none, area or first-eigenvalue.")
    ] = "",
    views: Annotated[
        list[str] | None,
        typer.Option(
            "--view",
            help="closed or open; for a bank also smooth, smooth-open, detailed. Repeatable.",
        ),
    ] = None,
    splines: Annotated[int | None, typer.Option(help="Number of splines.")] = None,
    smoothness: Annotated[float | None, typer.Option(help="η of the splines, relative.")] = None,
    points: Annotated[int | None, typer.Option(help="Points of the grid.")] = None,
    interpolation: Annotated[
        str, typer.Option(help="Between points of the grid: nearest or linear.")
    ] = "",
    time: Annotated[float | None, typer.Option(help="Time of the heat kernel.")] = None,
    channels: Annotated[int | None, typer.Option(help="Most channels of a bank.")] = None,
    power: Annotated[float | None, typer.Option(help="p of a bank's Σ w (D/s)^p.")] = None,
    wait: Annotated[bool, typer.Option(help="Wait until the model is ready.")] = True,
) -> None:
    """Make a model. The methods spline, grid, heat-time and bank learn from transformed shapes.

    Spectra that one training has computed are reused by the next.
    """
    parameters = _given(
        criterion=criterion, unit=unit, splines=splines, smoothness=smoothness,
        points=points, interpolation=interpolation, time=time, channels=channels, power=power,
        **_views(method, views or []),
    )  # fmt: skip
    training = _given(
        collection=collection, correspondence=correspondence, shapes=shapes, seed=seed,
        creatures=creatures,
        transformations=list(_named(transformations or [])), strengths=strengths,
    )  # fmt: skip
    if method in LEARNED and correspondence != "vertex-order":
        training.setdefault("transformations", list(_named([PAPER])))
    body = {"name": name, "method": method.value, "parameters": parameters}
    body |= {"training": training} if training or method in LEARNED else {}
    accepted = session.client.post("/v1/models", body)
    job = accepted["job"]
    if wait and method in LEARNED:
        job = wait_for_job(session.client, session.output, job, title=f"training {name}")
        require_success(job)
    _show(session, name, job)


def _views(method: Method, views: list[str]) -> dict[str, Any]:
    """Return the views as parameters: a bank has several, any other method one."""
    if method is Method.BANK:
        return {"views": views}
    if len(views) > 1:
        raise CommandError(f"{len(views)} views are given, the method {method} takes one")
    return {"view": views[0]} if views else {}


def _given(**options: Any) -> dict[str, Any]:
    """Return the options that were given; the service has the defaults of the others."""
    return {key: value for key, value in options.items() if value not in (None, "", [])}


def _named(transformations: Iterable[str]) -> Iterable[str]:
    """Iterate over names of transformations, with the paper's eleven for ``paper``."""
    for transformation in transformations:
        if transformation == PAPER:
            from workers.transformations import PAPER_TRANSFORMATIONS

            yield from PAPER_TRANSFORMATIONS
        else:
            yield transformation


def _show(session: Session, name: str, job: Document) -> None:
    """Show the model and the report of its training."""
    output = session.output
    found = session.client.get(f"/v1/models/{name}")
    if output.as_json:
        output.document({"model": found, "job": job})
        return
    output.console.print(f"[bold]{cell(name)}[/] is {found['state']}")
    if found["state"] != "ready":
        output.say(f"watch it: [bold]proteus jobs watch {job['id']}[/]")
    else:
        show_training(output, found)
    if job["errors"]:
        unit = job["progress"]["unit"]
        output.table(errors_table(job["errors"], title=f"{unit} that failed"))


def show_training(output: Output, model: Document) -> None:
    """Show the report of a model's training, if it was trained."""
    if not model["training"]:
        return
    if model["method"] == Method.BANK:
        show_bank(output, model)
    else:
        show_kernel(output, model["training"])
