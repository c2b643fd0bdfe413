"""``proteus doctor``: what could be wrong, and what to do about it."""

from collections.abc import Iterator

import typer
from rich.markup import escape

from proteus.cli.checks import (
    Check,
    check_broker,
    check_data,
    check_machine,
    check_service,
)
from proteus.cli.connection import Session, connected
from proteus.cli.errors import EXIT_FAILED
from proteus.cli.prune import check_freeable
from proteus.cli.serving import DataOption
from proteus.client import DEFAULT_URL, Client
from proteus.terminal.tables import make_table
from service.supervisor.lock import holder_of
from workers.settings import SettingsError, load_settings

MARKS = {"ok": "[green]✓[/]", "warning": "[yellow]![/]", "failed": "[red]✗[/]"}


@connected
def doctor(session: Session, data_dir: DataOption = None) -> None:
    """Check this machine, the data directory and the service, and say what to do.

    Looks at Python, packages, data directory, lock, disk, database, broker, worker and the API.
    The exit code is 1 if something will not work. A service that is not running is no error.
    """
    found = list(_examine(session, data_dir))
    table = make_table("", "what", "found")
    for check in found:
        advice = f"\n[yellow]{escape(check.advice)}[/]" if check.advice else ""
        table.add_row(MARKS[check.state], check.name, escape(check.found) + advice)
    healthy = all(check.state != "failed" for check in found)
    document = {"healthy": healthy, "checks": [check.to_json() for check in found]}
    session.output.show(document, table)
    if not healthy:
        raise typer.Exit(EXIT_FAILED)


def _examine(session: Session, data_dir: object) -> Iterator[Check]:
    yield from check_machine()
    try:
        settings = load_settings(data_dir=data_dir)
    except SettingsError as error:
        yield Check("settings", "failed", str(error), "correct or unset the variable")
        return
    yield from check_data(settings)
    yield from check_broker(settings)
    holder = holder_of(settings.data_path)
    if holder is not None and holder.url and session.client.url == DEFAULT_URL:
        with Client(holder.url) as client:
            yield from check_service(client)
            yield from check_freeable(client)
    else:
        yield from check_service(session.client)
        yield from check_freeable(session.client)
