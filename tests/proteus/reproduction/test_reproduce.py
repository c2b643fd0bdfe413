"""``proteus reproduce`` in small: once on the real application, and once with all processes."""

import json
import os
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from proteus.cli.embedded import service_for
from proteus.cli.reproduce import run_plan
from proteus.client import Client, Document
from proteus.reproduction.models import ensure_model
from proteus.reproduction.plan import (
    CLOSED,
    OPEN,
    SIZES,
    ModelSpec,
    Plan,
    Size,
    closed_models,
    first_models,
    paper_parameters,
)
from proteus.terminal.output import CommandError, Output
from tests.proteus.real_service import RealService
from tests.proteus.reproduction.test_report import read_page
from workers.errors import InvalidRequestError
from workers.settings import load_settings

TINY = Size(2, 1, 2000, 500, (1, 5), 3, (1,), ("isometry", "scale"))
"""Scaled by strength 5, shapes lie beyond what kernels in raw units learned from strength 1."""
KEYS = ("commute", "heat-short", "heat-best", "heat-long", "learned", "distance")


@dataclass(frozen=True)
class Done:
    """A reproduction on the real application, and what it returned."""

    service: RealService
    plan: Plan
    document: Document

    def model(self, key: str) -> Document:
        """One of its models, as the service has it."""
        with self.service.client() as client:
            return client.get(f"/v1/models/{self.plan.model_name(key)}")


def reproduce(service: RealService, plan: Plan) -> Document:
    with Client(service.url) as client:
        return run_plan(client, Output(as_json=True), plan, size="tiny", processes=1)


@pytest.fixture(scope="module")
def done(running: RealService, tmp_path_factory: pytest.TempPathFactory) -> Done:
    plan = Plan(tmp_path_factory.mktemp("out"), TINY)
    return Done(running, plan, reproduce(running, plan))


def test_everything_is_written(done: Done) -> None:
    out = done.plan.out
    written = {path.relative_to(out).as_posix() for path in out.rglob("*")}
    figures = {f"figures/figure{i}.{kind}" for i in range(1, 6) for kind in ("png", "svg")}
    tables = {"table1.csv", "table1.json", "table1-closed.csv", "table1-paper.csv"}
    assert figures | tables | {"report.html", "results.json"} <= written
    assert set(done.document["figures"]) == {str(out / name) for name in figures}
    assert list(done.document["table"]) == ["isometry", "scale", "mean of the rows"]


def test_the_report_is_one_file_that_says_what_was_done(done: Done) -> None:
    reader = read_page((done.plan.out / "report.html").read_text())
    text = " ".join(" ".join(reader.texts).split())
    assert sum(tag == "img" for tag, _ in reader.tags) == 5
    assert sum(tag == "table" for tag, _ in reader.tags) == 4
    time = done.model("heat-time")["kernels"][0]["parameters"]["time"]
    labels = ", ".join(done.model("learned")["training"]["classes"])
    slope = f"{done.model('scale-only')['training']['slope']:.3f}".replace("-", "−")
    for part in (f"slope {slope}", f"t* = {time:.3g}", labels, "Seed", "Slips", "8 queries"):
        assert part in text
    assert "--seed 0" in text
    assert "p²/A at most 50" in text  # loops are closed by their length, decision 8
    assert str(done.plan.out) not in text


def test_shapes_beyond_the_learned_range_are_counted(done: Done) -> None:
    text = " ".join((done.plan.out / "report.html").read_text().split())
    reason = "shapes have eigenvalues beyond the range that a learned kernel was learned on"
    assert f"Table 1: 2 {reason}" in text
    assert "isometry, strength 5" in text  # Fig. 5 takes what can be described


def test_scale_is_found_by_what_does_not_see_it(done: Done) -> None:
    assert done.document["table"]["scale"]["commute"] == 100.0
    assert done.document["table"]["scale"]["distance"] == 100.0
    assert done.model("scale-only")["training"]["slope"] == pytest.approx(-1.0, abs=0.05)


def test_the_columns_are_the_papers_and_one_more_against_commute_time(done: Done) -> None:
    record = json.loads(Path(done.document["results"]).read_text())
    name = done.plan.model_name
    assert record["evaluation"]["models"] == [name(key) for key in KEYS]
    assert record["closed_evaluation"]["models"] == [name(f"{key}-closed") for key in KEYS]
    columns = {key: record["evaluation"]["table"]["isometry"][name(key)] for key in KEYS}
    assert done.document["table"]["isometry"] == columns
    best = done.model("heat-time")["kernels"][0]["parameters"]["time"]
    heat = [done.model(key)["parameters"] for key in KEYS[1:4]]
    assert [one["time"] for one in heat] == pytest.approx([0.7 * best, best, 1.7 * best])
    assert {one["unit"] for one in heat} == {"none"}


def test_views_and_trainings_are_those_that_were_planned(done: Done) -> None:
    with done.service.client() as client:
        models = {model["name"]: model for model in client.pages("/v1/models")}
    own = {n: m for n, m in models.items() if n.startswith(f"{done.plan.name}-{done.plan.digest}")}
    assert len(own) == 8 + 3 + 6
    for name, model in own.items():
        expected = CLOSED if name.endswith("-closed") else OPEN
        assert model["parameters"]["view"] == expected
    trained = done.model("scale-only")["training"]
    assert trained["transformations"] == ["scale"]
    assert trained["shapes"] == TINY.training_shapes
    learned = done.model("learned")
    assert learned["training"]["transformations"] == list(TINY.transformations)
    assert learned["parameters"]["criterion"] == "kernel"
    assert learned["parameters"]["unit"] == "none"
    distance = done.model("distance")["parameters"]
    assert (distance["criterion"], distance["unit"]) == ("distance", "first-eigenvalue")


