"""What the supervisor tells whoever watches it, and the errors of a start."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

EventKind = Literal["starting", "ready", "done", "ended", "note", "up", "stopping", "stopped"]


@dataclass(frozen=True)
class Event:
    """One thing that happened.

    Attributes
    ----------
    kind : str
        ``starting``, ``ready`` and ``ended`` concern one child, ``done`` a step that ran once;
        ``up`` means that all children are ready, ``stopping`` and ``stopped`` the whole.
    name : str
        The child, or empty.
    text : str
        A sentence for people.
    lines : tuple of str
        The last lines of the child's log, where they help.
    """

    kind: EventKind
    name: str = ""
    text: str = ""
    lines: tuple[str, ...] = ()


Report = Callable[[Event], None]


class StartError(Exception):
    """The service could not be started; the message says why and what to do."""

    def __init__(self, message: str, *, lines: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.lines = lines
