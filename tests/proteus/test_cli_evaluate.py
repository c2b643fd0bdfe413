"""``proteus evaluate``: a real evaluation on the screen, as JSON and as CSV."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import Result

from proteus.cli.connection import Session
from proteus.cli.evaluate import show
from proteus.client import Document
from proteus.terminal.output import Output
from tests.meshes import bumpy_sphere, torus
from tests.proteus.conftest import Run, upload_files
from tests.proteus.real_service import RealService
from tests.service.running import off, zoo_files
from workers.geometry.mesh import TriangleMesh

MODELS = ("-m", "heat", "-m", "shape-dna")


def shrec() -> dict[str, bytes]:
    """The zoo, with a ring that is none, a second transformation, and shapes without a label."""
    egg, wrong = bumpy_sphere(2, seed=2), bumpy_sphere(2, seed=1)
    grown = TriangleMesh(1.02 * egg.vertices, egg.faces)
    return {
        **zoo_files(),
        "egg.noise.1.off": off(grown),
        "ring.noise.1.off": off(TriangleMesh(1.01 * wrong.vertices, wrong.faces)),
        "unknown.off": off(torus(20, 10)),
    }


@pytest.fixture(scope="module")
def evaluated(running: RealService) -> Iterator[Document]:
    """The evaluation of both models on a collection "shrec", as the service answers it."""
    with running.client() as client:
        upload_files(client, "shrec", shrec())
        yield {}


@pytest.fixture
def found(evaluated: Document, run: Run) -> Document:
    """The evaluation of both models, measured once."""
    if not evaluated:
        result = run("evaluate", "shrec", *MODELS, "--json")
        assert result.exit_code == 0, result.output
        evaluated.update(json.loads(result.stdout))
    return evaluated


def lines(result: Result) -> list[list[str]]:
    """Words of each line."""
    assert result.exit_code == 0, result.output
    return [line.split() for line in result.stdout.splitlines()]


def marked(values: list[float]) -> list[str]:
    """Figures as a row shows them: one digit, a star at the best."""
    texts = [f"{value:.1f}" for value in values]
    best = f"{max(values):.1f}"
    return [text + "*" * (text == best) for text in texts]


def test_the_tables_are_those_of_the_evaluation(
    run: Run, found: Document, service: RealService
) -> None:
    shown = lines(run("evaluate", "shrec", *MODELS))
    asked = service.sent("POST", "/v1/evaluations")[-1].json
    assert asked == {"collection": "shrec", "models": ["heat", "shape-dna"]}
    assert set(found["table"]) == {"scale", "noise"}
    for name, row in found["table"].items():
        assert [name, *marked([row[model] for model in found["models"]])] in shown
    means = [found["mean_of_rows"][model]["value"] for model in found["models"]]
    assert ["mean", "of", "rows", *marked(means)] in shown
    text = " ".join(" ".join(line) for line in shown)
    assert f"shrec: {found['n_queries']} queries, {found['n_targets']} targets" in text
    assert "shape-dna - heat: " in text
    measures = [found["measures"][model]["map"] for model in found["models"]]
    assert ["mean", "average", "precision", *marked(measures)] in shown
    for group in found["skipped"]:
        reason = group["reason"].replace("-", " ")
        assert f"not queries, {reason}: {group['count']}" in text


def test_the_worst_queries_of_the_best_model_are_named(run: Run, found: Document) -> None:
    """The ring that is a ball finds its ring late."""
    shown = lines(run("evaluate", "shrec", *MODELS))
    at = next(i for i, line in enumerate(shown) if line[:2] == ["worst", "queries"])
    query, rank, instead = shown[at + 2]
    assert query == "ring.noise.1.off"
    assert int(rank) > 1
    assert instead in shrec()
    assert not any("worst" in line for line in lines(run("evaluate", "shrec", "--worst", "0")))


def test_a_shape_that_is_gone_meanwhile_is_named_by_its_id(
    service: RealService, found: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    missed = next(row for row in found["ranks"] if row["rank"] > 1)
    gone = {**found, "ranks": [{**missed, "query": "0" * 32, "model": model, "rank": 9}
                               for model in found["models"]]}  # fmt: skip
    with service.client() as client:
        show(Session(client, Output()), gone, by_strength=False, worst=1)
    assert f"{'0' * 32} (deleted)" in capsys.readouterr().out


def test_without_a_model_it_is_the_collections_own(
    run: Run, found: Document, service: RealService
) -> None:
    lines(run("evaluate", "shrec", "--dissimilarity", "chi-squared"))
    assert service.sent("POST", "/v1/evaluations")[-1].json == {
        "collection": "shrec", "models": ["heat"], "dissimilarity": "chi-squared"
    }  # fmt: skip


def test_strengths_are_shown_when_asked_for(run: Run, found: Document) -> None:
    row = ["scale", "2", *marked([found["by_strength"]["scale"]["2"][m] for m in found["models"]])]
    assert row not in lines(run("evaluate", "shrec", *MODELS))
    assert row in lines(run("evaluate", "shrec", *MODELS, "--by-strength"))


def test_csv_has_all_digits(run: Run, found: Document, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    lines(run("evaluate", "shrec", *MODELS, "--csv", path))
    with path.open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head == ["transformation", "strength", "heat", "shape-dna"]
    cells = {(row[0], row[1]): [float(text) for text in row[2:]] for row in rows if row[2]}
    for name, row in found["table"].items():
        assert cells[name, ""] == [row[model] for model in found["models"]]
    for strength, row in found["by_strength"]["noise"].items():
        assert cells["noise", strength] == [row[model] for model in found["models"]]
    assert cells["mean", ""] == [found["mean_of_rows"][m]["value"] for m in found["models"]]
    result = run("evaluate", "shrec", "--csv", tmp_path / "none" / "table.csv")
    assert result.exit_code == 1
    assert "No such file" in result.stderr


def test_left_one_out_it_is_a_table_by_label(
    run: Run, service: RealService, tmp_path: Path
) -> None:
    sizes = {"ball": 1, "egg": 2}
    files = {
        f"{label}/{i}.off": off(TriangleMesh(i * mesh.vertices, mesh.faces))
        for label, seed in sizes.items()
        for mesh in [bumpy_sphere(2, seed=seed)]
        for i in (1, 2)
    }
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    assert run("upload", tmp_path, "-c", "labelled").exit_code == 0
    path = tmp_path / "labels.csv"
    shown = lines(run("evaluate", "labelled", "--csv", path))
    assert ["ball", "100.0"] in shown  # a copy of another size is nearest
    assert ["egg", "100.0"] in shown
    text = " ".join(" ".join(line) for line in shown)
    assert "leave one out" in text
    assert "mean of queries 100.0" in text
    assert path.read_text().splitlines()[1] == "ball,,100.0"


def test_an_evaluation_that_cannot_be_is_refused(run: Run, found: Document) -> None:
    result = run("evaluate", "shrec", "-m", "nonsense")
    assert result.exit_code == 1
    assert "nonsense" in result.stderr


def test_a_failed_job_says_why(run: Run, service: RealService) -> None:
    """The model is deleted between the question and the work."""
    run("models", "train", "short-lived", "--method", "heat", "--time", "0.01")
    with service.client() as client, service.idle():
        asked = {"collection": "zoo", "models": ["short-lived"]}
        job = client.post("/v1/evaluations", asked)["job"]
        deleted = client.request("DELETE", "/v1/models/short-lived")
        assert deleted.status_code == 204
    result = run("jobs", "watch", job["id"])
    assert result.exit_code == 1
    assert "short-lived" in result.stderr
