"""The real application on loopback, with a worker in this process, for tests of its clients.

What cannot be made with it (an outage, a refusal, a job that takes long) is a `Fault` of the thin
front that stands before it.
"""

import json
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from proteus.client import Client, Document
from service.app import create_app
from workers.pipeline.work import run_pending
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.migrate import migrate
from workers.storage.models import Part

START_SECONDS = 60.0


@dataclass(frozen=True)
class Request:
    """A request as it arrived."""

    method: str
    path: str
    query: str
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Document:
        """Its body, where that is a JSON object."""
        found: Document = json.loads(self.body)
        return found


@dataclass(frozen=True)
class Fault:
    """What happens to one request instead of its answer.

    Attributes
    ----------
    status, text, headers
        The answer; status 0 breaks the connection off.
    after : bool
        The application has done its work by then.
    path, method : str
        Of the requests that it concerns: those whose path ends so; empty: all.
    """

    status: int = 0
    text: str = ""
    headers: dict[str, str] = field(default_factory=dict)
    after: bool = False
    path: str = ""
    method: str = ""

    def concerns(self, request: Request) -> bool:
        """Whether it happens to this request."""
        return request.path.endswith(self.path) and self.method in {"", request.method}


class Front:
    """Stands before the application: notes requests, and lets faults happen in turn."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self.requests: list[Request] = []
        self.faults: list[Fault] = []
        self.answers_at_once = False
        """Without a ``wait``: what takes long is answered by 202."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer as the application does, unless there is a fault for the request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = await _read(scope, receive)
        self.requests.append(request)
        if self.answers_at_once:
            scope = {**scope, "query_string": b"wait=0"}
        body = iter([{"type": "http.request", "body": request.body, "more_body": False}])

        async def replay() -> Message:
            return next(body, None) or await receive()

        fault = next((fault for fault in self.faults if fault.concerns(request)), None)
        if fault is None:
            await self._app(scope, replay, send)
            return
        self.faults.remove(fault)
        if fault.after:
            await self._app(scope, replay, _ignore)
        await _answer(fault, send)


async def _read(scope: Scope, receive: Receive) -> Request:
    body = b""
    while True:
        message = await receive()
        body += message.get("body", b"")
        if not message.get("more_body"):
            break
    headers = {name.decode().lower(): value.decode() for name, value in scope["headers"]}
    return Request(scope["method"], scope["path"], scope["query_string"].decode(), headers, body)


async def _ignore(_: Message) -> None:
    pass


async def _answer(fault: Fault, send: Send) -> None:
    """Send the fault; an answer that ends before its announced length breaks the connection."""
    length = len(fault.text.encode()) if fault.status else 1
    headers = {"Content-Length": str(length), **fault.headers}
    raw = [(name.encode(), value.encode()) for name, value in headers.items()]
    await send({"type": "http.response.start", "status": fault.status or 200, "headers": raw})
    await send({"type": "http.response.body", "body": fault.text.encode()})


class Alarm:
    """Stands in for the broker: what is sent wakes the worker at hand."""

    def __init__(self, wake: threading.Event) -> None:
        self._wake = wake

    def send(self, parts: Sequence[Part]) -> None:
        """Wake the worker."""
        self._wake.set()

    def broker_alive(self) -> bool:
        """Whether messages arrive."""
        return True

    def close(self) -> None:
        """Nothing is open."""


class RealService:
    """A running service: its URL, what was asked of it, and its worker.

    Parameters
    ----------
    settings : Settings
    """

    def __init__(self, settings: Settings) -> None:
        migrate(settings)
        self.settings = settings
        self.wake = threading.Event()
        self._ending = threading.Event()
        self._may_work = threading.Event()
        self._may_work.set()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("service.app.Dispatcher", lambda _: Alarm(self.wake))
            self.front = Front(create_app(settings))
            config = uvicorn.Config(
                self.front, port=0, log_level="critical", lifespan="on", ws="none", loop="asyncio"
            )
            self._server = uvicorn.Server(config)
            self._threads = [threading.Thread(target=self._server.run)]
            self._threads[0].start()
            self.url = f"http://127.0.0.1:{self._port()}"
        self._threads.append(threading.Thread(target=self._work))
        self._threads[1].start()

    def _port(self) -> int:
        until = time.monotonic() + START_SECONDS
        while not self._server.started and time.monotonic() < until:
            time.sleep(0.01)
        port: int = self._server.servers[0].sockets[0].getsockname()[1]
        return port

    def _work(self) -> None:
        database = Database(self.settings.resolved_database_url)
        blobs = BlobStore(self.settings.resolved_blob_url)
        while not self._ending.is_set():
            self._may_work.wait()
            run_pending(database, blobs, self.settings)
            self.wake.wait(1.0)
            self.wake.clear()
        database.dispose()

    def close(self) -> None:
        """End it."""
        self._ending.set()
        self._may_work.set()
        self.wake.set()
        self._server.should_exit = True
        for thread in self._threads:
            thread.join()

    @contextmanager
    def idle(self) -> Iterator[None]:
        """Leave all work undone for as long as this lasts."""
        self._may_work.clear()
        try:
            yield
        finally:
            self._may_work.set()
            self.wake.set()

    def client(self) -> Client:
        """A client of it."""
        return Client(self.url, patience_seconds=10.0)

    @property
    def requests(self) -> list[Request]:
        """What was asked, the oldest first."""
        return self.front.requests

    def sent(self, method: str, ending: str) -> list[Request]:
        """Requests of a method to paths of this ending."""
        return [r for r in self.requests if r.method == method and r.path.endswith(ending)]

    @property
    def faults(self) -> list[Fault]:
        """What is to happen, each to the next request that it concerns."""
        return self.front.faults


@contextmanager
def real_service(folder: Path, **options: Any) -> Iterator[RealService]:
    """Run a service on a folder; its meshes are small, its default model has one channel."""
    usual: dict[str, Any] = {
        "working_vertices": 500,
        "worker_processes": 1,
        "default_model": "heat",
    }
    service = RealService(Settings(data_dir=folder, **(usual | options)))
    try:
        yield service
    finally:
        service.close()
