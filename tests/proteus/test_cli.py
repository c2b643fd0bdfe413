import hashlib
import json
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

from proteus.cli.program import app
from proteus.client import Client, ServiceError, UnreachableError
from tests.proteus.fake_service import FakeService, Run, problem

# -- collections, shapes, jobs, models -----------------------------------------------------


def test_collection_is_created_listed_shown_and_deleted(run: Run, fake: FakeService) -> None:
    for name in ("animals", "tools"):
        assert run("collections", "create", name).exit_code == 0
    listed = run("collections", "list", "--json")
    assert [item["name"] for item in json.loads(listed.stdout)] == ["animals", "tools"]
    table = run("collections", "list").stdout
    assert "animals" in table
    assert "tools" in table
    assert json.loads(run("collections", "show", "tools", "--json").stdout)["model"] == "heat"
    assert run("collections", "delete", "tools", "--yes").exit_code == 0
    assert set(fake.collections) == {"animals"}


def test_deletion_asks_first(run: Run, fake: FakeService) -> None:
    run("collections", "create", "animals")
    assert run("collections", "delete", "animals").exit_code == 1
    assert set(fake.collections) == {"animals"}


def test_problem_is_told_and_fails(run: Run) -> None:
    run("collections", "create", "animals")
    result = run("collections", "create", "animals")
    assert result.exit_code == 1
    assert "the collection animals exists" in result.stderr
    assert result.stdout == ""


def test_problem_is_the_json_document(run: Run) -> None:
    result = run("shapes", "show", "none", "--json")
    assert result.exit_code == 1
    document = json.loads(result.stdout)
    assert document["type"] == "/problems/shape-not-found"
    assert document["status"] == 404


def test_markup_in_a_problem_is_text(run: Run, fake: FakeService) -> None:
    fake.failures = [problem(422, "invalid-mesh", "found [red] and [/nonsense]")]
    result = run("collections", "list")
    assert "found [red] and [/nonsense]" in result.stderr


def test_wrong_key_says_how_to_give_one(run: Run, fake: FakeService) -> None:
    fake.failures = [problem(401, "unauthorized", "this needs a key")]
    result = run("collections", "list", "--key", "secret")
    assert result.exit_code == 1
    assert "PROTEUS_KEY" in result.stderr
    assert fake.requests[-1].headers["Authorization"] == "Bearer secret"


