"""Long work in a browser: training, measuring, moving, and a service that goes and comes back."""

import re
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page, expect

from proteus.cli.embedded import service_for
from service.schemas.training import BankParameters
from tests.page.conftest import Running, Seen
from workers.settings import load_settings

pytestmark = pytest.mark.slow
LONG = 240_000  # milliseconds; a small training


def test_a_model_is_trained_used_and_measured_by_hand(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/models?train=1")
    page.get_by_label("Name").fill("by-hand")
    page.get_by_label("Creatures", exact=True).fill("2")
    page.get_by_role("button", name="None", exact=True).click()
    page.get_by_role("checkbox", name=re.compile("^noise")).check()
    for strength in (3, 4, 5):
        page.get_by_role("checkbox", name=re.compile(f"^{strength}")).uncheck()
    expect(page.get_by_text("2 shapes × 1 transformation × 2 strengths")).to_be_visible()
    page.get_by_role("button", name="Train it").click()
    expect(page.get_by_role("heading", name="by-hand", exact=True)).to_be_visible()
    page.get_by_role("button", name=re.compile("^Use it")).first.click(timeout=LONG)
    made = page.request.get(f"{running.url}/v1/models/by-hand").json()
    assert made["parameters"] == BankParameters().model_dump(
        mode="json"
    )  # the page's own usual ones

    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Collection").select_option("measured")
    dialog.get_by_role("button", name="Use it").click()
    expect(page.get_by_text("measured is searched under by-hand.")).to_be_visible(timeout=LONG)
    assert model_of(page, running) == "by-hand"

    page.goto(f"{running.url}/#/evaluations?new=1&collection=measured&models=by-hand,heat")
    expect(page.get_by_role("checkbox", name=re.compile("^by-hand"))).to_be_checked()
    page.get_by_role("button", name="Evaluate", exact=True).click()
    expect(page.locator("td.best").first).to_be_visible(timeout=LONG)
    expect(page.get_by_role("columnheader", name=re.compile("by-hand")).first).to_be_visible()


def test_a_collection_goes_back_to_the_model_before(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/models/heat")
    before = model_of(page, running)
    page.get_by_role("button", name=re.compile("^Use it")).first.click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Collection").select_option("measured")
    dialog.get_by_role("button", name="Use it").click()
    expect(page.get_by_text("measured is searched under heat.")).to_be_visible(timeout=LONG)
    page.get_by_role("main").get_by_role("button", name=f"Go back to {before}").click()
    expect(page.get_by_text(f"measured is searched under {before}.")).to_be_visible(timeout=LONG)
    assert model_of(page, running) == before


def model_of(page: Page, running: Running) -> str:
    """Model that the small collection is searched under."""
    return str(page.request.get(f"{running.url}/v1/collections/measured").json()["model"])


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
    asked = {"collection": "measured", "models": ["heat", "shape-dna"]}
    made = page.request.post(f"{running.url}/v1/evaluations?wait=60", data=asked)
    assert made.ok
    page.goto(f"{running.url}/#/evaluations/{made.json()['evaluation']['id']}")
    expect(page.locator("td.best").first).to_be_visible(timeout=LONG)
    expect(page.get_by_role("img", name="Precision by recall")).to_be_visible()


def test_the_page_goes_on_when_the_service_is_back(tmp_path: Path, seen: Seen) -> None:
    page = seen.page
    settings = load_settings(data_dir=tmp_path / "data", port=0, worker_processes=1)
    with service_for(settings) as (url, _):
        page.goto(f"{url}/#/collections")
        expect(page.get_by_role("heading", name="Collections", exact=True)).to_be_visible()
    expect(page.locator(".away")).to_be_visible()
    same_place = settings.model_copy(update={"port": urlsplit(url).port})
    with service_for(same_place) as (url, _):
        expect(page.locator(".away")).to_have_count(0)
        page.request.post(f"{url}/v1/collections", data={"name": "made-meanwhile"})
        page.get_by_role("link", name="Jobs").click()
        page.get_by_role("link", name="Collections").click()
        expect(page.get_by_text("made-meanwhile").first).to_be_visible()
        assert any("ERR_CONNECTION_REFUSED" in error for error in seen.errors)
        seen.errors[:] = [error for error in seen.errors if "net::ERR" not in error]
        page.goto("about:blank")
