"""A running API, its client, and a worker that works when a test says so."""

import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from service.app import create_app
from service.dependencies import Services
from tests.meshes import box, bumpy_sphere, octahedron, scaled, tetrahedron, torus
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh
from workers.pipeline.work import run_pending
from workers.settings import Settings
from workers.storage.database import Database
from workers.storage.models import Part

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of Starlette, which would rather have another client library
    from fastapi.testclient import TestClient as TestClient

Json = dict[str, Any]
SOLVED = "blobs/spectra"
ZOO = ("ball.null.0.off", "ball.scale.2.off", "ring.null.0.ply", "egg.null.0.obj", "crate.stl")


def off(mesh: TriangleMesh) -> bytes:
    return write(mesh, "off")


EGG = off(bumpy_sphere(2, seed=5))
GEM, DIE = off(octahedron()), off(tetrahedron())


def zoo_files() -> dict[str, bytes]:
    """Five small shapes of four kinds; two are the same but for scale."""
    ball = bumpy_sphere(2, seed=1)
    egg = bumpy_sphere(2, seed=2)
    meshes = (ball, scaled(ball, 3.0), torus(24, 12), egg, box(1.0, 2.0, 3.0))
    return {
        name: write(mesh, name.rpartition(".")[2]) for name, mesh in zip(ZOO, meshes, strict=True)
    }


@dataclass
class Api:
    """A running application: its client, and the worker at hand."""

    client: TestClient
    settings: Settings
    shape_ids: dict[str, str] = field(default_factory=dict)

    @property
    def services(self) -> Services:
        services: Services = self.client.app.state.services  # type: ignore[attr-defined]
        return services

    @services.setter
    def services(self, services: Services) -> None:
        self.client.app.state.services = services  # type: ignore[attr-defined]

    def get(self, path: str, status: int = 200, **options: Any) -> Any:
        return checked(self.client.get(path, **options), status)

    def post(self, path: str, status: int = 200, **options: Any) -> Any:
        return checked(self.client.post(path, **options), status)

    def patch(self, path: str, status: int = 200, **options: Any) -> Any:
        return checked(self.client.patch(path, **options), status)

    def put(self, path: str, status: int = 202, **options: Any) -> Any:
        return checked(self.client.put(path, **options), status)

    def delete(self, path: str, status: int = 204, **options: Any) -> Any:
        return checked(self.client.delete(path, **options), status)

    def upload(
        self, collection: str, files: dict[str, bytes], status: int = 202, **options: Any
    ) -> Any:
        parts = [("files", item) for item in files.items()]
        return self.post(f"/v1/collections/{collection}/shapes", status, files=parts, **options)

    def ask(self, collection: str, status: int = 200, /, **body: Any) -> Any:
        return self.post(f"/v1/collections/{collection}/query", status, json=body)

    def ask_mesh(
        self, collection: str, content: bytes, status: int = 200, *, wait: float = 0, **data: Any
    ) -> Any:
        path = f"/v1/collections/{collection}/query/mesh?wait={wait}"
        return self.post(path, status, files={"mesh": ("query.off", content)}, data=data)

    def work(self) -> int:
        """Do all that is queued; returns how many parts that were."""
        services = self.services
        return run_pending(services.database, services.blobs, self.settings)

    @contextmanager
    def worker(self) -> Iterator[None]:
        """Work in the background, as a real worker does."""
        done = threading.Event()

        def loop() -> None:
            while not done.is_set():
                self.work()
                time.sleep(0.02)

        thread = threading.Thread(target=loop)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()


def checked(answer: httpx.Response, status: int) -> Any:
    """The answer's content, after checks that hold for every answer."""
    assert answer.status_code == status, f"{answer.status_code}: {answer.text[:500]}"
    assert answer.headers["X-Request-ID"]
    kind = answer.headers.get("content-type", "")
    if status >= 400:
        assert kind == "application/problem+json"
        problem = answer.json()
        assert set(problem) == {"type", "title", "status", "detail", "instance", "request_id"}
        assert problem["status"] == status
        assert problem["type"].startswith("/problems/")
        assert problem["request_id"] == answer.headers["X-Request-ID"]
        assert "Traceback" not in answer.text
    return answer.json() if "json" in kind else answer.content


class Messages:
    """Stands in for the broker: notes what is sent, and that it was committed before.

    Parameters
    ----------
    settings : Settings
        They say where the rows are.
    """

    def __init__(self, settings: Settings) -> None:
        self._url = settings.resolved_database_url
        self.sent: list[str] = []
        self.alive = True

    def send(self, parts: Sequence[Part]) -> None:
        with closing_database(self._url) as database, database.read() as session:
            for part in parts:
                assert session.get(Part, part.id) is not None, "sent before the commit"
        self.sent += [part.id for part in parts]

    def broker_alive(self) -> bool:
        return self.alive

    def close(self) -> None:
        self.alive = False


@contextmanager
def closing_database(url: str) -> Iterator[Database]:
    database = Database(url)
    try:
        yield database
    finally:
        database.dispose()


@contextmanager
def running(settings: Settings) -> Iterator[Api]:
    """Run the application on a database that is migrated."""
    app = create_app(settings)
    with TestClient(app, raise_server_exceptions=False) as client:
        yield Api(client, settings)


def make_settings(folder: Path, **options: Any) -> Settings:
    """Small working meshes, and a default model of one channel under one view."""
    usual: dict[str, Any] = {
        "working_vertices": 500,
        "worker_processes": 1,
        "default_model": "heat",
    }
    return Settings(data_dir=folder, **(usual | options))
