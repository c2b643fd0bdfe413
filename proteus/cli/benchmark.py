"""``proteus benchmark``: make a benchmark of null shapes, and measure models on it."""

import json
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from proteus.cli.connection import Session, connected, local
from proteus.cli.errors import EXIT_FAILED
from proteus.cli.evaluate import show, write_csv
from proteus.client import Document
from proteus.terminal.output import CommandError, Output
from proteus.terminal.tables import errors_table

if TYPE_CHECKING:
    from proteus.benchmark.build import Built

app = typer.Typer(
    help="A benchmark of transformed shapes, as in the paper: build it, run models on it.",
    no_args_is_help=True,
)
DEFAULT_MODELS = ("proteus", "commute-time", "heat", "biharmonic", "shape-dna")

NullsOption = Annotated[
    Path | None,
    typer.Option(
        "--nulls", exists=True, file_okay=False, help="Null shapes: LABEL.ply or LABEL/FILE."
    ),
]
PosesOption = Annotated[
    Path | None,
    typer.Option(
        "--poses",
        exists=True,
        file_okay=False,
        help="Poses LABEL/*, of the null's vertex order; transformations are applied to them.",
    ),
]
DistractorsOption = Annotated[
    Path | None,
    typer.Option("--distractors", exists=True, file_okay=False, help="Other shapes to search."),
]
ProcessesOption = Annotated[
    int | None,
    typer.Option("--processes", "-p", min=1, help="Processes to use. Default: one per processor."),
]


class Normalise(StrEnum):
    """What every shape is scaled to first."""

    NONE = "none"
    AREA = "area"


class ViewName(StrEnum):
    """Whether round holes are closed before a shape is solved."""

    OPEN = "open"
    CLOSED = "closed"


@app.command("build")
@local
def build(
    output: Output,
    out: Annotated[Path, typer.Option("--out", "-o", file_okay=False, help="Folder to write to.")],
    nulls: NullsOption = None,
    poses: PosesOption = None,
    distractors: DistractorsOption = None,
    creatures: Annotated[
        int, typer.Option(min=0, help="Procedural creatures among the query classes.")
    ] = 0,
    creature_distractors: Annotated[
        int, typer.Option(min=0, help="Other creatures to search.")
    ] = 0,
    creature_vertices: Annotated[
        int, typer.Option(min=2000, max=20_000, help="Vertices of a creature, roughly.")
    ] = 4000,
    transformation: Annotated[
        list[str] | None,
        typer.Option("--transformation", "-t", help="Repeatable. Default: the paper's eleven."),
    ] = None,
    strength: Annotated[
        list[int] | None, typer.Option("--strength", "-s", help="Repeatable. Default: 1 to 5.")
    ] = None,
    normalise: Annotated[
        Normalise, typer.Option(help="area: scale every shape to one area.")
    ] = Normalise.NONE,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all that is random.")] = 0,
    processes: ProcessesOption = None,
) -> None:
    """Write null shapes and transformed copies: LABEL.TRANSFORMATION.STRENGTH.ply.

    The same options give the same files. An interrupted build continues: existing files are kept.
    A shape that cannot be read or transformed is left out and named, and the exit code is 1.
    """
    from proteus.benchmark.build import build_benchmark
    from proteus.benchmark.plan import BenchmarkOptions
    from workers.settings import available_processors
    from workers.transformations import PAPER_TRANSFORMATIONS, STRENGTHS

    options = BenchmarkOptions(
        nulls=nulls,
        poses=poses,
        distractors=distractors,
        creatures=creatures,
        creature_distractors=creature_distractors,
        creature_vertices=creature_vertices,
        transformations=tuple(transformation or PAPER_TRANSFORMATIONS),
        strengths=tuple(sorted(set(strength or STRENGTHS))),
        seed=seed,
        normalise=normalise.value,
    )
    with output.progress(unit="files") as bar:
        task = bar.add_task("making", total=None)
        built = build_benchmark(
            options,
            out,
            processes=processes or available_processors(),
            advance=lambda done, total: bar.update(task, completed=done, total=total),
        )
    _show_built(output, built)
    if built.manifest["failures"]:
        raise typer.Exit(EXIT_FAILED)


def _show_built(output: Output, built: "Built") -> None:
    """Show what was made and what was left out."""
    manifest = built.manifest
    for note in manifest["notes"]:
        output.say(f"[yellow]![/] {escape(note)}")
    for pose in manifest["left_out"]:
        output.say(f"[yellow]![/] {escape(pose['file'])} is no pose: {escape(pose['reason'])}")
    failed = [
        {"item": f"{f['label']} ({f['transformation']})", "detail": f["reason"]}
        for f in manifest["failures"]
    ]
    if failed:
        output.table(errors_table(failed, title="[red]left out[/]"))
    counts = manifest["counts"]
    text = ", ".join(f"{count} {name}" for name, count in counts.items())
    document = {"folder": str(built.folder), **counts}
    document |= {name: manifest[name] for name in ("failures", "left_out", "notes")}
    output.show(document, f"[bold]{escape(str(built.folder))}[/]: {text}")


@app.command("run")
@connected
def run(
    session: Session,
    folder: Annotated[
        Path,
        typer.Argument(
            exists=True, file_okay=False, metavar="DIR", help="Folder of the benchmark."
        ),
    ],
    collection: Annotated[
        str,
        typer.Option("--collection", "-c", help="Collection to use. Default: the folder's name."),
    ] = "",
    model: Annotated[
        list[str] | None,
        typer.Option(
            "--model", "-m", help="Model to measure. Repeatable. Default: five built-in models."
        ),
    ] = None,
    view: Annotated[
        ViewName | None,
        typer.Option(help="View of built-in models: holes open or closed."),
    ] = None,
    dissimilarity: Annotated[
        str, typer.Option(help="Another dissimilarity than the channels'.")
    ] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", dir_okay=False, help="Also save the evaluation: .json or .csv."
        ),
    ] = None,
) -> None:
    """Upload a benchmark, evaluate models on it, and show Table 1."""
    from proteus.benchmark.build import read_benchmark
    from proteus.benchmark.run import collection_name, ensure_model, upload_benchmark
    from proteus.evaluations import evaluate

    if out is not None and out.suffix.lower() not in {".json", ".csv"}:
        raise CommandError(f"{out} has the ending {out.suffix!r}, expected .json or .csv")
    built = read_benchmark(folder)
    wanted = view.value if view else None
    models = [ensure_model(session.client, m, wanted) for m in model or DEFAULT_MODELS]
    name = collection or collection_name(built)
    result = upload_benchmark(session.client, session.output, built, name, model=models[0])
    if result.errors:
        session.output.table(errors_table(result.errors, title="[red]failed[/]"))
    found = evaluate(session.client, session.output, name, models, dissimilarity=dissimilarity)
    if out is not None:
        _save(out, found)
    if session.output.as_json:
        session.output.document(found)
    else:
        show(session, found, by_strength=False, worst=0)
    if result.errors:
        raise typer.Exit(EXIT_FAILED)


def _save(path: Path, evaluation: Document) -> None:
    """Write an evaluation as JSON, or its table as CSV."""
    if path.suffix.lower() == ".csv":
        write_csv(path, evaluation)
    else:
        path.write_text(json.dumps(evaluation, indent=1, ensure_ascii=False) + "\n")
