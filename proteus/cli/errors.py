"""Errors that a person can do something about, as messages and exit codes."""

import contextlib
from collections.abc import Iterator

import typer

from proteus.client import ServiceError, UnreachableError
from proteus.terminal.output import CommandError, Output
from service.supervisor.events import StartError
from workers.errors import ProteusError
from workers.settings import SettingsError

EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_UNREACHABLE = 3
EXIT_INTERRUPTED = 130


@contextlib.contextmanager
def guarded(output: Output) -> Iterator[None]:
    """Turn the errors that a person can do something about into a message and an exit code."""
    try:
        yield
    except UnreachableError as error:
        output.error(error)
        raise typer.Exit(EXIT_UNREACHABLE) from None
    except SettingsError as error:
        output.error(error)
        raise typer.Exit(EXIT_USAGE) from None
    except (ServiceError, StartError, ProteusError, CommandError, OSError) as error:
        output.error(error)
        raise typer.Exit(EXIT_FAILED) from None
    except KeyboardInterrupt:
        output.say("[yellow]interrupted[/]")
        raise typer.Exit(EXIT_INTERRUPTED) from None
