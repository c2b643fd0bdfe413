"""How commands speak: tables or JSON on stdout, everything else on stderr, exit codes."""

import contextlib
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TextIO

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table

from proteus.client import ServiceError, UnreachableError
from service.supervisor.events import StartError
from workers.errors import ProteusError
from workers.settings import SettingsError

EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_UNREACHABLE = 3
EXIT_INTERRUPTED = 130
PLAIN_WIDTH = 140
"""Columns of a table that is not written to a terminal."""


class CommandError(Exception):
    """A command cannot go on; the message says why and what to do."""


def _console(stream: TextIO, *, stderr: bool = False) -> Console:
    width = None if stream.isatty() else PLAIN_WIDTH
    return Console(stderr=stderr, width=width, highlight=False, soft_wrap=False)


@dataclass(frozen=True)
class Output:
    """Where a command writes.

    Attributes
    ----------
    as_json : bool
        Write one JSON document to stdout instead of tables.
    console, messages : Console
        Standard output and standard error.
    """

    as_json: bool = False
    console: Console = field(default_factory=lambda: _console(sys.stdout))
    messages: Console = field(default_factory=lambda: _console(sys.stderr, stderr=True))

    def document(self, value: object) -> None:
        """Write a JSON document to standard output, whatever was asked for."""
        sys.stdout.write(json.dumps(value, indent=2, ensure_ascii=False) + "\n")
        sys.stdout.flush()

    def show(self, value: object, table: Table | str) -> None:
        """Write the value as JSON, or else what stands for it on a screen."""
        if self.as_json:
            self.document(value)
        else:
            self.console.print(table, soft_wrap=isinstance(table, str))

    def say(self, text: str) -> None:
        """Tell the person something on standard error; ``[bold]`` and such are markup."""
        self.messages.print(text, soft_wrap=True)

    def progress(self, *, unit: str = "") -> Progress:
        """Return a progress bar on standard error, silent with ``--json``."""
        return Progress(
            SpinnerColumn(finished_text="[green]✓[/]"),
            TextColumn("{task.description}"),
            BarColumn(bar_width=32),
            MofNCompleteColumn(),
            TextColumn(unit),
            TimeElapsedColumn(),
            console=self.messages,
            disable=self.as_json,
        )

    def refuse(self, error: BaseException, *, code: int) -> typer.Exit:
        """Tell of an error, as a JSON problem too where JSON was asked for."""
        problem = {"title": type(error).__name__, "detail": str(error)}
        if isinstance(error, ServiceError):
            problem = error.problem
        self.messages.print(f"[bold red]error:[/] {escape(str(error))}")
        for line in getattr(error, "lines", ()):
            self.messages.print(f"  [dim]{escape(line)}[/]")
        hint = _hint(error)
        if hint:
            self.messages.print(hint)
        if self.as_json:
            self.document(problem)
        return typer.Exit(code)


def _hint(error: BaseException) -> str:
    """Return what to do about an error, where the message alone does not say."""
    if isinstance(error, UnreachableError):
        return "Start one with [bold]proteus serve[/], or say where it is: --url or PROTEUS_URL."
    if isinstance(error, ServiceError) and error.status in {401, 403}:
        return "Give a key that may do this: --key or PROTEUS_KEY."
    if isinstance(error, ServiceError) and error.problem.get("request_id"):
        return f"[dim]request {escape(str(error.problem['request_id']))}[/]"
    return ""


@contextlib.contextmanager
def guarded(output: Output) -> Iterator[None]:
    """Turn the errors that a person can do something about into a message and an exit code."""
    try:
        yield
    except UnreachableError as error:
        raise output.refuse(error, code=EXIT_UNREACHABLE) from None
    except SettingsError as error:
        raise output.refuse(error, code=EXIT_USAGE) from None
    except (ServiceError, StartError, ProteusError, CommandError, OSError) as error:
        raise output.refuse(error, code=EXIT_FAILED) from None
    except KeyboardInterrupt:
        output.say("[yellow]interrupted[/]")
        raise typer.Exit(EXIT_INTERRUPTED) from None


def make_table(*columns: str, title: str | None = None, numbers: Sequence[str] = ()) -> Table:
    """Return a quiet table; the columns named in ``numbers`` are set to the right."""
    table = Table(box=None, header_style="bold", title=title, title_justify="left", pad_edge=False)
    for name in columns:
        table.add_column(
            name,
            justify="right" if name in numbers else "left",
            no_wrap=name in {"id", *numbers},
            overflow="fold",
        )
    return table


def cell(value: object) -> str:
    """Return a value as the text of a table's cell."""
    if value is None or value == "" or value == []:
        return "[dim]-[/]"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return escape("\n".join(str(item) for item in value))
    if isinstance(value, dict):
        return escape(json.dumps(value, ensure_ascii=False))
    return escape(str(value))


def time_cell(text: str | None) -> str:
    """Return a moment without its parts of a second."""
    return cell(text[:19].replace("T", " ") if text else None)


STATE_STYLES = {
    "ready": "green",
    "succeeded": "green",
    "failed": "red",
    "cancelled": "yellow",
    "processing": "cyan",
    "running": "cyan",
}


def state_cell(state: str) -> str:
    """Return a state in its colour."""
    style = STATE_STYLES.get(state)
    return f"[{style}]{escape(state)}[/]" if style else escape(state)


def facts_table(document: dict[str, object], *, leave_out: Sequence[str] = ()) -> Table:
    """Return one object as a table of two columns."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in document.items():
        if name not in leave_out:
            table.add_row(name, state_cell(str(value)) if name == "state" else cell(value))
    return table
