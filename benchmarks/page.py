"""The cost of the page: ``python -m benchmarks.page --url http://127.0.0.1:8000``.

Opens the page of a running service, such as that of ``make demo``, with an empty cache. Prints
medians: bytes over the wire until the first visit shows its shapes, bytes that a viewer adds, the
time of the first paint, and of the first picture. Needs Chromium.
"""

import argparse
from statistics import median

from playwright.sync_api import Browser
from rich.console import Console
from rich.table import Table

from benchmarks.chromium import chromium

PAINT = "() => performance.getEntriesByName('first-contentful-paint')[0].startTime"
PICTURE = """() => Math.max(...performance.getEntriesByType('resource')
    .filter(one => one.name.endsWith('thumbnail.png')).slice(0, 1).map(one => one.responseEnd))"""
CODE = """() => [performance.getEntriesByType('navigation')[0],
    ...performance.getEntriesByType('resource').filter(one => !one.name.includes('/v1/'))]
    .reduce((sum, one) => sum + one.transferSize, 0)"""


def visit(browser: Browser, url: str) -> tuple[float, float, float, float]:
    """Milliseconds to first paint and first picture; kB of code before and after a viewer."""
    context = browser.new_context(viewport={"width": 1440, "height": 1000})
    page = context.new_page()
    page.goto(url)
    page.locator("img.thumbnail").first.wait_for()
    page.wait_for_load_state("networkidle")
    paint, picture, first = page.evaluate(PAINT), page.evaluate(PICTURE), page.evaluate(CODE)
    page.locator(".examples a.card").first.click()
    page.locator("canvas[data-ready=true]").first.wait_for()
    whole = page.evaluate(CODE)
    context.close()
    return paint, picture, first / 1000, (whole - first) / 1000


def main() -> None:
    """Visit, and print medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", default="http://127.0.0.1:8000")
    parser.add_argument("--visits", type=int, default=9)
    asked = parser.parse_args()
    with chromium() as browser:
        visits = [visit(browser, asked.url) for _ in range(asked.visits)]
    table = Table(f"median of {asked.visits} first visits", "")
    names = ("first paint, ms", "first picture, ms", "first load, kB", "a viewer adds, kB")
    for name, values in zip(names, zip(*visits, strict=True), strict=True):
        table.add_row(name, f"{median(values):.0f}")
    Console().print(table)


if __name__ == "__main__":
    main()
