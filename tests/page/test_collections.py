"""Collections in a browser: files dropped, told about one by one, deleted and brought back."""

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from tests.page.conftest import Running, Seen

pytestmark = pytest.mark.slow
MANY = 10_000
MOST_CELLS = 200  # of ten thousand, at a time


def a_collection(page: Page, running: Running, name: str) -> None:
    """Make a collection over the API and look at it."""
    made = page.request.post(f"{running.url}/v1/collections", data={"name": name})
    assert made.ok
    page.goto(f"{running.url}/#/collections/{name}")
    expect(page.get_by_role("heading", name=name, exact=True)).to_be_visible()


def fish(running: Running, number: int) -> Path:
    """File of an individual."""
    return running.meshes / "zoo" / "fish" / f"fish-{number}.ply"


def add(page: Page, *paths: Path) -> None:
    """Choose files to be uploaded."""
    page.get_by_label("Add meshes").first.set_input_files(paths)


def test_a_collection_is_made_by_its_form(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/collections")
    page.get_by_role("button", name=re.compile("collection", re.IGNORECASE)).first.click()
    page.get_by_label("Name").fill("by-hand")
    page.get_by_role("dialog").get_by_role("button", name=re.compile("Make")).click()
    expect(page.get_by_role("heading", name="by-hand", exact=True)).to_be_visible()


def test_each_file_is_told_about_and_a_bad_one_says_why(running: Running, seen: Seen) -> None:
    page = seen.page
    a_collection(page, running, "mixed")
    add(page, fish(running, 1), running.meshes / "broken.off")
    uploads = page.get_by_role("region", name="Uploads")
    expect(uploads).to_contain_text("99")
    expect(uploads).to_contain_text("fish-1.ply")
    cards = page.get_by_role("listitem").filter(has_text="fish-1")
    expect(cards.first).to_be_visible()
    page.reload()
    failed = page.get_by_role("listitem").filter(has_text="broken")
    expect(failed.first).to_contain_text("99")


def test_an_upload_that_was_cut_off_is_tried_again(running: Running, seen: Seen) -> None:
    page = seen.page
    a_collection(page, running, "interrupted")
    page.route(re.compile("/shapes$"), lambda route: route.abort("connectionreset"))
    add(page, fish(running, 1))
    uploads = page.get_by_role("region", name="Uploads")
    expect(uploads.locator(".reason")).to_contain_text("try again")
    page.unroute_all()
    uploads.get_by_role("button", name="Try fish-1.ply again").click()
    expect(page.get_by_label("Select fish-1.ply")).to_be_visible()
    seen.errors[:] = [error for error in seen.errors if "ERR_CONNECTION_RESET" not in error]


def test_a_deleted_shape_comes_back_by_undo(running: Running, seen: Seen) -> None:
    page = seen.page
    a_collection(page, running, "undone")
    add(page, fish(running, 1), fish(running, 2))
    expect(page.get_by_label("Select fish-1.ply")).to_be_visible()
    expect(page.get_by_label("Select fish-2.ply")).to_be_visible()
    page.get_by_label("Select fish-1.ply").check()
    chosen = page.locator(".chosenbar")
    chosen.get_by_role("button", name="Delete").click()
    expect(page.get_by_label("Select fish-1.ply")).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_label("Select fish-1.ply")).to_be_visible()
    found = page.request.get(f"{running.url}/v1/collections/undone").json()
    assert found["shape_count"] == 2


def test_ten_thousand_shapes_scroll_with_few_cells(running: Running, seen: Seen) -> None:
    page = seen.page
    served = page.request.get(f"{running.url}/v1/collections/zoo/shapes?limit=1").json()
    example = served["items"][0]

    def shapes(route: Route) -> None:
        cursor = re.search(r"cursor=(\d+)", route.request.url)
        first = int(cursor.group(1)) if cursor else 0
        limit = int(re.search(r"limit=(\d+)", route.request.url).group(1))  # type: ignore[union-attr]
        last = min(MANY, first + limit)
        items = [{**example, "name": f"shape {i}.ply"} | _id(i) for i in range(first, last)]
        after = str(last) if last < MANY else None
        route.fulfill(json={"items": items, "next_cursor": after})

    def collection(route: Route) -> None:
        answer = route.fetch().json()
        counts = {"shape_count": MANY, "ready_count": MANY, "failed_count": 0}
        route.fulfill(body=json.dumps({**answer, **counts}), content_type="application/json")

    def picture(route: Route) -> None:
        route.fulfill(body=b"", content_type="image/png")

    page.route(re.compile(r"/v1/collections/zoo/shapes\?"), shapes)
    page.route(re.compile(r"/v1/collections/zoo$"), collection)
    page.route(re.compile(r"/thumbnail\.png$"), picture)
    page.goto(f"{running.url}/#/collections/zoo")
    expect(page.get_by_text("10,000 shapes").first).to_be_visible()
    expect(page.get_by_text("shape 0.ply")).to_be_visible()
    for _ in range(12):
        page.mouse.wheel(0, 4000)
        page.wait_for_timeout(60)
        assert page.locator(".grid .cell").count() <= MOST_CELLS
    seen_names = page.locator(".grid .cell .name").all_inner_texts()
    assert seen_names
    assert "shape 0.ply" not in seen_names


def _id(number: int) -> dict[str, str]:
    return {"id": f"00000000-0000-7000-8000-{number:012x}"}
