"""What the supervisor tells whoever watches it, and the errors of a start."""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
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
    at : datetime
        When it happened, in UTC.
    """

    kind: EventKind
    name: str = ""
    text: str = ""
    lines: tuple[str, ...] = ()
    at: datetime = field(default_factory=partial(datetime.now, UTC))

    @property
    def time(self) -> str:
        """When it happened, as log lines say it: ``2026-03-01T09:30:00Z``."""
        return self.at.isoformat(timespec="seconds").replace("+00:00", "Z")


Report = Callable[[Event], None]


class StartError(Exception):
    """The service could not be started; the message says why and what to do."""

    def __init__(self, message: str, *, lines: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.lines = lines
