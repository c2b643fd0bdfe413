"""Filters of a search in a browser: set, shared by the address, and taken away."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.page.conftest import Running, Seen
from tests.page.test_search import drop, matches

pytestmark = pytest.mark.slow


def add(page: Page, field: str, how: str, value: str) -> None:
    """Fill in the form for one more filter."""
    page.get_by_label("Filter by").select_option(field)
    page.get_by_label("How", exact=True).select_option(how)
    page.get_by_label("Value", exact=True).fill(value)
    page.get_by_label("Value", exact=True).press("Enter")
    chip = page.get_by_role("button", name=f"Search without the filter {field} {how} {value}")
    expect(chip).to_be_visible()


def species(page: Page) -> set[str]:
    return {name.split(".")[0].split("-")[0] for name in matches(page)}


def test_a_dropped_mesh_is_asked_again_with_a_filter(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    drop(page, running, "ask octopus.ply")
    everything = matches(page)
    add(page, "label", "is", "spider")
    assert sorted(matches(page)) == ["spider-1.ply", "spider-2.ply"]
    page.reload()
    assert sorted(matches(page)) == ["spider-1.ply", "spider-2.ply"]
    add(page, "label", "is", "fish")
    assert species(page) == {"spider", "fish"}
    page.get_by_role("button", name=re.compile("without the filter label is spider")).click()
    page.get_by_role("button", name=re.compile("without the filter label is fish")).click()
    expect(page.get_by_role("button", name=re.compile("without the filter"))).to_have_count(0)
    assert matches(page) == everything


def test_what_is_left_out_does_not_come(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    drop(page, running, "ask octopus.ply")
    assert "octopus" in species(page)
    add(page, "label", "is not", "octopus")
    assert "octopus" not in species(page)


def test_a_stored_shape_is_asked_with_bounds(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/measured")
    page.locator(".examples a.card").first.click()
    matches(page)
    add(page, "strength", "at least", "1")
    assert all(".noise.1." in name for name in matches(page))
    add(page, "label", "is", "nobody")
    expect(page.get_by_role("heading", name="Nothing passes the filters")).to_be_visible()
    page.get_by_role("button", name="Search without filters").click()
    assert len(matches(page)) == 3
