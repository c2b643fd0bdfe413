"""Uploads while worker, broker and API are killed: nothing acknowledged is lost.

``python -m benchmarks.survival --shapes 300`` starts a service in a new directory and uploads
creatures to it. Meanwhile it kills each of the three processes twice with SIGKILL, and keeps
querying. At the end it counts.
"""

import argparse
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import httpx

from workers.creatures import SPECIES, make_creature
from workers.geometry.formats import write

COLLECTION = "survival"
BATCH = 5  # files in a request
VICTIMS = {"worker": "celery", "broker": "valkey", "API": "service.supervisor.api"}


@dataclass
class Account:
    """What was promised and what came of it."""

    acknowledged: set[str] = field(default_factory=set)
    refused: int = 0
    killed: list[str] = field(default_factory=list)
    acknowledged_at_kill: list[int] = field(default_factory=list)
    answered: int = 0
    unanswered: int = 0
    listed: int = 0
    ready: int = 0
    failed: list[str] = field(default_factory=list)
    distinct_contents: int = 0
    attempts: int = 0

    @property
    def is_clean(self) -> bool:
        """Whether every acknowledged shape is ready, none is there twice, and asking went on."""
        return (
            len(self.acknowledged) == self.listed == self.ready == self.distinct_contents
            and self.answered > 0
        )


def creature_files(count: int) -> Iterator[tuple[str, bytes]]:
    """Names and bytes of distinct creatures: poses of individuals, small ones."""
    poses = 10
    for number in range(count):
        individual, pose = divmod(number, poses)
        species = SPECIES[individual % len(SPECIES)]
        if pose == 0:
            creature = make_creature(species, seed=individual, vertices=2000)
        name = f"{species}-{individual}-{pose}.ply"
        yield name, write(creature.posed(pose), "ply")


