"""Branches that go on with orbits of other sequences, and the points at which rest and stick begin or end."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import vibroimpact as vi
from vibroimpact.branches.beginning import BranchStart, begins_at
from vibroimpact.compile.prescribed import CHATTER_WATCH
from vibroimpact.continuation import Stopped

KINETIC, STATIC, FORCE = 1.0, 1.1, 1.5
# Onsets at which another program follows the acceleration after a reversal to zero, to its printed digits.
PUBLISHED = (0.722679194438133, 1.23574715232)


def rubbing(omega: float) -> vi.Mechanism:
    """x'' + 0.1 x' + x = FORCE cos(omega t), with friction."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (0.0,), (FORCE,)),),
        elements=(vi.Friction((1.0,), kinetic=KINETIC, static=STATIC),),
    )  # fmt: skip


def holding_force(omega: float, force: float = FORCE) -> float:
    """Force that would hold the mass where it reverses: x slips from -X to X and back, half a period each.

    x = y + F(t) - KINETIC, F the forced response to force cos(omega t + phi) and y' = A y; x' vanishes at both ends.
    -X = y(0) + F(0) - KINETIC at the start, X = E y(0) - F(0) - KINETIC at the end give F(0) by X.
    """
    flow = expm(np.array([[0.0, 1.0], [-1.0, -0.1]]) * math.pi / omega)
    one, k = np.array([1.0, 0.0]), KINETIC
    response = force / complex(1.0 - omega**2, 0.1 * omega)

    def forced(x: float) -> np.ndarray:  # F(0), F'(0): linear in X
        right = flow @ ((k - x) * one) - (x + k) * one
        return np.linalg.solve(np.eye(2) + flow, right)

    def size(x: float) -> float:
        f = forced(x)
        return math.hypot(f[0], f[1] / omega) - abs(response)

    x = brentq(size, 1e-6, 50.0, xtol=1e-15)
    f = forced(x)
    turned = complex(f[0], -f[1] / omega) / response  # exp(i phi)
    return abs(-force * turned.real - x)  # at the end the force has changed its sign


@cache
def rubbed() -> vi.Branch:
    orbit = vi.find_orbit(rubbing(0.78), vi.State((2.0,), (0.0,)))
    return vi.continue_orbit(orbit, "omega", (0.7, 0.79))


def test_a_branch_of_friction_goes_on_where_the_static_level_is_reached() -> None:
    slipping = rubbed()
    wanted = brentq(lambda w: holding_force(w) - STATIC, 0.73, 0.76, xtol=1e-15)
    (sticking,) = slipping.others
    for branch in (slipping, sticking):
        (point,) = branch.special_points
        assert point.kind == "REST"
        assert point.images == 2  # on the way up and down
        assert abs(point.parameter - wanted) < 1e-12
        assert branch.admissible.all()
    assert sticking.values.max() < wanted < slipping.values.min()
    assert sticking.values.min() == 0.7
    assert sticking.orbit(0).zero_multipliers == 1
    assert slipping.curve.ends[0].reason is Stopped.NO_MOTION
    assert "goes on" in str(slipping.curve.ends[0])
    assert repr(sticking) in repr(slipping)


def test_what_does_not_exist_is_followed_when_asked_for() -> None:
    orbit = vi.find_orbit(rubbing(0.78), vi.State((2.0,), (0.0,)))
    branch = vi.continue_orbit(orbit, "omega", (0.7, 0.79), inadmissible=True)
    assert branch.values.min() == 0.7
    assert not branch.admissible.all()
    assert not branch.others
    onset = branch["STICK1"]
    assert abs(onset.parameter - PUBLISHED[0]) < 2e-14
    assert abs(brentq(lambda w: holding_force(w) - KINETIC, 0.7, 0.76) - PUBLISHED[0]) < 1e-12
    assert onset.images == 2


