"""Pages of a browser behind a slow line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Page, sync_playwright

from benchmarks.common.chromium_flags import SOFTWARE_FLAGS
from chromium import CHROMIUM


@contextmanager
def throttled_page(mbit: float, latency_ms: float, size: tuple[int, int]) -> Iterator[tuple[Page, Any]]:
    """(page of `size` pixels, its DevTools session), both directions at `mbit` megabits a second."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_FLAGS)
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        session: Any = page.context.new_cdp_session(page)
        session.send("Network.enable")
        rate = mbit * 1e6 / 8
        session.send(
            "Network.emulateNetworkConditions",
            {"offline": False, "latency": latency_ms, "downloadThroughput": rate, "uploadThroughput": rate},
        )
        yield page, session
        browser.close()
