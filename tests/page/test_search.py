"""Search in a browser: from a mesh that is dropped to the shape that it is."""

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect

from tests.page.conftest import Running, Seen

pytestmark = pytest.mark.slow
BRIGHT = """canvas => {
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const data = context.getImageData(0, 0, copy.width, copy.height).data;
    let [sum, filled] = [0, 0];
    for (let i = 0; i < data.length; i += 4) {
        filled += data[i + 3] > 0;
        sum = (31 * sum + data[i] + 3 * data[i + 1] + 7 * data[i + 2] + data[i + 3]) % 1000003;
    }
    return [filled / (data.length / 4), sum];
}"""


def pixels(page: Page, number: int) -> tuple[float, int]:
    """Share of a canvas that is not empty, and a checksum of it."""
    filled, checksum = page.locator("canvas").nth(number).evaluate(BRIGHT)
    return filled, checksum


def drop(page: Page, running: Running, name: str) -> None:
    """Drop a file on the page's drop zone, as a person with a mouse would."""
    data = list((running.meshes / name).read_bytes())
    transfer = page.evaluate_handle(
        """([name, data]) => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([new Uint8Array(data)], name));
            return transfer;
        }""",
        [name, data],
    )
    page.dispatch_event(".dropzone", "dragover", {"dataTransfer": transfer})
    page.dispatch_event(".dropzone", "drop", {"dataTransfer": transfer})


def answer_with(answer: dict[str, Any]) -> Callable[[Route], None]:
    """What stands in for the service at some address."""
    return lambda route: route.fulfill(**answer)


def matches(page: Page) -> list[str]:
    """File names of the ranked cards, once the answer is that to the last question."""
    expect(page.locator(".answer[aria-busy=false]")).to_be_visible()
    cards = page.get_by_role("button", name=re.compile(r"^Rank \d+"))
    cards.first.wait_for()
    return [card.locator("small").inner_text() for card in cards.all()]


def test_a_search_without_an_answer_yet_is_repeated(running: Running, seen: Seen) -> None:
    """As in a collection whose other shapes are still being described."""
    asked: list[str] = []

    def none_at_first(route: Route) -> None:
        asked.append(route.request.url)
        answer = route.fetch()
        told = {**answer.json(), "matches": []} if len(asked) == 1 else answer.json()
        route.fulfill(response=answer, json=told)

    with seen.page.expect_response(re.compile("/v1/collections/zoo/shapes")) as shapes:
        seen.page.goto(f"{running.url}/#/search/zoo")
    shape = shapes.value.json()["items"][0]["id"]
    seen.page.route(re.compile("/v1/collections/zoo/query"), none_at_first)
    seen.page.goto(f"{running.url}/#/search/zoo?shape={shape}")
    expect(seen.page.get_by_role("heading", name="No other shape is ready yet")).to_be_visible()
    assert len(matches(seen.page)) > 0
    assert len(asked) >= 2


def test_a_dropped_mesh_finds_the_shape_that_it_is(running: Running, seen: Seen) -> None:
    seen.page.goto(f"{running.url}/#/search/zoo")
    drop(seen.page, running, "ask octopus.ply")
    assert matches(seen.page)[0] == "octopus-1.ply"
    assert "query=" in seen.page.url


