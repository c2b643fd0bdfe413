"""The program ``proteus``: all commands under one roof."""

import sys
from typing import Annotated

import typer

from proteus.cli import (
    benchmark,
    collections,
    correspondence,
    creatures,
    demo,
    doctor,
    evaluate,
    jobs,
    keys,
    models,
    prune,
    query,
    reproduce,
    serving,
    shapes,
    upload,
)
from proteus.cli.errors import EXIT_FAILED
from proteus.terminal.output import Output
from proteus.version import program_version

RUN = "Run the service"
USE = "Use a running service"
MORE = "More"

HELP = """Search engine for deformable 3D shapes: a mesh goes in, a ranked list of shapes comes out.

A shape is found again in another pose, at another scale, with noise or holes, or coarser.

  [bold]proteus demo[/]                       a first look: start, upload, search
  [bold]proteus serve[/]                      start the whole service
  [bold]proteus upload poses/ -c animals[/]   upload all meshes of a folder
  [bold]proteus query cat.ply -c animals[/]   find the shapes most like a mesh
  [bold]proteus evaluate animals -m heat[/]   measure how often the search is right

Exit codes: 0 success, 1 failure, 2 wrong usage, 3 no service answers.
With [bold]--json[/], a command writes one JSON document to stdout and nothing else.
"""

app = typer.Typer(
    name="proteus",
    help=HELP,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("demo", rich_help_panel=RUN)(demo.demo)
app.command("serve", rich_help_panel=RUN)(serving.serve_command)
app.command("worker", rich_help_panel=RUN)(serving.worker)
app.command("api", rich_help_panel=RUN)(serving.api)
app.command("migrate", rich_help_panel=RUN)(serving.migrate)
app.command("upload", rich_help_panel=USE)(upload.upload)
app.command("query", rich_help_panel=USE)(query.query)
app.command("correspondence", rich_help_panel=USE)(correspondence.correspondence)
app.command("evaluate", rich_help_panel=USE)(evaluate.evaluate)
app.add_typer(collections.app, name="collections", rich_help_panel=USE)
app.add_typer(shapes.app, name="shapes", rich_help_panel=USE)
app.add_typer(jobs.app, name="jobs", rich_help_panel=USE)
app.add_typer(models.app, name="models", rich_help_panel=USE)
app.add_typer(benchmark.app, name="benchmark", rich_help_panel=USE)
app.command("reproduce", rich_help_panel=MORE)(reproduce.reproduce)
app.command("doctor", rich_help_panel=MORE)(doctor.doctor)
app.command("prune", rich_help_panel=MORE)(prune.prune)
app.command("key", rich_help_panel=MORE)(keys.key)
app.command("creatures", rich_help_panel=MORE)(creatures.creatures)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"proteus {program_version()}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line; an unexpected error is one line, or a traceback under ``-X dev``."""
    try:
        app()
    except Exception as error:
        if sys.flags.dev_mode:
            raise
        Output().error(error)
        Output().say(
            "[dim]This is a fault of Proteus. For a traceback, run it as[/] "
            "python -X dev -m proteus.cli …"
        )
        sys.exit(EXIT_FAILED)
