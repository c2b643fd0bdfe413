"""Schemathesis asks a real server what its document allows, and much that it does not allow.

Every check of Schemathesis is on, in all of its phases: examples, boundaries, random cases, and
sequences of requests. ``schemathesis.toml`` beside this file names what is expected otherwise,
each with its reason.
"""

import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
import uvicorn
from fastapi import FastAPI
from sqlalchemy import select

from service.app import create_app
from service.security import new_key
from tests.service.conftest import Stock
from tests.service.running import closing_database, make_settings
from workers.errors import ConflictError
from workers.pipeline.work import run_pending
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.jobs import ENDED, cancel_job
from workers.storage.models import Job

HERE = Path(__file__).parent
SEED = 18
CASES = 2
"""Random cases an operation; examples and boundaries come on top."""
PHASES = {False: "examples,coverage,fuzzing,stateful", True: "examples,fuzzing,stateful"}
"""By whether there are keys; what they guard does not depend on the boundaries of values."""
LONG_WORK = ("train", "evaluate", "describe")


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("has_keys", [False, True], ids=["open", "with keys"])
def test_every_answer_is_what_the_document_says(
    has_keys: bool, stock: Stock, tmp_path: Path
) -> None:
    folder = tmp_path / "data"
    shutil.copytree(stock[0], folder)
    token, setting = new_key("all", ["admin"])
    keys = {"api_keys": setting, "key_attempts": ""} if has_keys else {}  # wrong keys are a check
    settings = make_settings(folder, **keys)
    app = create_app(settings)
    operations = sum(len(methods) for methods in app.openapi()["paths"].values())
    with working(settings), serving(app) as url:
        outcome = run_schemathesis(
            url, token if has_keys else None, tmp_path, phases=PHASES[has_keys]
        )
    assert outcome.returncode == 0, outcome.stdout[-100_000:] + outcome.stderr[-5_000:]
    summary = outcome.stdout[outcome.stdout.rindex(" SUMMARY ") :]
    print(summary)  # noqa: T201
    assert f"Tested: {operations}\n" in summary
    found = re.search(r"(\d+) generated, (\d+) passed", summary)
    assert found is not None
    assert int(found[1]) == int(found[2]) > (100 if has_keys else 1000)


def run_schemathesis(
    url: str, token: str | None, folder: Path, *, phases: str
) -> "subprocess.CompletedProcess[str]":
    """Run the program with a fixed seed; it keeps nothing."""
    command = [
        *(str(Path(sys.executable).parent / "schemathesis"), "--config-file"),
        *(str(HERE / "schemathesis.toml"), "run", f"{url}/openapi.json", "--no-color"),
        *("--checks", "all", "--phases", phases, "--seed", str(SEED), "--max-examples", str(CASES)),
        *("--generation-database", "none", "--continue-on-failure"),
    ]
    if token is not None:
        command += ["--header", f"Authorization: Bearer {token}"]
    return subprocess.run(command, cwd=folder, text=True, capture_output=True, timeout=1100)


@contextmanager
def serving(app: FastAPI) -> Iterator[str]:
    """Serve an application on a free port of this machine."""
    config = uvicorn.Config(app, port=0, log_config=None, access_log=False, log_level="error")
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            assert thread.is_alive()
            time.sleep(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        yield f"http://127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join()


@contextmanager
def working(settings: Settings) -> Iterator[None]:
    """Work on uploads and questions as they come, and cancel what would take minutes."""
    done = threading.Event()
    blobs = BlobStore(settings.resolved_blob_url)

    def work() -> None:
        with closing_database(settings.resolved_database_url) as database:
            while not done.wait(0.1):
                with database.begin() as session:
                    long = Job.kind.in_(LONG_WORK), Job.state.not_in(ENDED)
                    for job_id in list(session.scalars(select(Job.id).where(*long))):
                        with suppress(ConflictError):  # it has ended meanwhile
                            cancel_job(session, job_id)
                run_pending(database, blobs, settings)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
