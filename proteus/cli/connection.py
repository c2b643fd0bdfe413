"""The options that every command of a client has, added to it by a decorator."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Concatenate, ParamSpec

import typer

from proteus.cli.errors import guarded
from proteus.client import DEFAULT_URL, Client
from proteus.terminal.output import Output

P = ParamSpec("P")

UrlOption = Annotated[
    str, typer.Option("--url", envvar="PROTEUS_URL", help="URL of the service.", metavar="URL")
]
KeyOption = Annotated[
    str,
    typer.Option(
        "--key", envvar="PROTEUS_KEY", help="API key, if the service needs one.", metavar="KEY"
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Write one JSON document to stdout.")]


@dataclass(frozen=True)
class Session:
    """The service and the output of a command."""

    client: Client
    output: Output


def _parameter(name: str, annotation: object, default: object) -> inspect.Parameter:
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)


_JSON = _parameter("as_json", JsonOption, False)
_CONNECTION = (_parameter("url", UrlOption, DEFAULT_URL), _parameter("key", KeyOption, ""), _JSON)


def _with_options(
    wrapper: Callable[..., None], command: Callable[..., None], *added: inspect.Parameter
) -> Callable[..., None]:
    """Give a wrapper the command's parameters but the first, and those added to it."""
    _, *own = inspect.signature(command).parameters.values()
    own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in own]
    # Typer reads the signature, and follows __wrapped__ where that is left in place.
    wrapper.__dict__.pop("__wrapped__", None)
    wrapper.__dict__["__signature__"] = inspect.Signature([*own, *added])
    wrapper.__annotations__ = {p.name: p.annotation for p in [*own, *added]}
    return wrapper


def connected(command: Callable[Concatenate[Session, P], None]) -> Callable[..., None]:
    """Make a Typer command of a function whose first argument is a :class:`Session`.

    The command gets the options ``--url``, ``--key`` and ``--json``; errors of the service
    become messages and exit codes.
    """

    @functools.wraps(command)
    def wrapper(*, url: str, key: str, as_json: bool, **options: Any) -> None:
        output = Output(as_json=as_json)
        with guarded(output), Client(url, key) as client:
            command(Session(client, output), **options)  # type: ignore[call-arg]

    return _with_options(wrapper, command, *_CONNECTION)


def local(command: Callable[Concatenate[Output, P], None]) -> Callable[..., None]:
    """Make a Typer command of a function whose first argument is an :class:`Output`."""

    @functools.wraps(command)
    def wrapper(*, as_json: bool, **options: Any) -> None:
        output = Output(as_json=as_json)
        with guarded(output):
            command(output, **options)  # type: ignore[call-arg]

    return _with_options(wrapper, command, _JSON)
