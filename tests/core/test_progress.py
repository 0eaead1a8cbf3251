"""The progress display: one line a stage where there is no terminal, and a live line on one."""

from __future__ import annotations

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


DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.0
)
PLANE = ("omega", "half_clearance"), ((0.9, 1.0), (4.5, 5.5))
FEW = Steps(points=13)


@cache
def point() -> vi.BifurcationPoint:
    return vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0))["NS1"]


def one_curve(progress: Any) -> None:
    vi.continue_bifurcation(point(), *PLANE, steps=FEW, progress=progress)


@pytest.mark.parametrize(
    "work",
    [
        lambda progress: vi.continue_orbit(
            vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0), steps=FEW, progress=progress
        ),
        lambda progress: vi.bifurcation_atlas(
            vi.symmetric_orbits(DAMPER)[0], *PLANE, steps=FEW, depth=0, most_curves=1, progress=progress
        ),
        lambda progress: vi.branch_diagram(
            vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0), depth=0, points=0,
            progress=progress,
        ),
        one_curve,
        lambda progress: vi.find_orbits(DAMPER, most_cycles=1, most_impacts=2, starts=2, progress=progress),
        lambda progress: vi.sweep(
            DAMPER, over={"omega": [1.0, 1.1]}, start=vi.State((0.0, 0.0), (0.0, 1.0)),
            settle_periods=1, periods=1, progress=progress,
        ),
    ],
)  # fmt: skip
def test_every_long_work_tells_a_function_and_shows_a_stage(
    work: Callable[[Any], object], capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[vi.ProgressReport] = []
    work(told.append)
    assert told
    assert all(report.total is None or report.done <= report.total for report in told)
    assert capsys.readouterr().err == ""
    work(True)
    assert f"[1/1] {told[0].stage}" in capsys.readouterr().err
    work(None)
    assert capsys.readouterr().err == ""
    with pytest.raises(vi.InvalidParameterError, match="progress = 3: must be True, a function"):
        work(3)
