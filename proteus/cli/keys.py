"""``proteus key``: make an API key."""

from enum import StrEnum
from typing import Annotated

import typer

from proteus.cli.connection import local
from proteus.terminal.output import Output


class Scope(StrEnum):
    """What a key allows; each includes the one before."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"


@local
def key(
    output: Output,
    identifier: Annotated[
        str, typer.Argument(metavar="ID", help="Owner of the key: lower-case letters, digits, -.")
    ],
    scope: Annotated[
        Scope, typer.Option(help="read: view and search; write: upload too; admin: delete too.")
    ] = Scope.WRITE,
) -> None:
    """Make an API key, and the entry for PROTEUS_API_KEYS that lets the service accept it.

    The service keeps only the key's sha256, so the key is shown once. As soon as PROTEUS_API_KEYS
    has an entry, requests without a key are refused.
    """
    from service.security import new_key

    token, setting = new_key(identifier, [scope.value])
    text = (
        f"[bold]the key, for the client[/] (PROTEUS_KEY)\n  {token}\n"
        f"[bold]its entry, for the service[/] (PROTEUS_API_KEYS, comma-separated)\n  {setting}"
    )
    output.show({"key": token, "setting": setting}, text)