@pytest.mark.slow
def test_a_response_with_impacts_has_no_hole() -> None:
    wall = 4.0
    stop = vi.RigidStop((1.0,), lower=-wall, upper=wall, restitution=0.7)
    m = replace(rubbing(0.7), elements=(stop,), forces=(vi.Harmonic(0.7, (0.0,), (1.0,)),))
    branch = vi.continue_orbit(
        vi.find_orbit(m, vi.State((0.0,), (0.0,)), stops=""), "omega", (0.7, 1.6)
    )
    assert [part.symbol for part in (branch, *branch.others)] == ["1-0-0", "1-1-1", "1-0-0"]
    touches = [
        brentq(lambda w: 1.0 / math.hypot(1.0 - w**2, 0.1 * w) - wall, low, high, xtol=1e-15)
        for low, high in ((0.7, 0.99), (1.0, 1.6))
    ]
    first, impacts, last = branch, *branch.others
    assert abs(first["GR1"].parameter - touches[0]) < 1e-12
    assert abs(impacts["ZERO1"].parameter - touches[1]) < 1e-10
    assert abs(last["GR1"].parameter - touches[1]) < 1e-12
    assert last.values.max() == 1.6


def ball(push: float, restitution: float) -> vi.Mechanism:
    """A ball on a floor: x'' = push sin t - 1."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        forces=(vi.Harmonic(1.0, (push,)),),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=restitution),),
    )  # fmt: skip


def settled(push: float, restitution: float) -> vi.Orbit:
    m = ball(push, restitution)
    return vi.find_orbit(m, vi.simulate(m, vi.State((0.0,), (0.0,)), impacts=100))


def test_a_plastic_ball_no_longer_rests_where_its_flight_takes_the_period() -> None:
    """Released at sin t0 = 1 / G it flies one period if G cos t0 = pi: G^2 = 1 + pi^2."""
    branch = vi.continue_orbit(settled(3.2, 0.0), "forces[0].sine[0]", (3.15, 3.35))
    wanted = math.hypot(1.0, math.pi)
    end = branch["CS1"]
    assert abs(end.parameter - wanted) < 1e-12
    assert end.meaning.startswith("crossing-sliding: a plastic impact that opens at once")
    (opening,) = branch.others
    assert abs(opening["CS1"].parameter - wanted) < 1e-10
    assert opening.values.min() > end.parameter
    assert opening.admissible.all()


def test_a_branch_goes_on_to_an_orbit_to_which_motions_settle_slowly() -> None:
    """Beyond SS the second of two plastic impacts is none, as a settled motion shows; its multipliers are 0.36."""
    m = vi.Mechanism(
        mass=np.eye(2), damping=[[0.15, -0.05], [-0.05, 0.1]], stiffness=[[2.0, -1.0], [-1.0, 2.0]],
        forces=(vi.Harmonic(0.5, (0.0, 0.0), (1.5, 0.0)),),
        elements=(vi.RigidStop((0.0, 1.0), upper=0.2, restitution=0.0),),
    )  # fmt: skip
    still = vi.State((0.0, 0.0), (0.0, 0.0))
    branch = vi.continue_orbit(vi.find_orbit(m, still), "omega", (0.48, 0.52))
    (after,) = branch.others
    assert (branch.symbol, after.symbol) == ("1-2-0", "1-1-0")
    assert after["SS1"].parameter == pytest.approx(branch["SS1"].parameter, abs=1e-8)
    beyond = replace(m, forces=(vi.Harmonic(after.values.max(), (0.0, 0.0), (1.5, 0.0)),))
    settled_there = vi.find_orbit(beyond, still)
    at = int(np.argmax(after.values))
    assert abs(after.orbit(at).period - settled_there.period) < 1e-12
    np.testing.assert_allclose(
        sorted(after.orbit(at).durations), sorted(settled_there.durations), atol=1e-9
    )
    # the gap opens from the stop at speed zero: no touch there
    assert min(near.gap for near in branch.orbit(0).gaps.values()) > 1e-9


@cache
def past_chatter() -> vi.Branch:
    return vi.continue_orbit(settled(1.59, 0.5), "forces[0].sine[0]", (1.59, 1.602))


@pytest.mark.slow
def test_chatter_ends_to_be_completed_where_simulated_balls_no_longer_come_to_rest() -> None:
    end = past_chatter()["CHAT1"]
    assert end.error < 1e-6

    def rests(push: float) -> bool:
        run = vi.simulate(ball(push, 0.5), vi.State((0.0,), (0.0,)), impacts=200)
        return int((run.status == vi.Status.CHATTER).sum()) > 3

    assert rests(end.parameter - end.error)
    assert not rests(end.parameter + end.error)
    # the limit of the counts in tests/normal_forms/test_chatter.py, to 15 impacts, extrapolated by its law
    assert abs(end.parameter - 1.5973488311) < 5e-10
    assert end.normal_form.restitution == 0.5
    assert "0.502614 times as far away" in repr(end.normal_form)


@pytest.mark.slow
def test_what_begins_beyond_chatter_is_a_motion_without_it_however_wide_the_range() -> None:
    end = past_chatter()["CHAT1"]
    begins = begins_at(end)
    assert begins is not None
    for bounds in ((1.59, 1.602), (1.2, 2.2)):
        start = begins(end, bounds)
        assert isinstance(start, BranchStart)
        assert start.family.orbit(start.z, start.parameter).admissible
        assert CHATTER_WATCH not in start.family.signature.begun


@pytest.mark.slow
def test_a_branch_goes_on_from_chatter_to_sequences_with_an_impact_more_or_fewer() -> None:
    branch = past_chatter()
    counts = {int(part.symbol.rpartition("-")[2]): part for part in branch.others}
    least, most = min(counts), max(counts)
    assert sorted(counts) == list(range(least, most + 1))
    assert len(counts) == 7
    assert all(part.admissible.all() for part in branch.others)
    at = branch["CHAT1"].parameter
    born = [counts[k]["GR1"].parameter - at for k in range(least + 1, most)]  # with an impact more
    ratios = np.array(born[1:]) / np.array(born[:-1])
    wanted = branch["CHAT1"].normal_form.ratio
    away = np.abs(ratios / wanted - 1.0)  # the next term is smaller by 0.87 for each impact
    assert np.all(away < 0.02)
    assert np.all(np.diff(away) < 0.0)
    for part in (branch, *branch.others):  # the ends say what follows
        assert any(
            "goes on" in str(end) or "not followed" in str(end) or "most" in str(end)
            for end in part.curve.ends
        )


def test_a_file_and_a_picture_hold_the_branches_with_which_it_goes_on(tmp_path: Path) -> None:
    vi.save(rubbed(), tmp_path / "branch.nc")
    again = vi.load(tmp_path / "branch.nc")
    assert len(again.others) == 1
    np.testing.assert_array_equal(again.others[0].values, rubbed().others[0].values)
    assert again.others[0]["REST1"].images == 2
    ax = rubbed().plot()
    drawn = np.concatenate(
        [
            np.asarray(line.get_xdata(), dtype=float)
            for line in ax.get_lines()
            if len(line.get_xdata()) > 2
        ]
    )
    assert drawn.min() == 0.7
    assert drawn.max() == 0.79


@pytest.mark.slow
def test_onsets_of_stick_are_curves_in_two_parameters() -> None:
    orbit = vi.find_orbit(rubbing(0.78), vi.State((2.0,), (0.0,)))
    branch = vi.continue_orbit(orbit, "omega", (0.7, 0.79), inadmissible=True)
    for label, level in (("STICK1", KINETIC), ("REST1", STATIC)):
        curve = vi.continue_bifurcation(
            branch[label], ("omega", "forces[0].cosine[0]"), ((0.7, 0.8), (1.45, 1.55))
        )
        assert not curve.special_points
        w, f = curve.values[len(curve) // 3]
        assert abs(f - FORCE) > 1e-3
        assert abs(holding_force(w, f) - level) < 1e-11


def test_an_interruption_ends_the_branch_and_those_that_would_follow() -> None:
    calls = 0

    def interrupt(_: vi.ProgressReport) -> None:
        nonlocal calls
        calls += 1
        if calls == 5:  # of the second direction, when the first has ended at CS1
            raise KeyboardInterrupt

    branch = vi.continue_orbit(
        settled(3.2, 0.0), "forces[0].sine[0]", (2.9, 3.4), progress=interrupt
    )
    assert branch["CS1"]
    assert branch.curve.interrupted
    assert branch.others == ()
    assert "interrupted" in str(branch.curve.ends[1])
