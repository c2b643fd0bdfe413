"""The commands and environments of the single processes, for the supervisor and for containers."""

import os
import sys
from collections.abc import Mapping, Sequence

from workers.settings import PREFIX, QUEUES, Settings


def settings_environment(settings: Settings) -> dict[str, str]:
    """Return the settings as ``PROTEUS_`` variables, with the URLs and paths resolved."""
    resolved = {
        "data_dir": settings.data_path,
        "database_url": settings.resolved_database_url,
        "broker_url": settings.resolved_broker_url,
        "blob_url": settings.resolved_blob_url,
    }
    return {
        f"{PREFIX}{name}".upper(): str(resolved.get(name, getattr(settings, name)))
        for name in Settings.model_fields
    }


def child_environment(settings: Settings, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of a child: ours, with its settings."""
    kept = {name: value for name, value in environment.items() if not name.startswith(PREFIX)}
    return {**kept, **settings_environment(settings), "PYTHONUNBUFFERED": "1"}


def worker_environment(settings: Settings, environment: Mapping[str, str]) -> dict[str, str]:
    """Return a worker's environment; SIGTERM hands a running task back to the queue at once."""
    return {**child_environment(settings, environment), "REMAP_SIGTERM": "SIGQUIT"}


def migrate_command() -> tuple[str, ...]:
    """Return the command that brings the database to the present schema and ends."""
    return (sys.executable, "-m", "workers.storage.migrate")


def worker_command(
    settings: Settings, *, queues: Sequence[str] = QUEUES, name: str = "proteus@%h"
) -> tuple[str, ...]:
    """Return the command of one Celery worker.

    Parameters
    ----------
    settings : Settings
        Give the queues' prefix, the number of processes and the log level.
    queues : sequence of str
        Which kinds of work it takes, without the prefix.
    name : str
        The worker's node name; ``%h`` is the host.
    """
    return (
        *(sys.executable, "-m", "celery", "-A", "workers.tasks.app:app", "worker"),
        *("-Q", ",".join(map(settings.queue_name, queues))),
        *("-n", name, "--concurrency", str(settings.worker_processes)),
        *("--without-gossip", "--without-mingle", "-l", settings.log_level),
    )


def api_command(*, descriptor: int | None = None) -> tuple[str, ...]:
    """Return the command of the API, on an inherited listening socket or on host and port."""
    inherited = () if descriptor is None else (str(descriptor),)
    return (sys.executable, "-m", "service.supervisor.api", *inherited)


def replace_process(command: Sequence[str], environment: Mapping[str, str]) -> None:
    """Become another program: same process, same terminal, signals go to it directly."""
    os.execve(command[0], list(command), dict(environment))
