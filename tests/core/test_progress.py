"""The progress display: one line a stage where there is no terminal, and a live line on one."""

from __future__ import annotations

import inspect
import io
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

import vibroimpact as vi
from vibroimpact._core import progress as module
from vibroimpact._core.progress import Display
from vibroimpact.continuation import Steps


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
        progress = Display(2, stream=stream)
        progress.stage("curve")
        for count in range(1, 200):
            now[0] += 0.5
            progress.note(f"{count} points")
    assert live.getvalue().count("\r") == 200
    assert live.getvalue().endswith("[1/2] curve: 199 points")
    assert logged.getvalue().splitlines() == ["[1/2] curve", "[1/2] curve: 120 points"]


def test_a_work_that_lasts_is_shown_after_two_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    live, logged = Terminal(), io.StringIO()
    for stream in (live, logged):
        for each, lines in ((0.1, 0), (0.5, 1)):  # 1 s and 5 s for ten items
            now[0] = 0.0
            bar = Display(1, stream=stream, patience=module.PATIENCE_SECONDS)
            for _ in bar.track("sweep", range(10), 10, unit="members"):
                now[0] += each
            assert ("sweep" in stream.getvalue()) == bool(lines)
    assert len(logged.getvalue().splitlines()) == 1
    assert "2 members/s" in logged.getvalue()


def test_what_lasts_is_shown_unless_it_is_declined() -> None:
    functions = [one for one in (getattr(vi, n) for n in vi.__all__) if inspect.isfunction(one)]
    shown = [inspect.signature(one).parameters.get("progress") for one in functions]
    assert {one.default for one in shown if one} == {True}


DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.0
)
PLANE = ("omega", "half_clearance"), ((0.9, 1.0), (4.5, 5.5))
FEW = Steps(points=13)


@cache
def point() -> vi.BifurcationPoint:
    return vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0))["NS1"]


def slow(work: Any) -> Any:
    return pytest.param(work, marks=pytest.mark.slow)


def one_curve(progress: Any) -> None:
    vi.continue_bifurcation(point(), *PLANE, steps=FEW, progress=progress)


@pytest.mark.parametrize(
    "work",
    [
        lambda progress: vi.continue_orbit(
            vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0), steps=FEW, progress=progress
        ),
        slow(lambda progress: vi.bifurcation_atlas(
            vi.symmetric_orbits(DAMPER)[0], *PLANE, steps=FEW, depth=0, most_curves=1, progress=progress
        )),
        lambda progress: vi.branch_diagram(
            vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0), depth=0, points=0,
            progress=progress,
        ),
        slow(one_curve),
        slow(lambda progress: vi.find_orbits(
            DAMPER, most_cycles=1, most_impacts=2, starts=2, progress=progress
        )),
        lambda progress: vi.sweep(
            DAMPER, over={"omega": [1.0, 1.1]}, start=vi.State((0.0, 0.0), (0.0, 1.0)),
            settle_periods=1, periods=1, progress=progress,
        ),
    ],
)  # fmt: skip
def test_every_long_work_tells_a_function_and_shows_a_stage(
    work: Callable[[Any], object],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[vi.ProgressReport] = []
    work(told.append)
    assert told
    assert all(report.total is None or report.done <= report.total for report in told)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(module, "PATIENCE_SECONDS", 0.0)
    work(True)
    assert f"[1/1] {told[0].stage}" in capsys.readouterr().err
    work(None)
    assert capsys.readouterr().err == ""
    with pytest.raises(vi.InvalidParameterError, match="progress = 3: must be True, a function"):
        work(3)
