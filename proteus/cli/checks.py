"""The checks of ``proteus doctor``, with its advice."""

import os
import re
import shutil
import sqlite3
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Literal

from proteus.client import Client, Document, ServiceError, UnreachableError
from proteus.version import DISTRIBUTION
from service.supervisor.broker import answers, find_broker, has_worker
from service.supervisor.events import StartError
from service.supervisor.lock import holder_of
from workers.settings import Settings

ENOUGH_BYTES = 2 << 30
TOO_FEW_BYTES = 200 << 20
OLDEST_PYTHON = (3, 11)

State = Literal["ok", "warning", "failed"]


@dataclass(frozen=True)
class Check:
    """One finding.

    Attributes
    ----------
    name : str
        What was looked at.
    state : {"ok", "warning", "failed"}
        ``warning``: it works, or is merely not running; ``failed``: it will not work.
    found : str
        What was found.
    advice : str
        What to do; empty if nothing.
    """

    name: str
    state: State
    found: str
    advice: str = ""

    def to_json(self) -> Document:
        """Return it as a JSON object."""
        return asdict(self)


def check_machine() -> Iterator[Check]:
    """Check the interpreter and the installed packages."""
    found = ".".join(str(part) for part in sys.version_info[:3])
    if sys.version_info >= OLDEST_PYTHON:
        yield Check("python", "ok", f"{found} in {sys.prefix}")
    else:
        yield Check("python", "failed", found, "install Python 3.11 or newer")
    missing = missing_packages()
    if missing:
        names = ", ".join(missing)
        yield Check("packages", "failed", f"missing: {names}", "run make setup, or pip install .")
    else:
        yield Check("packages", "ok", "all there")


def missing_packages() -> list[str]:
    """Return the names of required packages that are not installed."""
    try:
        requirements = requires(DISTRIBUTION) or []
    except PackageNotFoundError:
        return [DISTRIBUTION]
    needed = [line for line in requirements if "extra ==" not in line]
    names = [re.split(r"[\s<>=!~;\[]", line, maxsplit=1)[0] for line in needed]
    return [name for name in names if not _installed(name)]


def _installed(name: str) -> bool:
    try:
        version(name)
    except PackageNotFoundError:
        return False
    return True


def check_data(settings: Settings) -> Iterator[Check]:
    """Check the data directory, who holds it, the disk and an SQLite database."""
    path = settings.data_path
    existing = next(part for part in [path, *path.parents] if part.exists())
    if path.exists() and not path.is_dir():
        yield Check("data directory", "failed", f"{path} is a file", "choose another --data-dir")
    elif not os.access(existing, os.W_OK | os.X_OK):
        advice = f"let this user write to {existing}, or choose another --data-dir"
        yield Check("data directory", "failed", f"{path} cannot be written to", advice)
    else:
        note = "" if path.exists() else ", not there yet: the first start makes it"
        yield Check("data directory", "ok", f"{path}{note}")
    yield _check_disk(existing)
    holder = holder_of(path)
    if holder is None:
        yield Check("lock", "ok", "free: no service runs on this data directory")
    elif holder.alive:
        yield Check("lock", "ok", f"held by process {holder.pid}, which serves {holder.url}")
    else:
        advice = "they end by themselves within seconds; if not, end them"
        yield Check("lock", "warning", "held by processes of a run that was killed", advice)
    yield from _check_database(settings)


def _check_disk(path: Path) -> Check:
    free = shutil.disk_usage(path).free
    found = f"{free / 1e9:.1f} GB free"
    if free < TOO_FEW_BYTES:
        return Check("disk", "failed", found, "make room: uploads will fail")
    if free < ENOUGH_BYTES:
        return Check("disk", "warning", found, "make room: a shape takes about 1 MB and its file")
    return Check("disk", "ok", found)


def _check_database(settings: Settings) -> Iterator[Check]:
    """Check that the database can be opened and has a schema."""
    url = settings.resolved_database_url
    if not url.startswith("sqlite:///"):
        where = re.sub(r"//.*@", "//…@", url)
        yield Check("database", "ok", f"{where}: asked through the service, see below")
        return
    path = Path(url.removeprefix("sqlite:///").split("?", maxsplit=1)[0])
    if not path.exists():
        yield Check("database", "ok", f"{path}, not there yet: the first start makes it")
        return
    try:
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=5)
        try:
            revision = connection.execute("SELECT version_num FROM alembic_version").fetchone()
        finally:
            connection.close()
    except sqlite3.Error as error:
        advice = "stop the service and put a copy of the data directory back, or remove it"
        yield Check("database", "failed", f"{path}: {error}", advice)
        return
    if revision is None:
        yield Check("database", "failed", f"{path} has no schema", "run proteus migrate")
    else:
        yield Check("database", "ok", f"{path}, schema {revision[0]}")


def check_broker(settings: Settings) -> Iterator[Check]:
    """Check that there is a broker, running or to be started, and a worker at it."""
    url = settings.resolved_broker_url
    where = re.sub(r"//.*@", "//…@", url)
    if answers(url):
        yield Check("broker", "ok", f"answers at {where}")
        if has_worker(url):
            yield Check("worker", "ok", "listens at the broker")
        else:
            advice = "see logs/worker.log in the data directory; alone it is proteus worker"
            yield Check("worker", "failed", "none listens at the broker", advice)
        return
    if settings.broker_url:
        advice = "start it, or correct PROTEUS_BROKER_URL"
        yield Check("broker", "failed", f"none answers at {where}", advice)
        return
    try:
        program = find_broker(os.environ)
    except StartError as error:
        yield Check("broker", "failed", "no program found", str(error))
        return
    yield Check("broker", "ok", f"not running; proteus serve starts {program}")


def check_service(client: Client) -> Iterator[Check]:
    """Check that a service answers at the client's URL, and that it is ready."""
    try:
        client.request("GET", "/healthz")
    except UnreachableError:
        advice = "start it with proteus serve, or say where it is with --url"
        yield Check("service", "warning", f"none answers at {client.url}", advice)
        return
    except ServiceError as error:
        advice = "something else may listen on this port; choose another with --port"
        yield Check("service", "failed", f"{client.url} answers {error.status}: {error}", advice)
        return
    yield Check("service", "ok", f"answers at {client.url}")
    try:
        state = client.get("/readyz")
    except ServiceError as error:
        advice = "see logs/api.log in the data directory"
        yield Check("readiness", "failed", str(error), advice)
        return
    except UnreachableError as error:
        yield Check("readiness", "failed", str(error), "see logs/api.log in the data directory")
        return
    yield _readiness(state)


def _readiness(state: Document) -> Check:
    """Return the answer of ``/readyz`` as a check: a status, and one entry for each part."""
    status = str(state.get("status", "ok"))
    parts = [f"{name}: {value}" for name, value in _flat(state) if name != "status"]
    found = ", ".join([status, *parts])
    if status == "degraded":
        advice = "searching works, computing waits: see logs/broker.log and logs/worker.log"
        return Check("readiness", "warning", found, advice)
    return Check("readiness", "ok", found)


def _flat(state: Document) -> Iterator[tuple[str, object]]:
    for name, value in state.items():
        if isinstance(value, dict):
            yield from _flat(value)
        else:
            yield name, value
