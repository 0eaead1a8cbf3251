"""A headless Chromium for the tests of the page, where Playwright for Python and a Chromium are there."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

# WebGL is drawn by the processor.
FLAGS = (
    "--no-sandbox", "--headless", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip


@contextmanager
def a_browser() -> Iterator[Any]:
    """Start one; skip the test with a sentence where there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="Playwright is not installed: pip install playwright"
    )
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if not chromium:
        pytest.skip("There is no chromium on the path")
    with playwright.sync_playwright() as found:
        one = found.chromium.launch(executable_path=chromium, args=[*FLAGS])
        yield one
        one.close()
