"""The browser that the page is looked at with."""

import contextlib
import shutil
from collections.abc import Iterator

from playwright.sync_api import Browser, sync_playwright

FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader")


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    """Chromium without a window, as it is installed."""
    with sync_playwright() as library:
        program = shutil.which("chromium")
        browser = library.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()
