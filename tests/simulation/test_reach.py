"""A clearance that is never reached: messages say how far the motion stays from the stop."""

from __future__ import annotations

import math
import re

import pytest

import vibroimpact as vi

REST = vi.State((0.0, 0.0), (0.0, 0.0))


def hammer(clearance: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[40.0, 0.0], [0.0, 8.0]],
        damping=[[60.0, -20.0], [-20.0, 20.0]],
        stiffness=[[2e5, -1e5], [-1e5, 1e5]],
        forces=(vi.Harmonic(60.0, (100.0, 0.0)),),
        elements=(vi.RigidStop((-1.0, 1.0), upper=clearance, restitution=0.7),),
    )


def amplitude() -> float:
    """Of x2 - x1 without impacts, from (K - w^2 M + i w C) X = F."""
    w = 60.0
    a, b = complex(2e5 - w * w * 40.0, w * 60.0), complex(-1e5, -w * 20.0)
    d = complex(1e5 - w * w * 8.0, w * 20.0)
    determinant = a * d - b * b
    return abs((-b - d) / determinant) * 100.0


def test_a_run_that_never_impacts_says_how_far_the_stop_is() -> None:
    run = vi.simulate(hammer(3.0), REST)
    said = re.search(
        r"x2 - x1 moves from (\S+) to (\S+) in the end, and the stop is at 3", repr(run)
    )
    assert said
    assert float(said[2]) == pytest.approx(amplitude(), rel=1e-3)
    assert float(said[1]) == pytest.approx(-amplitude(), rel=1e-3)
    assert "horizon" not in repr(run)


@pytest.mark.parametrize("analysis", [vi.section, vi.classify])
def test_every_analysis_of_impacts_says_so(analysis: object) -> None:
    found = analysis(hammer(3.0), REST)  # type: ignore[operator]
    assert "the stop is at 3: 3 are left" in repr(found)
    assert len(repr(found).splitlines()) == 1


def test_the_motion_without_impacts_is_an_orbit_that_is_as_far_from_the_stop() -> None:
    orbit = vi.find_orbit(hammer(3.0), REST)
    assert orbit.symbol == "1-0-0"
    assert orbit.clearance_to_grazing == pytest.approx(3.0 - amplitude(), rel=1e-9)


def test_an_attractor_is_described_in_one_line() -> None:
    machine = vi.ImpactOscillator(zeta=0.05, omega=2.0, restitution=0.8, clearance=0.0)
    found = vi.classify(machine, machine.free_start(), settle_events=500, points=500)
    largest = abs(vi.find_orbit(machine, machine.free_start()).multipliers[0])
    said = re.fullmatch(
        r"Attractor: 1-1-0 periodic, not symmetric; largest multiplier (\S+); .*", repr(found)
    )
    assert said
    assert float(said[1]) == pytest.approx(float(largest), rel=1e-5)
    assert math.isfinite(found.exponent.value)


def test_a_mechanism_is_printed_in_one_short_line() -> None:
    assert str(hammer(3.0)) == "Mechanism: 2 coordinates, 1 rigid stop, forced at 60"
    assert "stiffness=[[200000.0" in repr(hammer(3.0))
