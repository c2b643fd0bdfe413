"""A reader in a process of its own, ended where it takes too long."""

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

CHILD = Path(__file__).with_name("child.py")
START_SECONDS = 120.0


@dataclass
class Reader:
    """One reader, started anew after each file that it did not survive.

    Attributes
    ----------
    name : str
        A key of ``child.READERS``.
    python : str
        The interpreter that has it.
    seconds : float
        For one file.
    memory : int
        Bytes that it may take.
    version : str
    endings : list of str or None
        Of the names of files that it reads; None for any.
    """

    name: str
    python: str = sys.executable
    seconds: float = 60.0
    memory: int = 4 << 30
    version: str = ""
    endings: list[str] | None = None
    _process: "subprocess.Popen[bytes] | None" = field(default=None, repr=False)

    def start(self) -> bool:
        """Start it; whether it is installed."""
        self._process = subprocess.Popen(
            [self.python, "-I", str(CHILD), self.name, str(self.memory)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # what it starts is ended with it
        )
        first = self._line(START_SECONDS)
        if not first or "endings" not in first:
            self.stop()
            return False
        self.version, self.endings = first["version"], first["endings"]
        return True

    def takes(self, path: Path) -> bool:
        """Whether it reads files of this name."""
        if self.endings is None:
            return True
        name = path.name.lower()
        return any(name.endswith(f".{ending}") for ending in self.endings)

    def ask(self, path: Path) -> dict[str, Any]:
        """Return what it makes of a file, or ``error`` and ``type``."""
        if self._process is None and not self.start():
            return {"error": "it did not start again", "type": "crash"}
        assert self._process is not None
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(str(path)).encode() + b"\n")
            self._process.stdin.flush()
            answer = self._line(self.seconds)
        except BrokenPipeError:
            answer = {}
        if answer is None:
            self.stop()
            return {"error": f"took more than {self.seconds:.0f} s and was ended", "type": "hang"}
        if not answer:
            status = self._process.wait()
            self.stop()
            return {"error": f"its process ended ({_words(status)})", "type": "crash"}
        return answer

    def stop(self) -> None:
        """End its process."""
        if self._process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.communicate()
        self._process = None

    def _line(self, seconds: float) -> dict[str, Any] | None:
        """Return the next line of its answers; empty where it ended, None where it takes longer."""
        assert self._process is not None
        assert self._process.stdout is not None
        descriptor = self._process.stdout.fileno()
        until, line = time.monotonic() + seconds, b""
        with selectors.DefaultSelector() as selector:
            selector.register(descriptor, selectors.EVENT_READ)
            while not line.endswith(b"\n"):
                if not selector.select(max(until - time.monotonic(), 0.0)):
                    return None
                part = os.read(descriptor, 1 << 16)
                if not part:
                    return {}
                line += part
        found: dict[str, Any] = json.loads(line)
        return found


def _words(status: int) -> str:
    """Name how a process ended."""
    return signal.Signals(-status).name if status < 0 else f"status {status}"
