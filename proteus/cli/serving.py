"""``proteus serve``, and its single processes for containers: worker, api, migrate."""

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from proteus.cli.connection import local
from proteus.terminal.output import Output
from service.serve import serve
from service.supervisor import commands
from service.supervisor.events import Event, Report
from workers.settings import QUEUES, Settings, load_settings

HostOption = Annotated[
    str | None,
    typer.Option("--host", help="Address to listen on (PROTEUS_HOST; default 127.0.0.1)."),
]
PortOption = Annotated[
    int | None,
    typer.Option(
        "--port", min=0, max=65535, help="Port, 0 for a free one (PROTEUS_PORT; default 8000)."
    ),
]
DataOption = Annotated[
    Path | None,
    typer.Option(
        "--data-dir",
        "-d",
        file_okay=False,
        help="Data directory (PROTEUS_DATA_DIR; default ./proteus-data).",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers",
        "-w",
        min=1,
        help="Worker processes (PROTEUS_WORKER_PROCESSES; default: one per processor).",
    ),
]


@local
def serve_command(
    output: Output,
    host: HostOption = None,
    port: PortOption = None,
    data_dir: DataOption = None,
    workers: WorkersOption = None,
) -> None:
    """Run the whole service as one program: broker, database, worker and API.

    Needs no other server: it has a bundled Valkey on a private socket, SQLite, and files in the
    data directory. PROTEUS_BROKER_URL, PROTEUS_DATABASE_URL and PROTEUS_BLOB_URL name others. A
    process that dies is started again. Ctrl-C stops the service, a second Ctrl-C at once.
    """
    settings = load_settings(
        host=host, port=port, data_dir=data_dir, worker_processes=workers
    )  # fmt: skip
    url = ""

    def announce(found: str) -> None:
        nonlocal url
        url = found
        output.say(f"[bold]Proteus[/] starts in {escape(str(settings.data_path))}")

    def report(event: Event) -> None:
        if event.kind == "up":
            tell_where(output, url, settings)
        else:
            reporter(output)(event)

    serve(settings, report=report, announce=announce)


def reporter(output: Output) -> Report:
    """Return what prints the supervisor's events."""

    def report(event: Event) -> None:
        time = f"[dim]{event.time}[/]"
        if event.kind in {"ready", "done"}:
            output.say(f"  {time} [green]✓[/] {event.name}")
        elif event.kind in {"ended", "note"}:
            output.say(f"  {time} [yellow]![/] {escape(event.text)}")
            for line in event.lines:
                output.say(f"      [dim]{escape(line)}[/]")
        elif event.kind == "stopping":
            output.say(f"  {time} stopping …")
        elif event.kind == "stopped":
            output.say(f"  {time} stopped")

    return report


def tell_where(output: Output, url: str, settings: Settings) -> None:
    """Say where the API, its documentation and the data are."""
    if output.as_json:
        where = {"url": url, "docs": f"{url}/docs", "data_dir": str(settings.data_path)}
        output.document({**where, "pid": os.getpid()})
        return
    output.say("")
    output.say(f"  API   [bold]{escape(url)}[/]")
    output.say(f"  Docs  {escape(url)}/docs")
    output.say(f"  Data  {escape(str(settings.data_path))}  [dim](logs in {_logs(settings)})[/]")
    output.say("\n[dim]Ctrl-C stops it.[/]")


def _logs(settings: Settings) -> str:
    return escape(str(settings.data_path / "logs"))


@local
def worker(
    output: Output,
    queues: Annotated[
        str, typer.Option(help="Queues to take work from, comma-separated.")
    ] = ",".join(QUEUES),
    name: Annotated[
        str, typer.Option(help="Node name; unlike that of any other worker on the host.")
    ] = "proteus@%h",
    workers: WorkersOption = None,
) -> None:
    """Run one worker alone, for containers. `proteus serve` has a worker of its own."""
    chosen = [queue.strip() for queue in queues.split(",") if queue.strip()]
    unknown = sorted(set(chosen) - set(QUEUES))
    if unknown or not chosen:
        raise typer.BadParameter(f"--queues is {queues!r}; known are {', '.join(QUEUES)}")
    settings = load_settings(worker_processes=workers)
    commands.replace_process(
        commands.worker_command(settings, queues=chosen, name=name),
        commands.worker_environment(settings, os.environ),
    )


@local
def api(output: Output, host: HostOption = None, port: PortOption = None) -> None:
    """Run the API alone, for containers. Run `proteus migrate` first."""
    settings = load_settings(host=host, port=port)
    commands.replace_process(
        commands.api_command(), commands.child_environment(settings, os.environ)
    )


@local
def migrate(output: Output) -> None:
    """Bring the database to the current schema. Running it twice does no harm."""
    settings = load_settings()
    settings.data_path.mkdir(parents=True, exist_ok=True)
    commands.replace_process(
        commands.migrate_command(), commands.child_environment(settings, os.environ)
    )
