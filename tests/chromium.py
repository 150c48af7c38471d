"""Headless Chromium for tests: one browser in each test process, a context of its own for each page."""

from __future__ import annotations

import asyncio
import contextlib
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import pytest
from benchmarks.common.chromium_flags import SOFTWARE_FLAGS

FLAGS = (*SOFTWARE_FLAGS, "--disable-frame-rate-limit")
"""Without a limit, since Chromium draws pages lower than about 90 pixels once a second otherwise."""

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@dataclass
class _Running:
    """The browser of this process, Playwright's event loop, and the number of open contexts."""

    playwright: Any
    browser: Any
    loop: asyncio.AbstractEventLoop
    contexts: int = 0


_running: list[_Running] = []


@contextlib.contextmanager
def chromium_context(flags: Sequence[str] | None = None, **options: Any) -> Iterator[Any]:
    """A new context of Playwright, closed at the end; skips where Playwright or Chromium is missing.

    flags: command line of a browser for this context alone; by default the process's browser, which draws in
    software.
    """
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("no chromium on this machine")
    if _running and not _running[0].browser.is_connected():
        close_chromium()
    if not _running:
        playwright = sync_api.sync_playwright().start()
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        _running.append(_Running(playwright, browser, asyncio.get_running_loop()))
    running = _running[0]
    running.contexts += 1
    asyncio._set_running_loop(running.loop)
    own = None
    try:
        if flags is not None:
            own = running.playwright.chromium.launch(executable_path=CHROMIUM, args=list(flags))
        context = (own or running.browser).new_context(**options)
        yield context
        context.close()
    except BaseException:
        if own is None and running.contexts == 1:
            close_chromium()  # a browser that may hang does not fail the next test as well
        raise
    finally:
        if own is not None:
            own.close()
        running.contexts -= 1
        if running.contexts == 0:
            # Playwright leaves its loop marked as running in this thread: other tests run loops of their own.
            asyncio._set_running_loop(None)


def close_chromium() -> None:
    """Ends the browser of this process, if there is one."""
    for running in _running:
        asyncio._set_running_loop(running.loop)
        with contextlib.suppress(Exception):
            running.browser.close()
        running.playwright.stop()
        asyncio._set_running_loop(None)
    _running.clear()
