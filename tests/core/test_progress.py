"""The progress display: one line a stage where there is no terminal, and a live line on one."""

from __future__ import annotations

import io

import pytest

from vibroimpact._core import progress as module
from vibroimpact._core.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_note_is_drawn_on_a_terminal_and_once_a_minute_elsewhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    live, logged = Terminal(), io.StringIO()
    for stream in (live, logged):
        now[0] = 0.0
        progress = Progress(2, stream=stream)
        progress.stage("curve")
        for count in range(1, 200):
            now[0] += 0.5
            progress.note(f"{count} points")
    assert live.getvalue().count("\r") == 200
    assert live.getvalue().endswith("[1/2] curve: 199 points")
    assert logged.getvalue().splitlines() == ["[1/2] curve", "[1/2] curve: 120 points"]
