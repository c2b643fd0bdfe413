"""``proteus models train``: what it asks for, and what it shows of a training."""

import json
from collections.abc import Callable

import pytest
from typer.testing import CliRunner, Result

from proteus.cli.bank import show_bank
from proteus.cli.program import app
from proteus.client import Document
from proteus.terminal.output import Output
from tests.meshes import bumpy_sphere, scaled
from tests.proteus.conftest import Run
from tests.proteus.real_service import RealService
from tests.service.running import off
from workers.transformations import PAPER_TRANSFORMATIONS

BANK = ("models", "train", "bank", "--method", "bank")
TRAININGS = {
    "spline": ("models", "train", "mine", "-t", "scale", "-t", "noise", "--strength", "3",
               "--splines", "8", "--shapes", "3", "--seed", "1"),
    "bank": (*BANK, "--creatures", "3", "-t", "noise", "--strength", "2", "--view", "closed",
             "--channels", "12", "--power", "0.5"),
}  # fmt: skip
Trained = Callable[[str], tuple[Result, Document]]


@pytest.fixture(scope="module")
def trained(running: RealService) -> Trained:
    """What the command said of a training, which is done once, and the model."""
    done: dict[str, Result] = {}

    def once(method: str) -> tuple[Result, Document]:
        environment = {"PROTEUS_URL": running.url}
        if method not in done:
            done[method] = CliRunner().invoke(app, list(TRAININGS[method]), env=environment)
        with running.client() as client:
            return done[method], client.get(f"/v1/models/{TRAININGS[method][2]}")

    return once


def body_of(service: RealService) -> Document:
    """The body of the last model that was asked for."""
    return service.sent("POST", "/v1/models")[-1].json


def shown_figures(model: Document) -> list[str]:
    """Figures of a training, as its tables show them."""
    report = model["training"]
    if model["method"] == "bank":
        rows = [report["rows"][part] for part in ("training", "held_out") if part in report["rows"]]
        means = [f"{row['mean']:.1f}" for row in rows]
        maps = [f"{value:.1f}" for row in rows for value in row["map"].values()]
        weights = [f"{channel['weight']:.3f}" for channel in model["channels"]]
        counts = [str(report["n_references"]), str(report["n_queries"])]
        reason = report["windows"]["reason"].split()  # too few shapes: lines may be broken anywhere
        return [*means, *maps, *weights, *counts, *reason]
    criteria = [value for part in report["criterion"].values() if part for value in part.values()]
    low, high = report["trained_range"]
    shown = [report["heat_time"], report["slope"], report["n_pairs"]]
    hidden = {part["closed-form"] for part in report["criterion"].values() if part}
    return [
        f"{low:.4g} to {high:.4g}",
        *(f"{x:.4g}" for x in [*shown, *(c for c in criteria if c not in hidden)]),
    ]


@pytest.mark.parametrize("method", TRAININGS)
def test_a_model_is_trained_and_its_figures_are_shown(
    run: Run, trained: Trained, method: str
) -> None:
    result, model = trained(method)
    assert result.exit_code == 0, result.output
    assert model["state"] == "ready"
    figures = shown_figures(model)
    assert len(figures) >= 7
    for text in (result.stdout, run("models", "show", model["name"]).stdout):
        assert [figure for figure in figures if figure not in text] == []
        assert '"training"' not in text  # no JSON in a table


def test_a_model_is_trained_with_what_was_given(trained: Trained) -> None:
    _, model = trained("spline")
    assert model["parameters"]["splines"] == 8
    asked = {"transformations": ["scale", "noise"], "strengths": [3], "shapes": 3, "seed": 1}
    assert {name: model["training"][name] for name in asked} == asked
    _, bank = trained("bank")
    assert (bank["parameters"]["power"], bank["parameters"]["channels"]) == (0.5, 12)
    assert bank["parameters"]["views"] == ["closed"]
    assert len(bank["channels"]) <= 12