@contextmanager
def running_service(folder: Path, *, processes: int | None = None) -> Iterator[tuple[str, int]]:
    """A service with its data in a folder: its URL and its supervisor's process id.

    Its worker has so many processes, or one a processor.
    """
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "proteus.cli", "serve", "--port", str(port)]
    command += ["--data-dir", str(folder)]
    if processes is not None:
        command += ["--workers", str(processes)]
    with (folder / "serve.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL)
    url = f"http://127.0.0.1:{port}"
    try:
        _wait_until_ready(url, seconds=120)
        yield url, process.pid
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            process.kill()


def child_process(parent: int, word: str) -> int | None:
    """Process id of the parent's child whose command line holds a word."""
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            stat = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            command = (entry / "cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        if int(stat[1]) == parent and word in command:
            return int(entry.name)
    return None


def _wait_until_ready(url: str, *, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            if httpx.get(f"{url}/readyz", timeout=5).status_code == 200:
                return
        except httpx.HTTPError:
            pass
        time.sleep(0.3)
    raise SystemExit(f"{url} was not ready within {seconds:.0f} seconds")


def _upload(url: str, count: int, account: Account, pause: float) -> None:
    """Upload creatures, some a request, and again whatever was not acknowledged."""
    batch: list[tuple[str, bytes]] = []
    for number, item in enumerate(creature_files(count), start=1):
        batch.append(item)
        if len(batch) == BATCH or number == count:
            _upload_batch(url, batch, account)
            batch = []
            time.sleep(pause)


def _upload_batch(url: str, batch: list[tuple[str, bytes]], account: Account) -> None:
    files = [("files", item) for item in batch]
    while True:
        try:
            answer = httpx.post(
                f"{url}/v1/collections/{COLLECTION}/shapes", files=files, timeout=60
            )
            if answer.status_code < 300:
                account.acknowledged |= {shape["id"] for shape in answer.json()["shapes"]}
                return
        except httpx.HTTPError:
            pass
        account.refused += 1
        time.sleep(0.3)


def _ask(url: str, account: Account, stop: threading.Event) -> None:
    """Ask with a shape that is known, again and again."""
    name, data = next(creature_files(1))
    while not stop.wait(0.5):
        try:
            answer = httpx.post(
                f"{url}/v1/collections/{COLLECTION}/query/mesh",
                params={"wait": "20"},
                files={"mesh": (name, data)},
                timeout=60,
            )
        except httpx.HTTPError:
            account.unanswered += 1
            continue
        if answer.status_code == 200:
            account.answered += 1
        else:
            account.unanswered += 1


def _kill(parent: int, account: Account, *, times: int, pause: float, rng: random.Random) -> None:
    """Kill each process as often as asked, one after another, in an order drawn by lot."""
    order = [name for name in VICTIMS for _ in range(times)]
    rng.shuffle(order)
    for name in order:
        time.sleep(pause)
        pid = None
        while pid is None:
            pid = child_process(parent, VICTIMS[name])
            time.sleep(0.1)
        os.kill(pid, signal.SIGKILL)
        account.killed.append(name)
        account.acknowledged_at_kill.append(len(account.acknowledged))


def survive(count: int, *, times: int = 2, pause: float = 8.0, seconds: float = 3600) -> Account:
    """Upload, kill, ask and count; returns the account.

    Parameters
    ----------
    count : int
        Shapes to upload.
    times : int
        How often each process is killed.
    pause : float
        Seconds between two kills.
    seconds : float
        When to give up waiting for the shapes.
    """
    account = Account()
    with (
        tempfile.TemporaryDirectory(prefix="proteus-survival-") as folder,
        running_service(Path(folder)) as (url, parent),
    ):
        body = {"name": COLLECTION}
        httpx.post(f"{url}/v1/collections", json=body, timeout=60).raise_for_status()
        stop = threading.Event()
        spread = pause * times * len(VICTIMS) * BATCH / count  # uploads last as long as the kills
        uploads = threading.Thread(target=_upload, args=(url, count, account, spread))
        questions = threading.Thread(target=_ask, args=(url, account, stop))
        uploads.start()
        questions.start()
        _kill(parent, account, times=times, pause=pause, rng=random.Random(1))
        uploads.join()
        _wait_for_shapes(url, account, seconds=seconds)
        stop.set()
        questions.join()
    return account


def _wait_for_shapes(url: str, account: Account, *, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            shapes = _all_shapes(url)
        except httpx.HTTPError:
            time.sleep(1)
            continue
        account.listed = len({shape["id"] for shape in shapes})
        account.distinct_contents = len({shape["sha256"] for shape in shapes})
        account.ready = sum(shape["state"] == "ready" for shape in shapes)
        account.failed = [f"{s['name']}: {s['error']}" for s in shapes if s["state"] == "failed"]
        if account.ready + len(account.failed) >= len(account.acknowledged):
            break
        time.sleep(1)
    jobs = httpx.get(f"{url}/v1/jobs", params={"limit": 1000, "kind": "ingest"}, timeout=60)
    account.attempts = max((job["attempts"] for job in jobs.json()["items"]), default=0)


def _all_shapes(url: str) -> list[dict[str, str]]:
    shapes: list[dict[str, str]] = []
    parameters = {"limit": "1000"}
    while True:
        answer = httpx.get(
            f"{url}/v1/collections/{COLLECTION}/shapes", params=parameters, timeout=60
        )
        page = answer.raise_for_status().json()
        shapes += page["items"]
        if page["next_cursor"] is None:
            return shapes
        parameters["cursor"] = page["next_cursor"]


def main() -> None:
    """Print the account; end with 1 unless it is clean."""
    parser = argparse.ArgumentParser(description="kill -9 everything while shapes are uploaded")
    parser.add_argument("--shapes", type=int, default=300)
    parser.add_argument("--times", type=int, default=2)
    parser.add_argument("--pause", type=float, default=8.0)
    options = parser.parse_args()
    account = survive(options.shapes, times=options.times, pause=options.pause)
    lines = {
        "killed": ", ".join(account.killed),
        "shapes acknowledged at each kill": account.acknowledged_at_kill,
        "requests refused or broken, sent again": account.refused,
        "shapes acknowledged": len(account.acknowledged),
        "shapes listed, distinct contents": f"{account.listed}, {account.distinct_contents}",
        "ready": account.ready,
        "failed": account.failed,
        "most attempts of a part": account.attempts,
        "queries answered, not answered": f"{account.answered}, {account.unanswered}",
    }
    for name, value in lines.items():
        sys.stdout.write(f"{name}: {value}\n")
    sys.exit(0 if account.is_clean else 1)


if __name__ == "__main__":
    main()
