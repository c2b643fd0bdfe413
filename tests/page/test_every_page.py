"""What holds on every page: names, contrast, no network beyond the service, no inline code."""

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, Request, expect

import service.web
from tests.page.conftest import Running, Seen

pytestmark = pytest.mark.slow
AXE = Path(service.web.__file__).parent / "node_modules" / "axe-core" / "axe.min.js"
PAGES = (
    "#/",
    "#/search/zoo?shape={shape}",
    "#/collections",
    "#/collections/zoo",
    "#/shapes/{shape}",
    "#/models",
    "#/models/proteus",
    "#/models?train=1",
    "#/evaluations",
    "#/evaluations?new=1",
    "#/evaluations/{evaluation}",
    "#/jobs",
    "#/jobs/{job}",
    "#/nowhere",
)
QUIET_MILLISECONDS = 300
SETTLED = """quiet => new Promise(resolve => {
  let timer;
  const wait = () => { clearTimeout(timer); timer = setTimeout(end, quiet); };
  const end = () => {
    const moving = document.getAnimations().some(
      one => one.playState === "running" && one.effect?.getComputedTiming().endTime !== Infinity);
    if (moving) return wait();
    observer.disconnect();
    resolve();
  };
  const observer = new MutationObserver(wait);
  observer.observe(document, {subtree: true, childList: true, attributes: true,
                              characterData: true});
  wait();
})"""
"""Ends when the document has been the same for so long, and nothing fades in any more."""


def go(page: Page, running: Running, place: str) -> None:
    """Open a place and wait until it stands."""
    page.goto(f"{running.url}/{place.format(**ids(page, running))}")
    page.wait_for_load_state("networkidle")
    page.evaluate(SETTLED, QUIET_MILLISECONDS)


def ids(page: Page, running: Running) -> dict[str, str]:
    """A shape, an evaluation and a job to look at."""

    def first(path: str) -> str:
        items = page.request.get(f"{running.url}/v1/{path}").json()["items"]
        return str(items[0]["id"]) if items else ""

    if not first("evaluations?limit=1"):
        asked = {"collection": "measured", "models": ["proteus"]}
        made = page.request.post(f"{running.url}/v1/evaluations?wait=60", data=asked)
        assert made.json()["job"]["state"] == "succeeded"
    return {
        "shape": first("collections/zoo/shapes?limit=1"),
        "evaluation": first("evaluations?limit=1"),
        "job": first("jobs?limit=1"),
    }


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("place", PAGES)
def test_axe_finds_nothing_serious(running: Running, seen: Seen, place: str, scheme: Any) -> None:
    seen.page.emulate_media(color_scheme=scheme)
    go(seen.page, running, place)
    assert serious_faults(seen.page) == []


def serious_faults(page: Page) -> list[str]:
    """What axe finds on a page as it stands."""
    page.evaluate(AXE.read_text())
    found = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
    return [
        f"{fault['id']}: {node['html'][:160]}"
        for fault in found["violations"]
        if fault["impact"] in {"serious", "critical"}
        for node in fault["nodes"]
    ]


@pytest.mark.parametrize("place", PAGES)
def test_a_narrow_screen_never_scrolls_sideways(running: Running, seen: Seen, place: str) -> None:
    seen.page.set_viewport_size({"width": 390, "height": 844})
    go(seen.page, running, place)
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= 390


def test_only_the_service_is_asked(running: Running, seen: Seen) -> None:
    asked: list[str] = []

    def note(request: Request) -> None:
        asked.append(request.url)

    seen.page.on("request", note)
    for place in PAGES:
        go(seen.page, running, place)
    assert {url for url in asked if not url.startswith((running.url, "blob:", "data:"))} == set()


def test_the_policy_allows_nothing_inline(running: Running, seen: Seen) -> None:
    answer = seen.page.goto(running.url)
    assert answer is not None
    policy = answer.headers["content-security-policy"]
    assert "unsafe" not in policy
    assert "default-src 'none'" in policy


def test_the_first_load_is_small(running: Running, seen: Seen) -> None:
    sizes: list[int] = []

    def note(request: Request) -> None:
        if "/v1/" not in request.url:
            sizes.append(request.sizes()["responseBodySize"])

    seen.page.on("requestfinished", note)
    seen.page.goto(running.url)
    expect(seen.page.get_by_role("heading", name="Find a shape")).to_be_visible()
    assert 0 < sum(sizes) <= 400_000


def test_a_chosen_theme_stays(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(running.url)
    page.get_by_label("Colours").first.select_option("dark")
    page.reload()
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