def test_every_option_of_a_training_is_sent_so_that_no_default_decides(done: Done) -> None:
    for spec in (*first_models(done.plan), *closed_models(done.plan, 1.0)):
        key = spec.key + "-closed" * (spec.parameters["view"] == CLOSED)
        if spec.transformations:
            asked = {**spec.parameters, "splines": spec.parameters.get("splines")}
            parameters = done.model(key)["parameters"]
            assert {name: asked[name] for name in parameters} == parameters


def test_the_record_has_no_ranks_and_can_be_read_again(done: Done) -> None:
    record = json.loads(Path(done.document["results"]).read_text())
    assert "ranks" not in record["evaluation"]
    assert record["models"]["learned"]["kernels"] == done.model("learned")["kernels"]
    assert record["benchmark"]["counts"] == {"nulls": 2, "distractors": 1, "queries": 8}


def test_a_second_run_trains_nothing_and_gives_the_same(done: Done) -> None:
    out = done.plan.out
    written = {p: p.read_bytes() for p in out.iterdir() if p.suffix in {".html", ".csv"}}
    done.service.requests.clear()
    second = reproduce(done.service, done.plan)
    assert done.service.sent("POST", "/v1/models") == []
    assert second["table"] == done.document["table"]
    assert {path: path.read_bytes() for path in written} == written


def test_fig_5_without_a_shape_that_can_be_described_is_refused(
    done: Done, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("proteus.reproduction.run.SIGNED", ("scale",))
    plan = Plan(done.plan.out, TINY, name=done.plan.name)
    with pytest.raises(CommandError, match="outside the range that it was learned on"):
        reproduce(done.service, plan)


def test_a_failed_training_says_why_and_is_begun_again(
    service: RealService, tmp_path: Path
) -> None:
    """A job that is cancelled leaves a model that failed; the next run trains it anew."""
    plan = Plan(tmp_path, TINY)
    spec = ModelSpec("any", "heat-time", paper_parameters(OPEN), ("scale",))

    def cancel() -> None:
        with service.client() as other:
            while not (jobs := [*other.pages("/v1/jobs", kind="train", state="queued")]):
                time.sleep(0.05)
            other.post(f"/v1/jobs/{jobs[0]['id']}/cancel")

    with service.client() as client, service.idle():
        canceller = threading.Thread(target=cancel)
        canceller.start()
        with pytest.raises(CommandError, match=r"training failing: the job .* cancelled"):
            ensure_model(client, Output(as_json=True), plan, spec, "failing")
        canceller.join()
        assert client.get("/v1/models/failing")["state"] == "failed"
    with service.client() as client:
        found = ensure_model(client, Output(as_json=True), plan, spec, "failing")
    assert found["state"] == "ready"
    assert [request.path for request in service.requests if request.method == "DELETE"] == [
        "/v1/models/failing"
    ]


def test_plans_of_other_sizes_and_seeds_share_no_model() -> None:
    plans = [Plan(Path("out"), SIZES["small"]), Plan(Path("out"), SIZES["paper"])]
    plans.append(Plan(Path("out"), SIZES["small"], seed=1))
    assert len({plan.model_name("learned") for plan in plans}) == 3
    for plan in plans:
        names = [plan.model_name(spec.key) for spec in first_models(plan)]
        assert all(len(name) <= 63 for name in names)
        assert [s.parameters["view"] for s in closed_models(plan, 1.0)] == [CLOSED] * 6
    paper = SIZES["paper"]
    assert paper.creatures * len(paper.transformations) * len(paper.strengths) == 715
    assert paper.training_shapes * len(paper.transformations) * len(paper.training_strengths) == 385


def test_a_plan_without_scaling_is_refused() -> None:
    size = Size(2, 1, 2000, 2000, (1,), 3, (1,), ("isometry",))
    with pytest.raises(InvalidRequestError, match="needs the transformation scale"):
        Plan(Path("out"), size)


@pytest.mark.slow
def test_a_tiny_reproduction_with_the_real_service_finds_the_slope_of_commute_time(
    tmp_path: Path, short_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in os.environ if name.startswith("PROTEUS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("TMPDIR", str(short_folder))
    plan = Plan(tmp_path, Size(2, 2, 2000, 1500, (1,), 3, (1, 3), ("isometry", "scale")))
    settings = load_settings(data_dir=tmp_path / "service", port=0, working_vertices=1500)
    with service_for(settings) as (url, _), Client(url) as client:
        document = run_plan(client, Output(as_json=True), plan, size="tiny", processes=2)
    record = json.loads(Path(document["results"]).read_text())
    assert record["models"]["scale-only"]["training"]["slope"] == pytest.approx(-1.0, abs=0.02)
    assert document["table"]["scale"]["commute"] == 100.0
    assert document["table"]["scale"]["distance"] == 100.0
    read_page(Path(document["report"]).read_text())
