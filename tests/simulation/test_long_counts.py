"""Counts that take long are announced, and end at once at Ctrl-C."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact._core import progress
from vibroimpact.simulation.simulator import Simulator

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)
STATE = vi.State((0.0, 0.0), (0.0, 1.0))

CALLS = [
    "vi.simulate(damper, state, impacts=10**9, t_max=1e12)",
    "vi.simulate(clattering, away, impacts=10**7)",
    "vi.simulate(rubbing, vi.State((1.0,), (0.0,)), t_max=1e9)",
    "vi.simulate_hybrid(relay, 'on', [1.0], events=3 * 10**7)",
    "vi.section(clattering, away, points=10**7)",
    "vi.section(clattering, away, points=10**6)",  # of every impact one in five is such a point
    "vi.section(rubbing, vi.State((1.0,), (0.0,)), at=vi.AtPhase(), points=10**8)",
    "vi.classify(clattering, away, points=10**7)",
    "vi.section(damper, state, points=3, settle_events=10**11)",
    "vi.section(damper, state, at=vi.AtPhase(), points=3, settle_events=10**11)",
    "vi.section(rubbing, vi.State((1.0,), (0.0,)), at=vi.AtChange(), points=3, settle_events=10**11)",
    "vi.classify(damper, state, settle_events=10**11, most_settle_events=10**11)",
    "vi.lyapunov_exponent(damper, state, impacts=10**9)",
    "vi.lyapunov_exponent(damper, state, settle_impacts=10**11)",
    "vi.lyapunov_spectrum(damper, state, impacts=10**7)",
    "vi.lyapunov_spectrum(damper, state, settle_impacts=10**11)",
    "vi.map_derivative(damper, state, impacts=10**9)",
    "vi.find_orbits(damper, most_cycles=1, most_impacts=2, starts=10**9, progress=False)",
    "vi.find_circle(vi.ExplicitMap(turn, dimension=2), (1.0, 0.0), p=0.9, settle_iterates=10**11)",
]
SCRIPT = """
import math, signal, sys, warnings
import vibroimpact as vi
from vibroimpact._core import progress

progress.ANNOUNCED_SECONDS = 6.0  # a fast machine does some of the calls within a minute
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have it ignored in the background

damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
                         half_clearance=5.0, omega=1.2)
state = vi.State((0.0, 0.0), (0.0, 1.0))
rubbing = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
                       elements=(vi.Friction((1.0,), 0.1),), forces=(vi.Harmonic(0.7, (1.0,)),))
clattering = vi.Mechanism(  # some ten microseconds per impact
    mass=[[1, 0, 0], [0, 1, 0], [0, 0, 1]], stiffness=[[2, -1, 0], [-1, 2, -1], [0, -1, 2]],
    damping=[[0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]], forces=(vi.Harmonic(0.7, (1, 1, 1)),),
    elements=tuple(vi.SoftStop(row, lower=-0.1, upper=0.1, stiffness=50.0)
                   for row in ((1, 0, 0), (0, 1, 0), (0, 0, 1))),
)
away = vi.State((0, 0, 0), (1, 2, 3))
relay = vi.HybridSystem(
    modes={"on": vi.LinearMode([[-1.0]], [3.0]), "off": vi.LinearMode([[-1.0]])},
    guards={"upper": vi.LinearGuard([1.0], 2.0), "lower": vi.LinearGuard([1.0], 1.0)},
    transitions=(vi.Transition("on", "upper", "rising", "off"),
                 vi.Transition("off", "lower", "falling", "on")),
)

def turn(x, p):
    grow = 1.2 - 0.2 * (x[0] ** 2 + x[1] ** 2)
    return [grow * (0.28 * x[0] - 0.96 * x[1]), grow * (0.96 * x[0] + 0.28 * x[1])]

def say(text, *_, **__):
    print(text, flush=True)

warnings.showwarning = say
warnings.simplefilter("always")
for call in sys.stdin:
    try:
        exec(call)
        say("ended")
    except KeyboardInterrupt:
        say("interrupted")
"""


def seconds_of(process: int) -> float:
    """Time of a processor that a process has taken, however many others there are."""
    of = Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()
    return int(of[11]) / os.sysconf("SC_CLK_TCK")


@pytest.fixture(scope="module")
def caller() -> Iterator[subprocess.Popen[str]]:
    """A process that makes every call that it is sent."""
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as run:
        yield run
        run.kill()


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc: time is not known")
@pytest.mark.parametrize("call", CALLS)
def test_a_long_count_is_announced_within_seconds_and_ends_within_one_at_an_interruption(
    call: str, caller: subprocess.Popen[str]
) -> None:
    assert caller.stdin is not None
    assert caller.stdout is not None
    caller.stdin.write(f"{call}\n")
    caller.stdin.flush()
    said = caller.stdout.readline()
    assert "will take some" in said, said
    assert "Ctrl-C ends it" in said
    time.sleep(0.2)  # it is at work
    used = seconds_of(caller.pid)
    caller.send_signal(signal.SIGINT)
    assert caller.stdout.readline() == "interrupted\n"
    assert seconds_of(caller.pid) - used < 1.0


def test_what_takes_less_than_a_minute_is_not_announced() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        vi.section(DAMPER, STATE, points=3, settle_events=200_000)
        vi.lyapunov_exponent(DAMPER, STATE, impacts=20_000)
        vi.simulate(DAMPER, STATE, impacts=30_000, t_max=1e6)


def test_a_transient_that_is_measured_first_has_the_bits_of_one_that_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plain, measured = Simulator(DAMPER, STATE), Simulator(DAMPER, STATE)
    monkeypatch.setattr(progress, "PROBED", 10**6)
    plain.settle(60_000)
    monkeypatch.setattr(progress, "PROBED", 1)
    measured.settle(60_000)
    np.testing.assert_array_equal(plain.at.y, measured.at.y)


def test_the_duration_said_is_that_of_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second for each of 10^6: 11.6 days, announced once."""
    clock = itertools.count()
    monkeypatch.setattr(progress.time, "monotonic", lambda: float(next(clock)))
    with pytest.warns(UserWarning, match=r"settle = 1000000: will take some 11\.6 days") as said:
        numbers = list(itertools.islice(progress.counting("settle", 10**6), 4))
    assert numbers == [0, 1, 2, 3]
    assert len(said) == 1
