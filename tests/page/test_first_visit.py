"""A service in which nothing is: what somebody finds who has just started it."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from proteus.cli.embedded import service_for
from tests.page.conftest import Seen
from tests.page.test_search import matches
from workers.settings import load_settings

pytestmark = pytest.mark.slow


def test_the_demo_collection_is_one_click_away(tmp_path: Path, seen: Seen) -> None:
    page = seen.page
    settings = load_settings(
        data_dir=tmp_path / "data", port=0, worker_processes=1, working_vertices=500
    )
    with service_for(settings) as (url, _):
        page.goto(url)
        expect(page.get_by_role("heading", name="There is nothing to search yet")).to_be_visible()
        page.get_by_role("button", name="Load the demo collection").click()
        expect(page.get_by_role("heading", name="demo", exact=True)).to_be_visible()
        expect(page.get_by_label(re.compile(r"^Select \w+-\d\.ply")).first).to_be_visible()
        expect(page.locator("img.thumbnail").first).to_be_visible()
        page.get_by_role("link", name="Search here").click()
        page.locator(".examples a.card").first.click()
        matches(page)
        page.goto("about:blank")
