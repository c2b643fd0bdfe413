"""A real service with a real browser: what a person sees and does."""

import os
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    expect,
    sync_playwright,
)

from proteus.cli.embedded import EmbeddedService, service_for
from proteus.client import Client
from service.web.__main__ import is_built
from tests.servers import unavailable
from workers.creatures import make_creature
from workers.geometry.formats import write
from workers.settings import Settings, load_settings
from workers.transformations import transform

SPECIES = ("human", "horse", "octopus", "spider", "fish", "chair")
ASKED = ("human", "octopus")
PATIENCE_MILLISECONDS = 90_000  # other tests run beside
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader")
HARMLESS = ("GPU stall due to ReadPixels", "GroupMarkerNotSet")  # the software renderer's own


@dataclass
class Running:
    """A service, and the meshes that it was given."""

    url: str
    settings: Settings
    process: EmbeddedService | None
    meshes: Path


@dataclass
class Seen:
    """A page, and what its console said."""

    page: Page
    errors: list[str] = field(default_factory=list)

    def note(self, message: ConsoleMessage) -> None:
        """Keep errors and warnings."""
        told = message.text
        if message.type in {"error", "warning"} and not any(text in told for text in HARMLESS):
            self.errors.append(f"{message.type}: {told}")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium, without a window; its event loop, which other tests must not meet, ends with it."""
    program = os.environ.get("PROTEUS_TEST_CHROMIUM") or shutil.which("chromium")
    if program is None:
        unavailable("no chromium is installed")
    expect.set_options(timeout=PATIENCE_MILLISECONDS)
    with sync_playwright() as library:
        browser = library.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A service with a collection of creatures, named "zoo", and questions in files."""
    if not is_built():
        unavailable("the page is not built; `make page` builds it")
    folder = tmp_path_factory.mktemp("page")
    meshes = folder / "meshes"
    _write_meshes(meshes)
    settings = load_settings(
        data_dir=folder / "data", port=0, worker_processes=1, working_vertices=1000
    )
    with service_for(settings) as (url, process):
        with Client(url, patience_seconds=120) as client:
            for collection in ("zoo", "measured"):
                client.request("POST", "/v1/collections", json={"name": collection})
                files = [
                    ("files", (path.relative_to(meshes / collection).as_posix(), path.read_bytes()))
                    for path in sorted((meshes / collection).rglob("*.ply"))
                ]
                path = f"/v1/collections/{collection}/shapes"
                sent = client.request("POST", path, files=files, params={"wait": 60})
                job = sent.json()["job"]
                while job["state"] in {"queued", "running"}:  # where other tests run beside
                    path = f"/v1/jobs/{job['id']}"
                    job = client.request("GET", path).json()
                    time.sleep(1)
                assert job["state"] == "succeeded"
        yield Running(url, settings, process, meshes)


def _write_meshes(folder: Path) -> None:
    """Two individuals of each species, noisy copies of some to ask with, a file that is no mesh."""
    for species in SPECIES:
        for seed in (1, 2):
            creature = make_creature(species, seed=seed, vertices=2000)
            stored = write(creature.posed(1), "ply")
            _put(folder / "zoo" / species / f"{species}-{seed}.ply", stored)
            if seed == 1 and species in ASKED:
                noisy = transform(creature.rest, "noise", 1, seed=0, pose=creature.posed(2)).mesh
                _put(folder / f"ask {species}.ply", write(noisy, "ply"))
                _put(folder / "measured" / f"{species}.null.0.ply", stored)
                _put(folder / "measured" / f"{species}.noise.1.ply", write(noisy, "ply"))
    _put(folder / "broken.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 99\n")


def _put(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """A profile of its own for each test."""
    context = browser.new_context(viewport={"width": 1440, "height": 1000}, accept_downloads=True)
    context.set_default_timeout(PATIENCE_MILLISECONDS)
    yield context
    context.close()


@pytest.fixture
def seen(context: BrowserContext) -> Iterator[Seen]:
    """A page of which the console stays empty, unless the test takes what it said."""
    page = context.new_page()
    seen = Seen(page)
    page.on("console", seen.note)
    page.on("pageerror", lambda error: seen.errors.append(f"thrown: {error}"))
    yield seen
    assert seen.errors == []