def test_what_is_not_given_of_a_training_is_the_papers(run: Run, service: RealService) -> None:
    eleven = {"transformations": list(PAPER_TRANSFORMATIONS)}
    with service.idle():
        begun = json.loads(run("models", "train", "later", "--no-wait", "--json").stdout)
        assert (begun["model"]["name"], begun["job"]["state"]) == ("later", "queued")
        assert body_of(service)["training"] == eleven
        run("models", "train", "more", "--method", "grid", "-t", "paper", "-t", "view", "--no-wait")
        assert body_of(service)["training"]["transformations"] == [*PAPER_TRANSFORMATIONS, "view"]
        shown = run("models", "train", "one", "-c", "zoo", "--no-wait", "--creatures", "20",
                    "--method", "bank", "--view", "closed", "--view", "smooth")  # fmt: skip
        assert "proteus jobs watch" in shown.stderr
        assert body_of(service) == {
            "name": "one", "method": "bank", "parameters": {"views": ["closed", "smooth"]},
            "training": {"collection": "zoo", "creatures": 20, **eleven},
        }  # fmt: skip
        for job in json.loads(run("jobs", "list", "--kind", "train", "--json").stdout):
            if job["model"] in {"later", "more", "one"}:
                run("jobs", "cancel", job["id"])


def test_files_of_one_vertex_order_are_no_transformations(run: Run, service: RealService) -> None:
    result = run("models", "train", "poses", "-c", "zoo", "--correspondence", "vertex-order")
    asked = {"collection": "zoo", "correspondence": "vertex-order"}
    assert body_of(service)["training"] == asked
    assert result.exit_code == 1  # the zoo has no two shapes of one vertex order but for scale
    assert "error:" in result.stderr


def test_a_model_with_nothing_to_learn_is_ready_at_once(run: Run, service: RealService) -> None:
    result = run("models", "train", "short", "--method", "heat", "--time", "0.05")
    assert body_of(service) == {"name": "short", "method": "heat", "parameters": {"time": 0.05}}
    assert "short is ready" in result.stdout


def test_only_a_bank_has_several_views(run: Run) -> None:
    refused = run("models", "train", "two", "--view", "open", "--view", "closed")
    assert refused.exit_code == 1
    assert "2 views are given, the method spline takes one" in " ".join(refused.stderr.split())


def test_shapes_that_a_model_cannot_describe_are_named(run: Run, service: RealService) -> None:
    """Scaled to a thousandth, a shape has eigenvalues that no raw unit of training knows."""
    asked = {
        "name": "narrow", "method": "spline",
        "parameters": {"unit": "none", "margin": 1.0, "splines": 4},
        "training": {"transformations": ["noise"], "strengths": [3], "shapes": 3, "seed": 1},
    }  # fmt: skip
    with service.client() as client:
        job = client.post("/v1/models", asked)["job"]
    assert run("jobs", "watch", job["id"]).exit_code == 0
    ball = bumpy_sphere(2, seed=1)
    files = {"ball.off": off(ball), "tiny.off": off(scaled(ball, 0.001))}
    with service.client() as client:
        client.post("/v1/collections", {"name": "far"})
        sent = [("files", item) for item in files.items()]
        job = client.request("POST", "/v1/collections/far/shapes", files=sent).json()["job"]
    assert run("jobs", "watch", job["id"]).exit_code == 0
    activated = run("models", "activate", "narrow", "-c", "far")
    assert activated.exit_code == 0, activated.output
    shown = " ".join(activated.stdout.split())
    assert "not found under narrow" in shown
    assert "tiny.off" in shown
    assert "eigenvalues" in shown
    assert "ball.off" not in shown


def test_what_windows_add_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    rows = {
        "bank": {"map": {"partial": 51.25}, "mean": 51.25, "interval": None},
        "with_windows": {"map": {"partial": 87.5}, "mean": 87.5, "interval": [80.0, 95.5]},
    }
    report = {
        "rows": {"training": rows["bank"]},
        "ablation": [],
        "similarity": [],
        "windows": {"learned": True, "rows": rows},
    }
    show_bank(Output(), {"training": report, "channels": []})
    shown = capsys.readouterr().out
    for text in ("bank alone", "with windows", "51.2", "87.5", "80.0 to 95.5"):
        assert text in shown
