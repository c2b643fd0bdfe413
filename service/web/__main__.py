"""Builds the page, with Node from a PyPI wheel: ``python -m service.web``, or ``make page``.

The same sources are built once: a digest of them lies beside what was built.
"""

import argparse
import hashlib
import subprocess
import sys
from pathlib import Path

from service.web import creatures

FOLDER = Path(__file__).parent
SOURCES = ("index.html", "package.json", "package-lock.json", "vite.config.ts", "src", "public")
BUILT = FOLDER / "dist"
DIGEST = BUILT / ".sources"
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


def main(arguments: list[str] | None = None) -> int:
    """Build the page, check it, write the types of the service, or tell whether it is built."""
    parser = argparse.ArgumentParser(prog="python -m service.web", description=__doc__)
    parser.add_argument("--is-built", action="store_true", help="exit code 1 if it is not")
    parser.add_argument("--check", action="store_true", help="types and unit tests")
    parser.add_argument(
        "--types", action="store_true", help="write src/api/schema.ts and endings.ts"
    )
    asked = parser.parse_args(arguments)
    if asked.is_built:
        return 0 if is_built() else 1
    from service.web import endings, node, schema  # they need Node's wheel

    try:
        if asked.types:
            endings.write_endings()
            schema.write_types()
        elif asked.check:
            endings.check_endings()
            schema.check_types()
            node.install(FOLDER)
            node.npm("run", "--silent", "check", folder=FOLDER)
        elif not is_built():
            node.install(FOLDER)
            node.npm("run", "--silent", "build", folder=FOLDER)
            creatures.write_archive(BUILT / creatures.NAME)
            DIGEST.write_text(_contents())
    except (
        subprocess.CalledProcessError,
        schema.OutdatedTypesError,
        endings.OutdatedEndingsError,
    ) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
