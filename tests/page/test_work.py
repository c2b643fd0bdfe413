"""Long work in a browser: training, measuring, moving, and a service that goes and comes back."""

import re

import pytest
from playwright.sync_api import expect

from tests.page.conftest import Running, Seen

pytestmark = pytest.mark.slow
LONG = 240_000  # milliseconds; a small training


def test_a_model_is_made_by_its_form_and_used(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/models?train=1")
    page.get_by_label("Name").fill("by-hand")
    page.get_by_label(re.compile("^Commute-time")).check()
    page.get_by_role("button", name="Make it").click()
    expect(page.get_by_role("heading", name="by-hand", exact=True)).to_be_visible()
    expect(page.locator(".plot path.curve").first).to_be_visible()
    page.get_by_role("button", name=re.compile("^Use it")).first.click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Collection").select_option("measured")
    dialog.get_by_role("button", name=re.compile("^Use it|^Move")).click()

    def model() -> str:
        answer = page.request.get(f"{running.url}/v1/collections/measured").json()
        return str(answer["model"])

    page.wait_for_function("() => !document.querySelector('dialog[open]')")
    for _ in range(120):
        if model() == "by-hand":
            break
        page.wait_for_timeout(250)
    assert model() == "by-hand"


def test_a_job_goes_on_through_a_reload(running: Running, seen: Seen) -> None:
    page = seen.page
    training = {
        "name": "reloaded",
        "method": "bank",
        "parameters": {"channels": 4, "views": ["closed"]},
        "training": {"creatures": 2, "transformations": ["noise"], "strengths": [1, 2, 3]},
    }
    made = page.request.post(f"{running.url}/v1/models", data=training)
    assert made.ok
    page.goto(f"{running.url}/#/jobs/{made.json()['job']['id']}")
    expect(page.get_by_role("heading", name=re.compile("Training"))).to_be_visible()
    page.reload()
    expect(page.locator(".badge.is-succeeded")).to_be_visible(timeout=LONG)
    page.goto(f"{running.url}/#/models/reloaded")
    expect(page.get_by_role("heading", name="reloaded", exact=True)).to_be_visible()


def test_an_evaluation_shows_its_table_and_curves(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/evaluations?start=1&collection=measured")
    asked = {"collection": "measured", "models": ["heat", "shape-dna"]}
    made = page.request.post(f"{running.url}/v1/evaluations?wait=60", data=asked)
    assert made.ok
    page.goto(f"{running.url}/#/evaluations/{made.json()['evaluation']['id']}")
    expect(page.locator("td.best").first).to_be_visible(timeout=LONG)
    expect(page.get_by_role("img", name="Precision by recall")).to_be_visible()


def test_the_page_waits_for_a_service_that_is_away(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/jobs")
    expect(page.get_by_role("heading", name="Jobs")).to_be_visible()
    page.context.set_offline(True)
    expect(page.locator(".away")).to_be_visible()
    page.context.set_offline(False)
    expect(page.locator(".away")).to_have_count(0)
    seen.errors[:] = [error for error in seen.errors if "ERR_INTERNET_DISCONNECTED" not in error]
