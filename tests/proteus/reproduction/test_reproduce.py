import json
import os
from pathlib import Path

import numpy as np
import pytest

from proteus.cli.embedded import service_for
from proteus.cli.reproduce import run_plan
from proteus.client import Client, Document
from proteus.reproduction.plan import CLOSED, OPEN, SIZES, Plan, Size, closed_models, first_models
from proteus.terminal.output import CommandError, Output
from tests.proteus.reproduction.learning_service import BEST_TIME, LearningService
from tests.proteus.reproduction.test_report import read_page
from workers.errors import InvalidRequestError
from workers.settings import load_settings

TINY = Size(2, 1, 2000, 2000, (1,), 3, (1,), ("isometry", "scale", "shot-noise"))


def reproduce(service: LearningService, plan: Plan) -> Document:
    with Client(transport=service.transport()) as client:
        return run_plan(client, Output(as_json=True), plan, size="tiny", processes=1)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[LearningService, Plan, Document]:
    service = LearningService()
    plan = Plan(tmp_path_factory.mktemp("out"), TINY)
    return service, plan, reproduce(service, plan)


Done = tuple[LearningService, Plan, Document]


def test_everything_is_written(done: Done) -> None:
    _, plan, document = done
    written = {path.relative_to(plan.out).as_posix() for path in plan.out.rglob("*")}
    figures = {f"figures/figure{i}.{kind}" for i in range(1, 6) for kind in ("png", "svg")}
    tables = {"table1.csv", "table1.json", "table1-closed.csv", "table1-paper.csv"}
    assert figures | tables | {"report.html", "results.json"} <= written
    assert set(document["figures"]) == {str(plan.out / name) for name in figures}
    assert list(document["table"]) == ["isometry", "scale", "shot-noise", "mean of the rows"]


def test_the_report_is_one_file_that_says_what_was_done(done: Done) -> None:
    _, plan, _ = done
    reader = read_page((plan.out / "report.html").read_text())
    text = " ".join(reader.texts)
    assert sum(tag == "img" for tag, _ in reader.tags) == 5
    assert sum(tag == "table" for tag, _ in reader.tags) == 4
    for said in ("slope −1.000", "t* = 0.1", "human, fish", "seed", "Slips", "6 queries"):
        assert said.lower() in text.lower()
    assert "--seed 0" in text
    assert str(plan.out) not in text


def test_the_columns_are_the_papers_and_one_more_against_commute_time(done: Done) -> None:
    service, plan, document = done
    name = plan.model_name
    first, second = service.evaluations.values()
    keys = ("commute", "heat-short", "heat-best", "heat-long", "learned", "distance")
    assert first["models"] == [name(key) for key in keys]
    assert second["models"] == [name(f"{key}-closed") for key in keys]
    assert document["table"]["scale"] == {
        "heat-short": 60.0, "heat-best": 70.0, "heat-long": 80.0,
        "learned": 90.0, "commute": 50.0, "distance": 100.0,
    }  # fmt: skip
    times = [service.models[name(key)]["parameters"]["time"] for key in keys[1:4]]
    assert times == pytest.approx([0.7 * BEST_TIME, BEST_TIME, 1.7 * BEST_TIME])
    assert {service.models[name(key)]["parameters"]["unit"] for key in keys[1:4]} == {"none"}


def test_views_and_trainings_are_those_that_were_planned(done: Done) -> None:
    service, plan, _ = done
    for name, model in service.models.items():
        if not name.startswith(plan.name):
            continue
        expected = CLOSED if name.endswith("-closed") else OPEN
        assert model["parameters"]["view"] == expected
    trained = service.models[plan.model_name("scale-only")]["training"]
    assert trained["transformations"] == ["scale"]
    assert trained["shapes"] == TINY.training_shapes
    learned = service.models[plan.model_name("learned")]
    assert learned["training"]["transformations"] == list(TINY.transformations)
    assert learned["parameters"]["criterion"] == "kernel"
    assert learned["parameters"]["unit"] == "none"
    past = service.models[plan.model_name("distance")]["parameters"]
    assert (past["criterion"], past["unit"]) == ("distance", "first-eigenvalue")


def test_the_record_has_no_ranks_and_can_be_read_again(done: Done) -> None:
    _, _, document = done
    record = json.loads(Path(document["results"]).read_text())
    assert "ranks" not in record["evaluation"]
    kernel = record["models"]["learned"]["kernels"][0]
    assert np.allclose(np.array(kernel["eigenvalues"]) * kernel["squared_transfer"], 1.0)
    assert record["benchmark"]["counts"] == {"nulls": 2, "distractors": 1, "queries": 6}


def test_a_second_run_trains_nothing_and_gives_the_same(done: Done) -> None:
    service, plan, first = done
    written = {p: p.read_bytes() for p in plan.out.iterdir() if p.suffix in {".html", ".csv"}}
    jobs = [job for job in service.jobs.values() if job["kind"] == "train"]
    second = reproduce(service, plan)
    assert [job for job in service.jobs.values() if job["kind"] == "train"] == jobs
    assert second["table"] == first["table"]
    assert {path: path.read_bytes() for path in written} == written


def test_shapes_beyond_the_learned_range_are_counted_and_fig_5_takes_others(
    tmp_path: Path,
) -> None:
    service = LearningService()
    service.unknown = r"isometry"
    size = Size(1, 1, 2000, 2000, (1,), 3, (1,), ("isometry", "scale", "sampling"))
    document = reproduce(service, Plan(tmp_path, size))
    text = Path(document["report"]).read_text()
    assert "1 shapes lie outside what a learned kernel knows" in text
    assert "sampling, strength 1" in text
    other = LearningService()
    other.unknown = r"isometry|sampling"
    with pytest.raises(CommandError, match="outside the range that it was learned on"):
        reproduce(other, Plan(tmp_path, size))


def test_a_failed_training_says_why_and_is_begun_again(tmp_path: Path) -> None:
    service = LearningService()
    plan = Plan(tmp_path, Size(1, 0, 2000, 2000, (1,), 3, (1,), ("scale", "sampling")))
    name = plan.model_name("scale-only")
    service.failing = {name}
    for _ in range(2):
        with pytest.raises(
            CommandError, match=f"training {name}: the job .* succeeded: no reason given"
        ):
            reproduce(service, plan)
    methods = [(request.method, request.url.path) for request in service.requests]
    assert methods.count(("DELETE", f"/v1/models/{name}")) == 1
    service.failing = set()
    service.models[name]["state"] = "failed"
    assert reproduce(service, plan)["table"]


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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in os.environ if name.startswith("PROTEUS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    plan = Plan(tmp_path, Size(2, 2, 2000, 1500, (1,), 3, (1, 3), ("isometry", "scale")))
    settings = load_settings(data_dir=tmp_path / "service", port=0, working_vertices=1500)
    with service_for(settings) as (url, _), Client(url) as client:
        document = run_plan(client, Output(as_json=True), plan, size="tiny", processes=2)
    record = json.loads(Path(document["results"]).read_text())
    assert record["models"]["scale-only"]["training"]["slope"] == pytest.approx(-1.0, abs=0.02)
    assert document["table"]["scale"]["commute"] == 100.0
    assert document["table"]["scale"]["distance"] == 100.0
    read_page(Path(document["report"]).read_text())
