"""``proteus demo``: from shapes to ranked answers with one command."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from proteus.cli.asking import query_by_mesh
from proteus.cli.connection import KeyOption, local
from proteus.cli.embedded import service_for
from proteus.cli.errors import EXIT_FAILED
from proteus.cli.query import matches_table
from proteus.cli.serving import DataOption, HostOption, PortOption, WorkersOption
from proteus.client import DEFAULT_URL, Client, Document
from proteus.files import UploadFile
from proteus.terminal.output import Output
from proteus.terminal.tables import errors_table
from proteus.terminal.waiting import PATIENCE_SECONDS
from proteus.uploads import ensure_collection, upload_files
from workers.settings import Settings, load_settings

if TYPE_CHECKING:
    from proteus.cli.demo_shapes import DemoMesh

COLLECTION = "demo"
DESCRIPTION = "Procedural creatures: every species, several individuals and poses."
MATCHES = 5


@dataclass(frozen=True)
class Answer:
    """A query of the demo and its answer.

    Attributes
    ----------
    creature, deformation : str
        The individual to be found, and how its mesh was deformed.
    path : Path
        The mesh file.
    result : dict
        The QueryResult.
    """

    creature: str
    deformation: str
    path: Path
    result: Document

    @property
    def is_right(self) -> bool:
        """Whether the creature that was deformed came first."""
        matches = self.result["matches"]
        return bool(matches) and str(matches[0]["shape"]["name"]).startswith(f"{self.creature}-")

    def to_json(self) -> Document:
        """Return it as a JSON object."""
        query = {"creature": self.creature, "deformation": self.deformation, "mesh": str(self.path)}
        return {**query, "found_first": self.is_right, "result": self.result}


@local
def demo(
    output: Output,
    end: Annotated[
        bool,
        typer.Option("--exit", help="Stop after the answers. The exit code is 1 if one was wrong."),
    ] = False,
    data_dir: DataOption = None,
    host: HostOption = None,
    port: PortOption = None,
    workers: WorkersOption = None,
    key: KeyOption = "",
) -> None:
    """Try Proteus: start it, upload procedural creatures, search with deformed copies.

    Uses the service that runs on the data directory, or starts one, which runs until Ctrl-C.
    A second demo reuses the creatures of the first.
    """
    settings = load_settings(
        host=host, port=port, data_dir=data_dir, worker_processes=workers
    )  # fmt: skip
    with service_for(settings) as (url, service):
        with Client(url, key, patience_seconds=PATIENCE_SECONDS) as client:
            answers = _show(client, output, settings)
        right = all(answer.is_right for answer in answers)
        document = {"url": url, "passed": right, "queries": [a.to_json() for a in answers]}
        output.show(document, _verdict(answers))
        _show_next_steps(output, url, settings, example=answers[0].path)
        if service is not None and not end:
            output.say("[dim]The service keeps running; Ctrl-C stops it.[/]")
            service.wait()
    if not right:
        raise typer.Exit(EXIT_FAILED)


def _show(client: Client, output: Output, settings: Settings) -> list[Answer]:
    """Make the collection, upload it, and return the answers to all queries."""
    from proteus.cli.demo_shapes import demo_queries, demo_shapes, generator_key, write_meshes

    folder = settings.data_path / "demo" / generator_key()
    shapes, queries = demo_shapes(), demo_queries()
    meshes = [*shapes, *queries]
    with output.progress(unit="creatures") as bar:
        task = bar.add_task("making   ", total=len(meshes))
        for done in write_meshes(meshes, folder, processes=settings.worker_processes):
            bar.update(task, completed=done)
    ensure_collection(client, COLLECTION, description=DESCRIPTION)
    paths = [folder / shape.path for shape in shapes]
    files = [UploadFile(path, path.parent.name, path.stat().st_size) for path in paths]
    result = upload_files(client, output, COLLECTION, files)
    if result.errors:
        output.table(errors_table(result.errors, title="[red]failed[/]"))
    return [_ask(client, output, query, folder / query.path) for query in queries]


def _ask(client: Client, output: Output, query: "DemoMesh", path: Path) -> Answer:
    """Search with one deformed copy, and show the ranked answer."""
    options = {"limit": MATCHES}
    asked = query_by_mesh(client, output, COLLECTION, path.name, path.read_bytes(), options)
    result = asked.result
    answer = Answer(query.creature, query.deformation, path, result)
    if not output.as_json:
        title = f"\n[bold]{escape(answer.creature)}[/] {escape(answer.deformation)}"
        output.console.print(matches_table(result, own=f"{answer.creature}-", title=title))
    return answer


def _verdict(answers: Sequence[Answer]) -> str:
    """Return how many answers are right, and which are not."""
    wrong = [answer for answer in answers if not answer.is_right]
    count = f"{len(answers) - len(wrong)} of {len(answers)}"
    text = f"{count} deformed copies found their own creature first"
    if not wrong:
        return f"\n[green]✓[/] {text}"
    names = ", ".join(f"{answer.creature} {answer.deformation}" for answer in wrong)
    return f"\n[red]✗[/] {text}; not: {escape(names)}"


def _show_next_steps(output: Output, url: str, settings: Settings, *, example: Path) -> None:
    """Show where everything is and what to try."""
    if output.as_json:
        return
    elsewhere = "" if url == DEFAULT_URL else f" --url {url}"
    with contextlib.suppress(ValueError):
        example = example.relative_to(Path.cwd())
    output.say(
        f"\n  [bold]Page[/]  {escape(url)}: drop a mesh of {escape(str(example.parent))} on it\n"
        f"  [bold]API[/]   {escape(url)}/docs\n"
        f"  [bold]Data[/]  {escape(str(settings.data_path))}\n"
        f"  [bold]Try[/]   proteus query {escape(str(example))} -c {COLLECTION}{elsewhere}\n"
    )