def test_a_query_says_what_is_done_and_can_be_cancelled(running: Running, seen: Seen) -> None:
    page = seen.page
    job = {
        **{"id": "held", "kind": "query", "state": "running", "step": "simplifying"},
        **{"seconds_left": None},
        **{"progress": {"done": 0, "total": 1, "unit": "meshes"}, "errors": []},
        **{"skipped": [], "skipped_count": 0, "attempts": 1, "collection": "zoo", "model": "heat"},
        **{"result": None, "created_at": "2026-03-01T09:30:00Z", "started_at": None},
        "finished_at": None,
    }

    def told(**changes: object) -> str:
        return f"event: job\nid: 1\ndata: {json.dumps({**job, **changes})}\n\n"

    answers: dict[str, dict[str, Any]] = {
        "/v1/queries/": {"status": 202, "json": {"job": job, "query_id": "q"}},
        "/v1/jobs/held/events": {
            "content_type": "text/event-stream",
            "body": told() + told(step="spectrum"),
        },
        "/v1/jobs/held$": {"json": {**job, "step": "spectrum"}},
        "/v1/jobs/held/cancel": {"json": {**job, "state": "cancelled", "step": None}},
    }
    for path, answer in answers.items():
        page.route(re.compile(path), answer_with(answer))
    page.goto(f"{running.url}/#/search/zoo")
    drop(page, running, "ask octopus.ply")
    waiting = page.get_by_role("status").filter(has_text="Describing the mesh")
    expect(waiting).to_contain_text("computing its spectrum")
    with page.expect_request(re.compile("/v1/jobs/held/cancel")) as cancelled:
        waiting.get_by_role("button", name=re.compile("^Cancel")).click()
    assert cancelled.value.method == "POST"


def test_a_link_to_an_answer_shows_it_again_and_back_leads_back(
    running: Running, seen: Seen
) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    drop(page, running, "ask human.ply")
    found = matches(page)
    link = page.url
    page.reload()
    assert matches(page) == found
    other = page.context.new_page()
    other.goto(link)
    assert matches(other) == found
    page.go_back()
    expect(page.get_by_role("heading", name="Drop a mesh here")).to_be_visible()


def test_two_viewers_turn_together(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    page.locator(".examples a.card").first.click()
    matches(page)
    for number in (0, 1):
        expect(page.locator("canvas").nth(number)).to_have_attribute("data-ready", "true")
    page.wait_for_timeout(500)
    before = [pixels(page, number) for number in (0, 1)]
    assert min(filled for filled, _ in before) > 0.02  # neither is blank
    box = page.locator("canvas").first.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y + 20, steps=5)
    page.mouse.up()
    page.wait_for_timeout(500)
    after = [pixels(page, number) for number in (0, 1)]
    assert all(old[1] != new[1] for old, new in zip(before, after, strict=True))


def test_a_viewer_turns_by_keys(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    page.locator(".examples a.card").first.click()
    canvas = page.locator("canvas").first
    expect(canvas).to_have_attribute("data-ready", "true")
    page.wait_for_timeout(500)
    before = pixels(page, 0)
    canvas.focus()
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(500)
    assert pixels(page, 0)[1] != before[1]


def test_it_says_why_by_channel_and_in_colours(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    page.locator(".examples a.card").first.click()
    matches(page)
    expect(page.locator(".channels button")).not_to_have_count(0)
    page.locator(".channels button").nth(1).click()
    expect(page.locator(".why .plot path.curve")).to_have_count(2)
    page.get_by_label("Colours").last.select_option("heat")
    expect(page.locator(".scale")).to_contain_text("k(x,x)")


def test_how_many_are_shown_stands_in_the_address(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    drop(page, running, "ask human.ply")
    assert len(matches(page)) > 2
    page.get_by_label("Show").fill("2")
    assert len(matches(page)) == 2
    assert "show=2" in page.url


def test_a_file_that_is_no_mesh_is_told_in_words(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    drop(page, running, "broken.off")
    expect(page.get_by_role("alert")).to_contain_text("99")
    expected = [error for error in seen.errors if "422" in error]
    seen.errors[:] = [error for error in seen.errors if error not in expected]


def test_it_searches_with_the_keyboard_alone(running: Running, seen: Seen) -> None:
    page = seen.page
    page.goto(f"{running.url}/#/search/zoo")
    page.locator(".examples a.card").first.focus()
    page.keyboard.press("Enter")
    matches(page)
    page.get_by_role("button", name=re.compile("^Rank 2")).focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name=re.compile("^Rank 2"))).to_have_attribute(
        "aria-pressed", "true"
    )
