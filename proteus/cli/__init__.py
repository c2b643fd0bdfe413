"""The command line: Typer and Rich, talking HTTP to a running service."""

from proteus.cli.program import main

__all__ = ["main"]
