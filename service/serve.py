"""``proteus serve``: broker, database, worker and API as one program."""

import http.client
import os
import socket
from collections.abc import Callable, Mapping
from contextlib import closing
from functools import partial
from pathlib import Path

from service.supervisor.broker import (
    answers,
    broker_command,
    find_broker,
    has_worker,
    prepare_runtime,
    remove_runtime,
    set_aside_broken_log,
)
from service.supervisor.commands import (
    api_command,
    child_environment,
    migrate_command,
    worker_command,
    worker_environment,
)
from service.supervisor.events import Report, StartError
from service.supervisor.health import SocketPing
from service.supervisor.lock import DirectoryLock
from service.supervisor.processes import ChildPlan
from service.supervisor.supervise import Supervisor
from workers.settings import Settings

BACKLOG = 2048


def serve(
    settings: Settings,
    *,
    report: Report,
    environment: Mapping[str, str] | None = None,
    announce: Callable[[str], None] = lambda url: None,
) -> None:
    """Run the whole service until SIGINT or SIGTERM; must be called in the main thread.

    Parameters
    ----------
    settings : Settings
        Port 0 takes a free one.
    report : callable
        Is told what happens, see :class:`service.supervisor.events.Event`.
    environment : mapping, optional
        What the children inherit besides the settings; ``os.environ`` by default.
    announce : callable
        Is given the URL of the API as soon as it is known, before anything is started.

    Raises
    ------
    StartError
        Something is in the way: a running service, a taken port, a child that dies at once.
    """
    environment = os.environ if environment is None else environment
    make_data_directory(settings.data_path)
    with (
        DirectoryLock(settings.data_path) as lock,
        closing(listen(settings.host, settings.port)) as listener,
    ):
        port = listener.getsockname()[1]
        url = local_url(settings.host, port)
        lock.tell(url=url)
        announce(url)
        settings = settings.model_copy(update={"port": port})
        plans = plan_children(settings, environment, listener=listener, lock=lock)
        try:
            Supervisor(plans, report=report).run()
        finally:
            remove_runtime(settings)


def plan_children(
    settings: Settings,
    environment: Mapping[str, str],
    *,
    listener: socket.socket,
    lock: DirectoryLock,
) -> list[ChildPlan]:
    """Return the children in the order of their start."""
    inherited = child_environment(settings, environment)
    common = partial(
        ChildPlan, log_directory=settings.data_path / "logs", descriptors=(lock.descriptor,)
    )
    url = settings.resolved_broker_url
    migrate = common(
        name="database", command=migrate_command(), environment=inherited, once=True,
        ready_seconds=900.0,
    )  # fmt: skip
    worker = common(
        name="worker", command=worker_command(settings),
        environment=worker_environment(settings, environment), ready=partial(has_worker, url),
        grace_seconds=15.0,
    )  # fmt: skip
    descriptor = listener.fileno()
    api = ChildPlan(
        name="api", command=api_command(descriptor=descriptor), environment=inherited,
        log_directory=settings.data_path / "logs", descriptors=(lock.descriptor, descriptor),
        ready=partial(is_ready, settings.host, settings.port),
    )  # fmt: skip
    broker = [] if settings.broker_url else [plan_broker(settings, environment, lock=lock)]
    return [*broker, migrate, worker, api]


def plan_broker(
    settings: Settings, environment: Mapping[str, str], *, lock: DirectoryLock
) -> ChildPlan:
    """Return the plan of the embedded broker."""
    directory = settings.data_path / "broker"
    directory.mkdir(parents=True, exist_ok=True)
    path = prepare_runtime(settings)

    def prepare() -> None:
        prepare_runtime(settings)
        path.unlink(missing_ok=True)

    # An own locale: the server refuses to start under one that is not installed.
    return ChildPlan(
        name="broker",
        command=broker_command(find_broker(environment), socket=path, directory=directory),
        environment={**environment, "LC_ALL": "C"},
        log_directory=settings.data_path / "logs",
        descriptors=(lock.descriptor,),
        prepare=prepare,
        ready=partial(answers, settings.resolved_broker_url),
        ping=partial(SocketPing, path),
        repair=partial(set_aside_broken_log, directory),
    )


def make_data_directory(path: Path) -> None:
    """Make the data directory, or say why it cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StartError(f"the data directory {path} cannot be made: {error.strerror}") from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise StartError(f"the data directory {path} cannot be written to by this user")


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens on the address.

    Raises
    ------
    StartError
        The port is taken, or the host is none of this machine.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        return socket.create_server(address[:2], family=family, backlog=BACKLOG)
    except OSError as error:
        raise StartError(
            f"cannot listen on {host} port {port}: {error.strerror or error}; "
            "choose another with --host and --port"
        ) from None


def local_url(host: str, port: int) -> str:
    """Return the URL under which this machine itself reaches the API."""
    reachable = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{reachable}]:{port}" if ":" in reachable else f"http://{reachable}:{port}"


def is_ready(host: str, port: int) -> bool:
    """Whether the API answers that it can work, within a second."""
    reachable = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}.get(host, host)
    connection = http.client.HTTPConnection(reachable, port, timeout=1)
    try:
        connection.request("GET", "/readyz")
        return connection.getresponse().status < 500
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()
