"""The command line: Typer and Rich, talking HTTP to a running service."""

from service.cli.program import main

__all__ = ["main"]
