"""Branches of orbits of machines with elements: closed forms, and motions on both sides."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.model.parameters import with_parameter

REST = vi.State((0.0,), (0.0,))
GRAVITY = 1.0


def pressed(w: float, gap: float, c2: float) -> vi.Mechanism:
    """A soft impact oscillator whose spring is 29 times as stiff at the stop."""
    stop = vi.SoftStop((1.0,), upper=gap, stiffness=29.0, damping=c2, law="linear")
    return vi.Mechanism(mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]], elements=(stop,),
                        forces=(vi.Harmonic(w, (0.9 * w**2,)),))  # fmt: skip


def rubbing(friction: float, omega: float = 0.6) -> vi.Mechanism:
    return vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
                        elements=(vi.Friction((1.0,), friction),),
                        forces=(vi.Harmonic(omega, (1.0,)),))  # fmt: skip


SOFT = vi.Family(pressed, w=0.8, gap=0.9, c2=0.3)


@pytest.fixture(scope="module")
def soft() -> vi.Branch:
    return vi.continue_orbit(vi.find_orbit(SOFT, REST), "gap", (0.88, 1.8))


@pytest.fixture(scope="module")
def doubled(soft: vi.Branch) -> vi.Branch:
    branch = vi.switch_branch(soft["PD1"], (0.92, 1.25))
    assert isinstance(branch, vi.Branch)
    return branch


@pytest.mark.slow
def test_orbits_with_a_soft_stop_end_where_the_linear_response_grazes_it(soft: vi.Branch) -> None:
    w, point = 0.8, soft["GR1"]
    amplitude = 0.9 * w**2 / math.hypot(1.0 - w**2, 0.02 * w)
    assert abs(point.parameter - amplitude) < 1e-12
    assert point.admissible
    assert soft.curve.ends[1].reason is vi.continuation.Stopped.NO_MOTION
    assert [branch.symbol for branch in soft.others] == ["1-0-0"]
    assert not soft.curve.unresolved
    assert np.all(np.isnan(point.multipliers))  # one touch, two sequences
    linear = vi.switch_branch(point)
    assert isinstance(linear, vi.Branch)
    assert linear.symbol == "1-0-0"
    assert abs(linear["GR1"].parameter - amplitude) < 1e-12


@pytest.mark.slow
def test_motions_on_both_sides_of_a_period_doubling_have_one_and_two_cycles(
    soft: vi.Branch, doubled: vi.Branch
) -> None:
    """Next to it the doubled orbit is the motion to which the simulation settles, to the last digits."""
    point = soft["PD1"]
    assert point.normal_form.supercritical
    before, after = point.parameter - 0.02, point.parameter + 0.02
    assert vi.find_orbit(with_parameter(SOFT, "gap", before), REST).symbol == "1-1-0"
    motion = vi.find_orbit(with_parameter(SOFT, "gap", after), REST)
    assert motion.symbol == doubled.symbol == "2-2-0"
    orbit = vi.find_orbit(motion.system, doubled.orbit(int(np.argmin(abs(doubled.values - after)))))
    speeds = [sorted(o.linearised.rate) for o in (motion, orbit)]
    np.testing.assert_allclose(*speeds, rtol=0.0, atol=1e-9)
    assert orbit.stable


def test_switching_at_a_touch_leads_to_the_orbits_without_it(doubled: vi.Branch) -> None:
    """Which end there, too."""
    touch = doubled["GR1"]
    other = vi.switch_branch(touch, (1.0, 1.1))
    assert isinstance(other, vi.Branch)
    assert other.symbol == "2-1-0"
    at = min(abs(p.parameter - touch.parameter) for p in other.special_points if p.kind == "GR")
    assert at < 1e-9
    with pytest.raises(vi.InvalidParameterError, match="a flight of the orbit vanishes there"):
        vi.continue_bifurcation(touch, ("gap", "c2"), ((0.5, 1.8), (0.1, 0.5)))


def test_a_curve_of_period_doubling_passes_that_of_another_branch(soft: vi.Branch) -> None:
    curve = vi.continue_bifurcation(soft["PD1"], ("gap", "c2"), ((0.5, 1.8), (0.2, 0.3)))
    at = int(np.argmin(curve.values[:, 1]))
    gap, c2 = curve.values[at]
    assert c2 == 0.2
    start = vi.find_orbit(with_parameter(SOFT, "c2", 0.2), REST)
    branch = vi.continue_orbit(start, "gap", (0.88, 1.0))
    assert abs(branch["PD1"].parameter - gap) < 1e-9


def test_a_branch_of_a_soft_stop_comes_back_from_its_file(soft: vi.Branch, tmp_path: Path) -> None:
    vi.save(soft, tmp_path / "soft.nc")
    back = vi.load(tmp_path / "soft.nc", SOFT)
    assert back.family.signature == soft.family.signature
    np.testing.assert_array_equal(back.orbit(-1).multipliers, soft.orbit(-1).multipliers)
    assert back["GR1"].nearest == soft["GR1"].nearest


def onset_of_sticking(omega: float) -> float:
    """Friction at which x'' + x + f sign(x') = cos(omega t + phi) no longer reverses at once.

    Of the motion without stops, x = f + V cos(omega t + phi) + A cos t + B sin t in the half period after
    its maximum; there x' = 0, half a period later x is the opposite and x' = 0 again. The onset is
    where x'' = 0 at the maximum.
    """
    v, s, c = 1.0 / (1.0 - omega**2), math.sin(math.pi / omega), math.cos(math.pi / omega)
    phi = math.atan2((1.0 - v) * s, v * omega * (1.0 + c))
    b = v * omega * math.sin(phi)
    a = b * (1.0 + c) / s
    return abs(a * (1.0 + c) + b * s) / 2.0


@pytest.mark.slow
def test_friction_begins_to_stick_at_its_closed_form_seen_from_both_sides() -> None:
    level, low = "elements[0].kinetic", 0.3
    slipping = vi.continue_orbit(vi.find_orbit(rubbing(low), REST), level, (0.28, 0.6))
    wanted = onset_of_sticking(0.6)
    onset = slipping["CS1"]
    assert abs(onset.parameter - wanted) < 1e-12
    assert onset.images == 2  # on the way up and down
    (sticking,) = slipping.others  # the branch goes on
    assert sticking.orbit(-1).zero_multipliers == 1
    assert abs(sticking["CS1"].parameter - wanted) < 1e-12
    assert "a slip that reverses begins to stick" in sticking["CS1"].meaning
    assert slipping.admissible.all()
    assert slipping.values.max() < wanted < sticking.values.min()


def test_the_ball_on_a_table_is_born_and_doubles_at_its_closed_forms() -> None:
    e, name = 0.5, "elements[0].motion[0].sine[0]"
    table = vi.RigidStop((1.0,), lower=0.0, restitution=e, motion=vi.Harmonic(1.0, (1.1,)))
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(table,),
                     constant_force=(-GRAVITY,))  # fmt: skip
    start = vi.State((1.1 * math.sin(0.3),), (2.0 + 1.1 * math.cos(0.3),), phase=0.3)
    branch = vi.continue_orbit(vi.find_orbit(m, start), name, (0.9, 1.8))
    birth = math.pi * (1.0 - e) / (1.0 + e)
    doubling = math.hypot(birth, 2.0 * (1.0 + e**2) / (1.0 + e) ** 2)
    found: Any = {p.kind: p.parameter for p in branch.special_points}
    assert abs(found["SN"] - birth) < 1e-12
    assert abs(found["PD"] - doubling) < 1e-12


@pytest.mark.slow
def test_stick_slip_on_a_belt_ends_where_it_no_longer_reaches_its_speed() -> None:
    """Beyond it the block stays at its equilibrium or slips all the time: no limit is met."""
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]],
                     elements=(vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.05),))  # fmt: skip
    branch = vi.continue_orbit(vi.find_orbit(m, REST), "elements[0].belt_speed", (0.04, 0.3))
    end = branch["ZERO1"]
    assert end.meaning == "zero rate: a limit of an element is only touched"
    # from rest at static - c v the block swings about 0.1; friction drives it, the dashpot brakes it, and
    # it comes back to the belt's speed after one turn, at the top of a decaying oscillation
    v, c = end.parameter, 0.02
    rate = math.sqrt(1.0 - c**2 / 4.0)
    x, u = 0.2 - c * v - 0.1, v
    size = np.roots([1.0, c, 1.0])
    coefficients = np.linalg.solve([[1.0, 1.0], size], [x, u])
    t = np.linspace(3.5, 2.0 * math.pi / rate, 20_001)
    speed = (coefficients * size) @ np.exp(np.outer(size, t))
    assert abs(float(speed.real.max()) - v) < 1e-9
