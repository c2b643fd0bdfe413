"""What an import of the client costs, and which parts of the engine Proteus may touch."""

import subprocess
import sys

import pytest

HEAVY = "numpy scipy typer rich click httpx pydantic sqlalchemy celery fastapi workers service"


def printed(source: str) -> str:
    """What a fresh interpreter prints."""
    done = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, check=True, timeout=60
    )
    return done.stdout.strip()


@pytest.mark.parametrize("statement", ["import proteus", "from proteus import Client"])
def test_the_client_is_imported_with_the_standard_library_alone(statement: str) -> None:
    loaded = f"[name for name in {HEAVY.split()} if name in sys.modules]"
    assert printed(f"import sys; {statement}; print({loaded})") == "[]"


def test_the_client_changes_nothing_in_the_process() -> None:
    """A program that imports it keeps its own threads and settings."""
    source = "import os; before = dict(os.environ); import proteus; proteus.Client().close()"
    assert printed(f"{source}; print(dict(os.environ) == before)") == "True"


def test_the_command_line_imports_no_numerics() -> None:
    """They would cost every command half a second, and the supervisor their memory."""
    heavy = "numpy scipy sqlalchemy celery fastapi uvicorn trimesh skimage PIL"
    loaded = f"[name for name in {heavy.split()} if name in sys.modules]"
    assert printed(f"import sys, proteus.cli; print({loaded})") == "[]"


@pytest.mark.parametrize("package", ["proteus.benchmark.build", "proteus.reproduction.report"])
def test_what_computes_computes_as_the_engine_does(package: str) -> None:
    """BLAS is told to use one thread before numpy is loaded."""
    source = "import os; os.environ.pop('OMP_NUM_THREADS', None)"
    assert printed(f"{source}; import {package}; print(os.environ['OMP_NUM_THREADS'])") == "1"
