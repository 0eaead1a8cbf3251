"""What the whole suite shares: settings of property tests, and fixtures.

Property tests draw the same examples every time.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=60)
settings.load_profile("repeatable")

FIRST = {  # those that compile programs, and long ones that would come last
    *("test_engine.py", "test_engine_targets.py", "test_headers.py"),
    *("test_math.py", "test_wide_look.py", "test_repetition.py"),
    *("test_misuse.py", "test_circles.py"),
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run long files first: one of them alone at the end keeps a core idle."""
    items.sort(key=lambda item: item.path.name not in FIRST)


@pytest.fixture
def no_windows(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Draw in memory; pictures are closed in the end, and nobody shows one."""
    plt.switch_backend("Agg")
    monkeypatch.setattr(plt, "show", lambda *_, **__: pytest.fail("plt.show was called"))
    yield
    plt.close("all")


@pytest.fixture
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
