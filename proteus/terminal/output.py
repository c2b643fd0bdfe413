"""Where a command writes: tables or one JSON document to stdout, everything else to stderr."""

import json
import sys
from dataclasses import dataclass, field
from typing import TextIO

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
        """Write a JSON document to standard output, with or without ``--json``."""
        sys.stdout.write(json.dumps(value, indent=2, ensure_ascii=False) + "\n")
        sys.stdout.flush()

    def show(self, value: object, table: Table | str) -> None:
        """Write the value as JSON with ``--json``, the table or text without."""
        if self.as_json:
            self.document(value)
        else:
            self.console.print(table, soft_wrap=isinstance(table, str))

    def table(self, table: Table) -> None:
        """Write a further table; nothing with ``--json``."""
        if not self.as_json:
            self.console.print(table)

    def say(self, text: str) -> None:
        """Write a message to standard error; ``[bold]`` and the like are markup."""
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

    def error(self, error: BaseException) -> None:
        """Write an error as a message, and as a problem document too with ``--json``."""
        problem = {"title": type(error).__name__, "detail": str(error)}
        if isinstance(error, ServiceError):
            problem = error.problem
        self.messages.print(f"[bold red]error:[/] {escape(str(error))}")
        for line in getattr(error, "lines", ()):
            self.messages.print(f"  [dim]{escape(line)}[/]")
        if hint := _hint(error):
            self.messages.print(hint)
        if self.as_json:
            self.document(problem)


def _hint(error: BaseException) -> str:
    """Return what to do about an error, where the message alone does not say."""
    if isinstance(error, UnreachableError):
        return "Start one with [bold]proteus serve[/], or say where it is: --url or PROTEUS_URL."
    if isinstance(error, ServiceError) and error.status in {401, 403}:
        return "Give a key that allows this: --key or PROTEUS_KEY."
    if isinstance(error, ServiceError) and error.problem.get("request_id"):
        return f"[dim]request {escape(str(error.problem['request_id']))}[/]"
    return ""
