"""A bank on the command line: what is asked for, and what is told of its training."""

import json

from tests.proteus.fake_service import FakeService, Run

BANK = ("models", "train", "mine", "--method", "bank")


def test_a_bank_is_asked_for_with_its_views_and_what_it_learns_from(
    run: Run, fake: FakeService
) -> None:
    run(*BANK, "-c", "zoo", "--creatures", "20", "-t", "noise", "--strength", "3",
        "--view", "closed", "--view", "smooth", "--channels", "12", "--power", "0.5")  # fmt: skip
    assert fake.queries[-1] == {
        "name": "mine", "method": "bank",
        "parameters": {"views": ["closed", "smooth"], "channels": 12, "power": 0.5},
        "training": {
            "collection": "zoo", "creatures": 20, "transformations": ["noise"], "strengths": [3],
        },
    }  # fmt: skip


def test_what_is_not_said_of_a_bank_is_left_to_the_service(run: Run, fake: FakeService) -> None:
    document = json.loads(run(*BANK, "--json").stdout)
    assert document["model"]["training"]["n_references"] == 60
    assert fake.queries[-1]["parameters"] == {}
    assert len(fake.queries[-1]["training"]["transformations"]) == 11


def test_the_report_of_a_bank_is_shown(run: Run) -> None:
    figures = ("3300", "97.1", "84.4", "89.9", "86.1 to 93.2", "1.000", "3.7", "1.0%", "1.3%")
    for shown in (run(*BANK), run("models", "show", "mine")):
        assert shown.exit_code == 0
        assert [figure for figure in figures if figure not in shown.stdout] == []
    assert '"held_out"' not in shown.stdout


def test_only_a_bank_has_several_views(run: Run) -> None:
    refused = run("models", "train", "mine", "--view", "open", "--view", "closed")
    assert refused.exit_code == 1
    assert "2 views are given, the method spline takes one" in " ".join(refused.stderr.split())
