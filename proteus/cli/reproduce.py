"""``proteus reproduce``: the paper's figures and Table 1, with a report."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from proteus.cli.benchmark import DistractorsOption, NullsOption, PosesOption, ProcessesOption
from proteus.cli.connection import KeyOption, local
from proteus.cli.embedded import service_for
from proteus.cli.serving import DataOption
from proteus.client import Client, Document
from proteus.terminal.output import Output
from proteus.terminal.tables import make_table
from workers.settings import available_processors, load_settings

if TYPE_CHECKING:
    from proteus.reproduction.draw import Tables
    from proteus.reproduction.plan import Plan


class SizeName(StrEnum):
    """How much is made and measured."""

    SMALL = "small"
    PAPER = "paper"


@local
def reproduce(
    output: Output,
    out: Annotated[Path, typer.Option("--out", "-o", file_okay=False, help="Folder to write to.")],
    size: Annotated[
        SizeName,
        typer.Option(help="small: 6 shapes, minutes; paper: 13 shapes, 715 queries, hours."),
    ] = SizeName.SMALL,
    nulls: NullsOption = None,
    poses: PosesOption = None,
    distractors: DistractorsOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all that is random.")] = 0,
    data_dir: DataOption = None,
    processes: ProcessesOption = None,
    key: KeyOption = "",
) -> None:
    """Reproduce the paper's Figs. 1 to 5 and Table 1, with a report of one HTML file.

    Without --nulls the shapes are procedural creatures. Kernels are learned from other species.
    Uses the service that runs on the data directory, or starts one in the folder. After an
    interruption the same command continues.
    """
    from proteus.reproduction.plan import SIZES, Plan

    plan = Plan(out, SIZES[size.value], nulls, poses, distractors, seed)
    settings = load_settings(
        data_dir=data_dir or out / "service",
        worker_processes=processes,
        working_vertices=plan.size.working_vertices,
        port=0,
    )
    out.mkdir(parents=True, exist_ok=True)
    with service_for(settings) as (url, _), Client(url, key) as client:
        document = run_plan(
            client, output, plan, size=size.value, processes=processes or available_processors()
        )
    output.show(document, f"[bold]{escape(str(document['report']))}[/]")


def run_plan(
    client: Client, output: Output, plan: "Plan", *, size: str, processes: int
) -> Document:
    """Measure, draw and write; return what was made and the tables."""
    from proteus.reproduction.draw import draw_figures, make_tables, save_tables
    from proteus.reproduction.report import write_report
    from proteus.reproduction.run import Reproduction

    work = Reproduction(client, output, plan, processes=processes)
    results, signatures, built = work.measure({"size": size, "command": _command(plan, size)})
    tables = make_tables(results)
    saved = results.save(plan.out)
    save_tables(tables, plan.out)
    figures = draw_figures(results, signatures, built, plan.out / "figures")
    report = write_report(results, tables, figures, signatures, plan.out)
    if not output.as_json:
        _print(output, tables)
    return {
        "report": str(report),
        "results": str(saved),
        "figures": [str(path) for paths in figures.values() for path in paths],
        "table": tables.measured.to_json(),
        "closed": tables.closed.to_json(),
    }


def _command(plan: "Plan", size: str) -> str:
    """Return the command that does it again, without the names of this machine's folders."""
    own = {"nulls": plan.nulls, "poses": plan.poses, "distractors": plan.distractors}
    folders = "".join(f" --{name} DIR" for name, path in own.items() if path is not None)
    return f"proteus reproduce --out DIR --size {size} --seed {plan.seed}{folders}"


def _print(output: Output, tables: "Tables") -> None:
    """Show Table 1 on the screen."""
    from proteus.reproduction.tables import HEADINGS

    headings = [HEADINGS[key] for key in tables.measured.columns]
    for title, found in (("Table 1", tables.measured), ("Holes closed", tables.closed)):
        table = make_table("transformation", *headings, title=f"\n{title}", numbers=headings)
        for name, row in found.rows.items():
            best = found.best(name)
            cells = ["-" if x is None else f"{x:.1f}" for x in row]
            bold = [f"[bold]{c}[/]" if i in best else c for i, c in enumerate(cells)]
            table.add_row(name, *bold)
        output.console.print(table)
