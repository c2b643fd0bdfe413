"""The command line beside uploads, queries and evaluations."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from proteus.cli.program import app
from tests.proteus.conftest import Run
from tests.proteus.real_service import Fault, RealService, real_service
from tests.service.running import zoo_files

# -- collections, shapes, jobs, models -----------------------------------------------------


def test_collection_is_created_listed_shown_and_deleted(run: Run) -> None:
    for name in ("animals", "tools"):
        assert run("collections", "create", name, "--description", "some").exit_code == 0
    listed = {item["name"] for item in json.loads(run("collections", "list", "--json").stdout)}
    assert {"animals", "tools", "zoo"} <= listed
    table = run("collections", "list").stdout
    assert "animals" in table
    assert "tools" in table
    shown = json.loads(run("collections", "show", "tools", "--json").stdout)
    assert (shown["model"], shown["description"]) == ("heat", "some")
    assert run("collections", "delete", "tools", "--yes").exit_code == 0
    left = {item["name"] for item in json.loads(run("collections", "list", "--json").stdout)}
    assert left == listed - {"tools"}
    run("collections", "delete", "animals", "--yes")


def test_deletion_asks_first(run: Run) -> None:
    assert run("collections", "delete", "zoo").exit_code == 1
    assert run("collections", "show", "zoo").exit_code == 0


def test_problem_is_shown_and_fails(run: Run) -> None:
    result = run("collections", "create", "zoo")
    assert result.exit_code == 1
    assert "'zoo'" in result.stderr
    assert "request " in result.stderr  # its id, to be found in the log
    assert result.stdout == ""


def test_problem_is_the_json_document(run: Run) -> None:
    result = run("shapes", "show", "none", "--json")
    assert result.exit_code == 1
    document = json.loads(result.stdout)
    assert document["type"] == "/problems/shape-not-found"
    assert document["status"] == 404


def test_markup_in_a_problem_is_text(run: Run) -> None:
    result = run("models", "show", "[red]")
    assert result.exit_code == 1
    assert "[red]" in result.stderr


def test_wrong_key_says_how_to_give_one(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = json.loads(run("key", "laptop", "--scope", "read", "--json").stdout)
    with real_service(tmp_path, api_keys=drawn["setting"]) as guarded:
        monkeypatch.setenv("PROTEUS_URL", guarded.url)
        refused = run("collections", "list", "--key", "secret")
        assert refused.exit_code == 1
        assert "PROTEUS_KEY" in refused.stderr
        monkeypatch.setenv("PROTEUS_KEY", drawn["key"])
        assert run("collections", "list").exit_code == 0
        assert run("collections", "create", "animals").exit_code == 1  # it may only read


def test_url_and_key_come_from_the_environment(
    run: Run, service: RealService, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PROTEUS_URL", f"{service.url}/")
    monkeypatch.setenv("PROTEUS_KEY", "from-environment")
    assert run("collections", "list").exit_code == 0
    assert service.requests[-1].headers["authorization"] == "Bearer from-environment"


def test_unreachable_service_has_an_exit_code_of_its_own() -> None:
    result = CliRunner().invoke(app, ["collections", "list", "--url", "http://127.0.0.1:1"])
    assert result.exit_code == 3
    assert "no Proteus service answers at http://127.0.0.1:1" in result.stderr
    assert "proteus serve" in result.stderr


@pytest.mark.parametrize("url", ["nonsense", "ftp://host", "http://[", "http://host:port"])
def test_nonsense_url_is_unreachable(url: str) -> None:
    result = CliRunner().invoke(app, ["collections", "list", "--url", url])
    assert result.exit_code == 3, result.exception


def test_wrong_usage_has_exit_code_2(run: Run) -> None:
    assert run("query").exit_code == 2
    assert run("collections", "create").exit_code == 2
    assert run("shapes", "list", "--state", "nonsense").exit_code == 2
    assert run("upload", "/no/such/place").exit_code == 2


def test_answer_that_is_no_json_is_named(run: Run, service: RealService) -> None:
    service.faults.append(Fault(200, "<html>"))
    result = run("collections", "list")
    assert result.exit_code == 1
    assert "no JSON object" in result.stderr


def test_shapes_are_listed_by_label_and_fetched(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    listed = json.loads(run("shapes", "list", "-c", "zoo", "--label", "ring", "--json").stdout)
    assert [shape["name"] for shape in listed] == ["ring.null.0.ply"]
    ring = listed[0]["id"]
    assert ring in run("shapes", "list", "-c", "zoo").stdout
    assert run("shapes", "mesh", ring).exit_code == 0
    assert Path("ring.null.0.ply").read_bytes() == zoo_files()["ring.null.0.ply"]
    assert run("shapes", "mesh", ring, "--format", "glb").exit_code == 0
    assert Path("ring.null.0.glb").read_bytes().startswith(b"glTF")
    assert run("shapes", "thumbnail", ring, "--out", "ring.png").exit_code == 0
    assert Path("ring.png").read_bytes().startswith(b"\x89PNG")
    assert run("shapes", "show", ring).exit_code == 0


def test_shapes_are_deleted(run: Run, tmp_path: Path) -> None:
    for name in ("crate.stl", "egg.null.0.obj"):
        (tmp_path / name).write_bytes(zoo_files()[name])
    assert run("upload", tmp_path, "-c", "doomed").exit_code == 0
    listed = json.loads(run("shapes", "list", "-c", "doomed", "--json").stdout)
    assert run("shapes", "delete", *(shape["id"] for shape in listed)).exit_code == 0
    assert "No such shapes" in run("shapes", "list", "-c", "doomed").stdout


def test_job_is_cancelled_retried_and_watched(
    run: Run, service: RealService, tmp_path: Path
) -> None:
    path = tmp_path / "crate.stl"
    path.write_bytes(zoo_files()["crate.stl"])
    with service.idle():
        sent = json.loads(run("upload", path, "-c", "jobs", "--no-wait", "--json").stdout)
        (job,) = sent["jobs"]
        assert "cancelled" in run("jobs", "cancel", job).stdout
        assert json.loads(run("jobs", "retry", job, "--json").stdout)["state"] == "queued"
        assert job in run("jobs", "list", "--collection", "jobs").stdout
        assert "No such jobs" in run("jobs", "list", "-c", "jobs", "--state", "failed").stdout
    watched = run("jobs", "watch", job, "--json")
    assert watched.exit_code == 0
    assert json.loads(watched.stdout)["state"] == "succeeded"


def test_watched_job_that_fails_says_why(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "broken.off"
    path.write_bytes(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 99\n")
    sent = json.loads(run("upload", path, "-c", "jobs", "--no-wait", "--json").stdout)
    result = run("jobs", "watch", *sent["jobs"])
    assert result.exit_code == 1
    assert "broken.off: " in result.stderr
    assert "99" in result.stderr
    shown = run("jobs", "show", *sent["jobs"]).stdout
    assert "broken.off" in shown
    assert run("jobs", "watch", *sent["jobs"], "--json").exit_code == 1


def test_models_are_listed_shown_and_activated(run: Run) -> None:
    assert "commute-time" in run("models", "list").stdout
    shown = run("models", "show", "heat").stdout
    assert "distance-distribution" in shown
    assert "closed: cap-holes (longest 50), " in shown
    assert "100 eigenpairs" in shown
    run("collections", "create", "moving")
    result = run("models", "activate", "commute-time", "-c", "moving", "--json")
    assert json.loads(result.stdout)["state"] == "succeeded"
    assert json.loads(run("collections", "show", "moving", "--json").stdout)["model"] == (
        "commute-time"
    )


# -- the program ---------------------------------------------------------------------------


def test_help_names_every_command(run: Run) -> None:
    text = run("--help").stdout
    names = "serve worker api migrate demo upload query collections shapes jobs models doctor"
    assert [
        name for name in [*names.split(), "evaluate", "creatures", "key"] if f" {name} " not in text
    ] == []


def test_key_is_drawn_with_the_entry_that_the_service_takes(run: Run) -> None:
    drawn = json.loads(run("key", "laptop", "--scope", "read", "--json").stdout)
    name, digest, scopes = drawn["setting"].split(":")
    assert (name, scopes) == ("laptop", "read")
    assert hashlib.sha256(drawn["key"].encode()).hexdigest() == digest
    assert run("key", "Not a name!").exit_code == 2


def test_fault_is_one_line_without_a_traceback() -> None:
    source = (
        "import sys, proteus.cli.connection as c; from proteus.cli import main\n"
        "def broken(*_): raise RuntimeError('boom')\n"
        "c.Client = broken; sys.argv = ['proteus', 'collections', 'list']; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 1
    assert "boom" in done.stderr
    assert "Traceback" not in done.stderr


def test_unknown_setting_is_wrong_usage(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PROTEUS_PROT", "8000")
    result = run("serve", "--data-dir", tmp_path)
    assert result.exit_code == 2
    assert "PROTEUS_PROT" in result.stderr


# -- doctor --------------------------------------------------------------------------------


def test_client_variables_are_no_unknown_settings(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PROTEUS_KEY", "x")
    result = run("doctor", "--data-dir", tmp_path, "--json")
    names = [check["name"] for check in json.loads(result.stdout)["checks"]]
    assert "settings" not in names


def test_doctor_on_a_fresh_machine_is_content(run: Run, tmp_path: Path) -> None:
    away = ("--url", "http://127.0.0.1:1")
    result = run("doctor", "--data-dir", tmp_path / "new", *away, "--json")
    checks = {check["name"]: check for check in json.loads(result.stdout)["checks"]}
    assert {"python", "packages", "data directory", "disk", "lock", "database", "broker"} <= set(
        checks
    )
    assert checks["service"]["state"] == "warning"
    assert "proteus serve" in checks["service"]["advice"]
    assert not (tmp_path / "new").exists()  # it only looks


def test_doctor_reads_what_a_running_service_says_of_itself(run: Run, tmp_path: Path) -> None:
    result = run("doctor", "--data-dir", tmp_path / "new", "--json")
    checks = {check["name"]: check for check in json.loads(result.stdout)["checks"]}
    assert checks["service"]["state"] == "ok"
    assert checks["readiness"]["state"] == "ok"
    assert "database: ok" in checks["readiness"]["found"]


def test_doctor_finds_a_broken_database(run: Run, tmp_path: Path) -> None:
    (tmp_path / "proteus.sqlite3").write_bytes(b"no database" * 100)
    result = run("doctor", "--data-dir", tmp_path, "--json")
    assert result.exit_code == 1
    document = json.loads(result.stdout)
    assert document["healthy"] is False
    states = {check["name"]: check["state"] for check in document["checks"]}
    assert states["database"] == "failed"
