"""The whole of ``proteus serve``, with a real broker and stand-ins for worker and API."""

import contextlib
import http.client
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.supervisor.lock import holder_of

STAND_INS = """
import sys
from service import serve
from proteus.cli import main

PRINTS = "import os; print('migrated', os.environ['PROTEUS_DATABASE_URL'])"
WORKS = '''
import os, time
from redis import Redis
from redis.exceptions import RedisError
url = os.environ["PROTEUS_BROKER_URL"].replace("redis+socket", "unix")
while True:
    try:
        with Redis.from_url(url) as broker, broker.pubsub() as channel:
            channel.psubscribe("control")
            for message in channel.listen():
                pass
    except RedisError:
        time.sleep(0.1)
'''
ANSWERS = '''
import os, socket, sys
from http.server import BaseHTTPRequestHandler, HTTPServer
class Handler(BaseHTTPRequestHandler):
    def do_GET(self):
        content = str(os.getpid()).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)
server = HTTPServer(("127.0.0.1", 0), Handler, bind_and_activate=False)
server.socket = socket.socket(fileno=int(sys.argv[1]))
server.serve_forever()
'''
serve.migrate_command = lambda: (sys.executable, "-c", PRINTS)
serve.worker_command = lambda settings: (sys.executable, "-c", WORKS)
serve.api_command = lambda *, descriptor: (sys.executable, "-c", ANSWERS, str(descriptor))
main()
"""


class Service:
    """``proteus serve`` in a process of its own."""

    def __init__(self, directory: Path, sockets: Path) -> None:
        self.data = directory / "data"
        environment = {k: v for k, v in os.environ.items() if not k.startswith("PROTEUS_")}
        self.process = subprocess.Popen(
            [
                *(sys.executable, "-c", STAND_INS, "serve"),
                *("--data-dir", str(self.data), "--port", "0", "--json"),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**environment, "TMPDIR": str(sockets)},
            start_new_session=True,
        )

    def wait_up(self) -> str:
        """Return the URL that the service has printed."""
        lines = []
        assert self.process.stdout is not None
        for line in self.process.stdout:
            lines.append(line)
            if line.startswith("}"):
                return str(json.loads("".join(lines))["url"])
        raise AssertionError(self.process.communicate()[1])

    def group(self) -> list[int]:
        """Return the ids of the supervisor's children."""
        path = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return [int(pid) for pid in path.read_text().split()]

    def child(self, sign: str) -> int:
        """Return the id of the child whose command contains a text."""
        for pid in self.group():
            with contextlib.suppress(OSError):
                if sign in Path(f"/proc/{pid}/cmdline").read_text():
                    return pid
        return 0

    def ask(self) -> str:
        """Ask the API, waiting while it is away."""
        holder = holder_of(self.data)
        assert holder is not None
        connection = http.client.HTTPConnection(
            holder.url.removeprefix("http://"), timeout=30
        )  # fmt: skip
        try:
            connection.request("GET", "/")
            return connection.getresponse().read().decode()
        finally:
            connection.close()


def _eventually(condition: Callable[[], bool]) -> bool:
    until = time.monotonic() + 30
    while time.monotonic() < until and not condition():
        time.sleep(0.05)
    return condition()


@pytest.fixture
def service(tmp_path: Path, short_folder: Path) -> Iterator[Service]:
    running = Service(tmp_path, short_folder)
    yield running
    running.process.kill()
    running.process.communicate()


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks at processes by /proc")
def test_every_child_recovers_from_a_kill_and_nothing_is_left(service: Service) -> None:
    service.wait_up()
    for sign in ("valkey-server", "psubscribe", "HTTPServer"):
        before = service.child(sign)
        assert before
        os.kill(before, signal.SIGKILL)
        assert _eventually(lambda: service.child(sign) not in {0, before})  # noqa: B023
        assert service.ask() == str(service.child("HTTPServer"))
    children = service.group()
    assert len(children) == 3
    service.process.send_signal(signal.SIGINT)
    _, told = service.process.communicate(timeout=30)
    assert service.process.returncode == 0
    assert told.count("killed by SIGKILL") == 3
    assert not any(Path(f"/proc/{pid}").exists() for pid in children)
    assert holder_of(service.data) is None
    assert "migrated sqlite:///" in (service.data / "logs" / "database.log").read_text()


def test_second_start_on_one_directory_is_refused(
    service: Service, tmp_path: Path, short_folder: Path
) -> None:
    url = service.wait_up()
    second = Service(tmp_path, short_folder)
    document, told = second.process.communicate(timeout=30)
    assert second.process.returncode == 1
    assert f"already served by process {service.process.pid} at {url}" in " ".join(told.split())
    assert "already served" in json.loads(document)["detail"]
    service.process.send_signal(signal.SIGTERM)
    assert service.process.wait(timeout=30) == 0
