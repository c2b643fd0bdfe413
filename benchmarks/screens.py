"""Pictures of every part of the page: ``python -m benchmarks.screens --url http://127.0.0.1:8000``.

Asks a running service, such as that of ``make demo``, and writes each part light and dark, wide and
narrow, into ``docs/figures/page``. Needs Chromium.
"""

import argparse
import io
from collections.abc import Iterator
from itertools import product
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page

from benchmarks.chromium import chromium
from proteus.client import Client

FOLDER = Path(__file__).parent.parent / "docs" / "figures" / "page"
WIDTHS = {1440: 1000, 390: 844}
SCHEMES = ("light", "dark")
SETTLED_MILLISECONDS = 4000
TALLEST = 2400  # pixels of a picture; what is below is left out
QUALITY = 60


def places(client: Client, collection: str) -> Iterator[tuple[str, str]]:
    """Name and address of each part of the page, with something to see in it."""
    shapes = client.get(f"/v1/collections/{collection}/shapes", limit=8, state="ready")["items"]
    shape = shapes[len(shapes) // 2]["id"]
    evaluations = client.get("/v1/evaluations", limit=1, collection=collection)["items"]
    yield "start", "#/"
    yield "search", f"#/search/{collection}?shape={shape}"
    yield "collections", "#/collections"
    yield "collection", f"#/collections/{collection}"
    yield "shape", f"#/shapes/{shape}"
    yield "models", "#/models"
    yield "model", "#/models/proteus"
    yield "train", "#/models?train=1"
    yield "evaluations", "#/evaluations"
    for evaluation in evaluations:
        yield "evaluation", f"#/evaluations/{evaluation['id']}"
    yield "jobs", "#/jobs"


def take(browser: Browser, url: str, width: int, scheme: str, into: Path) -> None:
    """Write the picture of one place."""
    context = browser.new_context(
        viewport={"width": width, "height": WIDTHS[width]},
        color_scheme="dark" if scheme == "dark" else "light",
    )
    page: Page = context.new_page()
    page.goto(url)
    page.wait_for_timeout(SETTLED_MILLISECONDS)
    page.evaluate("() => document.querySelectorAll('img').forEach(one => (one.loading = 'eager'))")
    page.wait_for_load_state("networkidle")
    image = Image.open(io.BytesIO(page.screenshot(full_page=True)))
    image.crop((0, 0, image.width, min(TALLEST, image.height))).save(into, quality=QUALITY)
    context.close()


def main() -> None:
    """Take all pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", default="http://127.0.0.1:8000")
    parser.add_argument("--collection", default="demo")
    parser.add_argument("--out", type=Path, default=FOLDER)
    parser.add_argument("--only", action="append", help="a part's name; again for more")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    with Client(asked.url) as client:
        found = [p for p in places(client, asked.collection) if p[0] in (asked.only or [p[0]])]
    with chromium() as browser:
        for (name, place), width, scheme in product(found, WIDTHS, SCHEMES):
            into = asked.out / f"{name}-{width}-{scheme}.webp"
            take(browser, f"{asked.url}/{place}", width, scheme, into)


if __name__ == "__main__":
    main()
