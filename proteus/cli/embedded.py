"""A service for as long as a command needs one: the one that runs, or one that is started."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

from proteus.terminal.output import CommandError
from service.serve import is_ready
from service.supervisor.lock import holder_of
from service.supervisor.processes import describe_exit, die_with
from workers.settings import PREFIX, Settings

START_SECONDS = 180.0


class EmbeddedService:
    """``proteus serve`` as a child of this process, in the same terminal.

    Parameters
    ----------
    settings : Settings
        Of the service.
    """

    def __init__(self, settings: Settings) -> None:
        self._data_path = settings.data_path
        # In a group of its own: a Ctrl-C reaches this process alone, which hands it on.
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-m", "proteus.cli", "serve", "--json"),
                *("--host", settings.host, "--port", str(settings.port)),
                *("--data-dir", str(settings.data_path)),
                *("--workers", str(settings.worker_processes)),
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,  # this process shows where it is
            env={**os.environ, f"{PREFIX}WORKING_VERTICES": str(settings.working_vertices)},
            process_group=0,
            preexec_fn=partial(die_with, os.getpid()),
        )

    def wait_until_ready(self) -> str:
        """Return the URL once the API is ready.

        Raises
        ------
        CommandError
            It ended or took too long.
        """
        until = time.monotonic() + START_SECONDS
        while time.monotonic() < until:
            code = self._process.poll()
            if code is not None:
                raise CommandError(f"the service could not be started ({describe_exit(code)})")
            url = _url_of(self._data_path, pid=self._process.pid)
            if url and answers_at(url):
                return url
            time.sleep(0.1)
        raise CommandError(f"the service was not ready after {START_SECONDS:.0f} s")

    def wait(self) -> None:
        """Wait until it ends, or until Ctrl-C."""
        with contextlib.suppress(KeyboardInterrupt):
            self._process.wait()

    def stop(self) -> None:
        """Stop it in order; a Ctrl-C meanwhile stops it at once."""
        while self._process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.send_signal(signal.SIGINT)
            with contextlib.suppress(KeyboardInterrupt):
                self._process.wait()


def answers_at(url: str) -> bool:
    """Whether the API at this URL can work."""
    parts = urlsplit(url)
    return is_ready(parts.hostname or "", parts.port or 80)


def _url_of(directory: Path, *, pid: int | None = None) -> str:
    """Return where the service of a data directory listens, or nothing."""
    holder = holder_of(directory)
    if holder is None or not holder.alive or pid not in {None, holder.pid}:
        return ""
    return holder.url


@contextlib.contextmanager
def service_for(settings: Settings) -> Iterator[tuple[str, EmbeddedService | None]]:
    """Use the service that runs on the data directory, or start one.

    Yields
    ------
    url : str
        Of its API.
    service : EmbeddedService or None
        The one that was started, which is stopped at the end.
    """
    url = _url_of(settings.data_path)
    if url:
        if not answers_at(url):
            raise CommandError(f"the service at {url} does not answer; see proteus doctor")
        yield url, None
        return
    service = EmbeddedService(settings)
    try:
        yield service.wait_until_ready(), service
    finally:
        service.stop()
