"""``proteus benchmark``: a small one built, and measured on the real application."""

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from proteus.benchmark.build import Built, build_benchmark
from proteus.benchmark.plan import BenchmarkOptions
from proteus.benchmark.run import collection_name
from proteus.cli.program import app
from tests.proteus.conftest import Run, upload_files
from tests.proteus.real_service import RealService
from tests.service.running import zoo_files

TINY = BenchmarkOptions(
    creatures=2, creature_vertices=2000, transformations=("scale", "noise"), strengths=(1,)
)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    return build_benchmark(TINY, tmp_path_factory.mktemp("Tiny set"), processes=1)


@pytest.fixture
def run(service: RealService, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.setenv("PROTEUS_URL", service.url)

    def invoke(*arguments: object) -> Result:
        return CliRunner().invoke(app, ["benchmark", *map(str, arguments)])

    return invoke


def test_build_says_what_was_made_and_makes_it_once(run: Run, tmp_path: Path) -> None:
    options = ("--creatures", 1, "--creature-vertices", 2000, "-t", "scale", "-s", 2, "-s", 1)
    first = run("build", "--out", tmp_path / "out", *options, "--json")
    assert first.exit_code == 0, first.output
    told = json.loads(first.stdout)
    assert (told["nulls"], told["queries"], told["distractors"]) == (1, 2, 0)
    names = {path.name.split(".", 1)[1] for path in (tmp_path / "out").glob("*.ply")}
    assert names == {"null.0.ply", "scale.1.ply", "scale.2.ply"}
    second = run("build", "--out", tmp_path / "out", *options)
    assert second.exit_code == 0, second.output
    assert "1 nulls, 0 distractors, 2 queries" in second.stdout


def test_build_names_what_it_left_out_and_says_so_by_its_exit_code(
    run: Run, built: Built, tmp_path: Path
) -> None:
    nulls = tmp_path / "nulls"
    nulls.mkdir()
    good = next(path for path in built.files if ".null." in path.name)
    (nulls / good.name).write_bytes(good.read_bytes())
    (nulls / "broken.off").write_bytes(b"OFF\n1 1 0\n")
    result = run("build", "--nulls", nulls, "--out", tmp_path / "out", "-t", "scale", "-s", "1")
    assert result.exit_code == 1
    assert "broken (null)" in result.stdout
    assert "1 nulls, 0 distractors, 1 queries" in result.stdout


def test_build_refuses_options_that_make_no_sense(run: Run, tmp_path: Path) -> None:
    nothing = run("build", "--out", tmp_path / "out")
    assert nothing.exit_code == 1
    assert "needs null shapes" in nothing.stderr
    unknown = run("build", "--out", tmp_path / "out", "--creatures", 1, "-t", "melting")
    assert unknown.exit_code == 1
    assert "melting" in unknown.stderr
    assert not (tmp_path / "out").exists()


def test_run_uploads_and_shows_table_1(run: Run, built: Built, service: RealService) -> None:
    result = run("run", built.folder, "-m", "heat", "-m", "commute-time")
    assert result.exit_code == 0, result.output
    name = collection_name(built)
    assert name.startswith("tiny-set")
    with service.client() as client:
        shapes = [*client.pages(f"/v1/collections/{name}/shapes")]
        found = next(e for e in client.pages("/v1/evaluations") if e["collection"] == name)
        found = client.get(f"/v1/evaluations/{found['id']}")
    assert len(shapes) == 6
    assert {shape["transformation"] for shape in shapes} == {"null", "scale", "noise"}
    assert {shape["label"] for shape in shapes} == {s["label"] for s in built.manifest["shapes"]}
    assert "mean of rows" in result.stdout
    rows = [line.replace("*", "").split() for line in result.stdout.splitlines()]
    for transformation, row in found["table"].items():
        figures = [f"{row[model]:.1f}" for model in ("heat", "commute-time")]
        assert [transformation, *figures] in rows
    assert found["table"]["scale"]["commute-time"] == 100.0  # it does not see scale


def test_run_makes_models_of_another_view_once(
    run: Run, built: Built, service: RealService
) -> None:
    for _ in range(2):
        result = run("run", built.folder, "-m", "commute-time", "--view", "open", "--json")
        assert result.exit_code == 0, result.output
        assert json.loads(result.stdout)["models"] == ["commute-time-open"]
    with service.client() as client:
        assert client.get("/v1/models/commute-time-open")["parameters"]["view"] == "open"
    closed = run("run", built.folder, "-m", "commute-time", "--view", "closed", "--json")
    assert json.loads(closed.stdout)["models"] == ["commute-time"]
    refused = run("run", built.folder, "-m", "proteus", "--view", "open")
    assert refused.exit_code == 1
    assert "has to be trained" in refused.stderr


def test_run_saves_json_or_csv(run: Run, built: Built, tmp_path: Path) -> None:
    for ending in ("json", "csv"):
        out = tmp_path / f"table.{ending}"
        assert run("run", built.folder, "-m", "heat", "--out", out).exit_code == 0
    table = json.loads((tmp_path / "table.json").read_text())["table"]
    head, *rows = list(csv.reader((tmp_path / "table.csv").read_text().splitlines()))
    assert head == ["transformation", "strength", "heat"]
    assert ["scale", "", str(table["scale"]["heat"])] in rows
    refused = run("run", built.folder, "--out", tmp_path / "table.xml")
    assert refused.exit_code == 1
    assert "expected .json or .csv" in refused.stderr


def test_run_refuses_a_collection_with_other_shapes(
    run: Run, built: Built, service: RealService
) -> None:
    with service.client() as client:
        upload_files(client, "taken", {"crate.stl": zoo_files()["crate.stl"]})
    result = run("run", built.folder, "-m", "heat", "-c", "taken")
    assert result.exit_code == 1
    assert "holds 7 shapes, the benchmark 6" in result.stderr


def test_run_needs_a_finished_benchmark(run: Run, tmp_path: Path) -> None:
    result = run("run", tmp_path)
    assert result.exit_code == 1
    assert "holds no benchmark.json" in result.stderr
