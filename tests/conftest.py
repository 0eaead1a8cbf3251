"""What the whole suite shares: settings of property tests, one thread for linear algebra, and fixtures.

Property tests draw the same examples every time.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

# Before numpy is loaded, here and in processes that tests start: threads of a BLAS that wait for a core which
# another process has, spin. With as many busy processes as cores that takes five times the time.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

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


@pytest.hookimpl(tryfirst=True)  # before those that are not wanted are left out
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run long files first, and mark as slow what `one_in` leaves to the whole suite.

    A long file alone at the end keeps a core idle.
    """
    items.sort(key=lambda item: item.path.name not in FIRST)
    cases: Counter[str] = Counter()
    for item in items:
        marker = item.get_closest_marker("one_in")
        if marker is not None:
            name = item.nodeid.partition("[")[0]
            if cases[name] % marker.args[0]:
                item.add_marker(pytest.mark.slow)
            cases[name] += 1


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