def test_url_and_key_come_from_the_environment(
    run: Run, fake: FakeService, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PROTEUS_URL", "http://elsewhere:9000/")
    monkeypatch.setenv("PROTEUS_KEY", "from-environment")
    assert run("collections", "list").exit_code == 0
    assert fake.requests[-1].url.host == "elsewhere"
    assert fake.requests[-1].headers["Authorization"] == "Bearer from-environment"


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


def test_answer_that_is_no_json_is_said_so(run: Run, fake: FakeService) -> None:
    fake.failures = [httpx.Response(200, text="<html>")]
    result = run("collections", "list")
    assert result.exit_code == 1
    assert "no JSON object" in result.stderr


def test_shapes_are_listed_by_label_and_fetched(
    run: Run, fake: FakeService, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    fake.add_shape("default", "cat-01.ply", "cat", b"1")
    fake.add_shape("default", "dog-01.ply", "dog", b"2")
    listed = json.loads(run("shapes", "list", "--label", "dog", "--json").stdout)
    assert [shape["name"] for shape in listed] == ["dog-01.ply"]
    assert run("shapes", "mesh", "shape-0", "--format", "glb").exit_code == 0
    assert Path("cat-01.glb").read_bytes() == b"OFF"
    assert fake.requests[-2].url.params["format"] == "glb"
    assert run("shapes", "delete", "shape-0", "shape-1").exit_code == 0
    assert fake.shapes == {}


def test_watched_job_is_followed_to_its_end(run: Run, fake: FakeService) -> None:
    fake.new_job("ingest", "default", total=3)
    result = run("jobs", "watch", "job-0", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["state"] == "succeeded"


def test_watched_job_that_fails_says_why(run: Run, fake: FakeService) -> None:
    fake.new_job("ingest", "default", total=1, errors=[{"item": "a.ply", "detail": "no faces"}])
    result = run("jobs", "watch", "job-0")
    assert result.exit_code == 1
    assert "a.ply: no faces" in result.stderr
    assert run("jobs", "watch", "job-0", "--json").exit_code == 1


def test_job_is_cancelled_and_retried(run: Run, fake: FakeService) -> None:
    fake.new_job("ingest", "default", total=3)
    assert "cancelled" in run("jobs", "cancel", "job-0").stdout
    assert json.loads(run("jobs", "retry", "job-0", "--json").stdout)["state"] == "queued"
    assert "job-0" in run("jobs", "list").stdout


def test_models_are_listed_shown_and_activated(run: Run, fake: FakeService) -> None:
    run("collections", "create", "default")
    assert "heat" in run("models", "list").stdout
    shown = run("models", "show", "heat").stdout
    assert "distance-distribution" in shown
    assert "closed: cap-holes (longest 50), smooth (time 0.0003, steps 3), 100 eigenpairs" in shown
    result = run("models", "activate", "commute-time", "--json")
    assert json.loads(result.stdout)["state"] == "succeeded"
    assert fake.collections["default"]["model"] == "commute-time"


def test_shapes_that_a_model_cannot_describe_are_named(run: Run, fake: FakeService) -> None:
    run("collections", "create", "default")
    reason = "the kernel is known for eigenvalues from 1 to 9, but the spectrum has 12"
    fake.describe_errors = [{"item": "sword.off", "type": "kernel-domain", "detail": reason}]
    shown = " ".join(run("models", "activate", "heat").stdout.split())
    assert "not found under heat" in shown
    assert f"sword.off {reason}" in shown


def test_a_model_is_trained_and_its_figures_are_shown(run: Run, fake: FakeService) -> None:
    result = run("models", "train", "mine", "-t", "scale", "-t", "noise", "--strength", "3",
                 "--splines", "8", "--shapes", "4", "--seed", "1")  # fmt: skip
    assert fake.queries[-1] == {
        "name": "mine", "method": "spline", "parameters": {"splines": 8},
        "training": {
            "transformations": ["scale", "noise"], "strengths": [3], "shapes": 4, "seed": 1
        },
    }  # fmt: skip
    assert result.exit_code == 0
    for text in (result.stdout, run("models", "show", "mine").stdout):
        for figure in ("0.011", "0.022", "0.066", "0.217", "-1.15", "1 to 230", "ready"):
            assert figure in text


def test_what_is_not_said_of_a_training_is_the_papers(run: Run, fake: FakeService) -> None:
    from workers.transformations import PAPER_TRANSFORMATIONS

    eleven = {"transformations": list(PAPER_TRANSFORMATIONS)}
    document = json.loads(run("models", "train", "mine", "--json").stdout)
    assert (document["model"]["name"], document["job"]["state"]) == ("mine", "succeeded")
    assert fake.queries[-1]["training"] == eleven
    run("models", "train", "mine", "--method", "grid", "-t", "paper", "-t", "view", "--no-wait")
    assert fake.queries[-1]["training"]["transformations"] == [*PAPER_TRANSFORMATIONS, "view"]
    run("models", "train", "mine", "-c", "zoo", "--correspondence", "vertex-order")
    assert fake.queries[-1]["training"] == {"collection": "zoo", "correspondence": "vertex-order"}


def test_a_model_with_nothing_to_learn_is_ready_at_once(run: Run, fake: FakeService) -> None:
    result = run("models", "train", "short", "--method", "heat", "--time", "0.05")
    body = {"name": "short", "method": "heat", "parameters": {"time": 0.05}}
    assert fake.queries[-1] == body
    assert "short is ready" in result.stdout


# -- the client ----------------------------------------------------------------------------


def test_patient_client_outlasts_a_restart(
    fake: FakeService, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("proteus.client.time.sleep", lambda seconds: None)
    fake.failures = [
        httpx.ConnectError("refused"),
        httpx.ReadError("reset"),
        httpx.Response(503),
        httpx.Response(429, headers={"Retry-After": "1"}),
    ]
    with Client(patience_seconds=60, transport=fake.transport()) as client:
        assert client.get("/healthz") == {"status": "ok"}
    assert len(fake.requests) == 5


def test_impatient_client_gives_up_at_once(fake: FakeService) -> None:
    fake.failures = [httpx.ConnectError("refused")]
    with Client(transport=fake.transport()) as client, pytest.raises(UnreachableError):
        client.get("/healthz")


def test_patient_client_does_not_repeat_a_refusal(fake: FakeService) -> None:
    with (
        Client(patience_seconds=60, transport=fake.transport()) as client,
        pytest.raises(ServiceError, match="nothing at /nowhere"),
    ):
        client.get("/nowhere")
    assert len(fake.requests) == 1


def test_pages_stop_at_the_limit(fake: FakeService) -> None:
    with Client(transport=fake.transport()) as client:
        for name in ("a", "b", "c"):
            client.request("POST", "/v1/collections", json={"name": name})
        found = list(client.pages("/v1/collections", limit=2))
    assert [item["name"] for item in found] == ["a", "b"]


# -- the program ---------------------------------------------------------------------------


def test_help_names_every_command(run: Run) -> None:
    text = run("--help").stdout
    names = "serve worker api migrate demo upload query collections shapes jobs models doctor"
    assert [
        name for name in [*names.split(), "evaluate", "creatures", "key"] if f" {name} " not in text
    ] == []


def test_key_is_drawn_with_the_entry_that_knows_it(run: Run) -> None:
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
    told = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, timeout=60
    )
    assert told.returncode == 1
    assert "boom" in told.stderr
    assert "Traceback" not in told.stderr


def test_unknown_setting_is_wrong_usage(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PROTEUS_PROT", "8000")
    result = run("serve", "--data-dir", str(tmp_path))
    assert result.exit_code == 2
    assert "PROTEUS_PROT" in result.stderr


def test_client_variables_are_no_unknown_settings(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PROTEUS_URL", "http://127.0.0.1:1")
    monkeypatch.setenv("PROTEUS_KEY", "x")
    result = run("doctor", "--data-dir", str(tmp_path), "--json")
    names = [check["name"] for check in json.loads(result.stdout)["checks"]]
    assert "settings" not in names


def test_doctor_on_a_fresh_machine_is_content(run: Run, fake: FakeService, tmp_path: Path) -> None:
    fake.failures = [httpx.ConnectError("refused")]
    result = run("doctor", "--data-dir", str(tmp_path / "new"), "--json")
    checks = {check["name"]: check for check in json.loads(result.stdout)["checks"]}
    assert {"python", "packages", "data directory", "disk", "lock", "database", "broker"} <= set(
        checks
    )
    assert checks["service"]["state"] == "warning"
    assert "proteus serve" in checks["service"]["advice"]
    assert not (tmp_path / "new").exists()  # it only looks


def test_doctor_finds_a_broken_database(run: Run, tmp_path: Path) -> None:
    (tmp_path / "proteus.sqlite3").write_bytes(b"no database" * 100)
    result = run("doctor", "--data-dir", str(tmp_path), "--json")
    assert result.exit_code == 1
    document = json.loads(result.stdout)
    assert document["healthy"] is False
    states = {check["name"]: check["state"] for check in document["checks"]}
    assert states["database"] == "failed"
