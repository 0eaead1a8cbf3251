"""A branch holds each orbit once, and lists as special points only what they stand for."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.branches import grazing
from vibroimpact.branches.same_orbit import loop_of, same_loop
from vibroimpact.continuation import Stopped
from vibroimpact.continuation.newton import Attempt, NewtonStatus
from vibroimpact.orbits.maps import solved_map

TOUCH = 1e-6  # at a touch the square root of rounding, and the accuracy of Newton's method
CRITICAL = 1e-5  # a triple multiplier is known to the cube root of rounding


def oscillator(
    s: float, r: float, omega: float, damping: float = 0.0, force: float = 1.0
) -> vi.Mechanism:
    """x'' + damping x' + x = force sin(omega t), x <= s."""
    return vi.Mechanism(
        mass=[[1.0]],
        damping=[[damping]],
        stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (force,)),),
        elements=(vi.RigidStop((1.0,), upper=s, restitution=r),),
    )


def closed(branch: vi.Branch) -> bool:
    return Stopped.CLOSED in {end.reason for end in branch.curve.ends}


def assert_each_point_once(branch: vi.Branch) -> None:
    """No two special points of a kind are one orbit, wherever it begins and in the mirror."""
    span = branch.bounds[1] - branch.bounds[0]
    for first, second in combinations(branch.special_points, 2):
        if first.kind == second.kind and abs(first.parameter - second.parameter) < 1e-8 * span:
            loops = loop_of(first.orbit), loop_of(second.orbit)
            assert not same_loop(*loops, first.orbit.mechanism, TOUCH), (first, second)


def assert_points_are_what_they_say(branch: vi.Branch) -> None:
    """Solved for again, alone: residual, gap, multiplier."""
    for point in branch.special_points:
        orbit = point.orbit
        assert orbit.converged
        assert orbit.residual < 1e-9
        mu = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
        if point.kind == "SN":
            assert np.abs(mu - 1.0).min() < CRITICAL, point
        if point.kind == "PD":
            assert np.abs(mu + 1.0).min() < CRITICAL, point
        if point.kind == "BP":
            assert min(np.abs(mu + 1.0).min(), np.abs(mu - 1.0).min()) < CRITICAL, point
        if point.kind == "NS":
            assert np.abs(np.abs(mu[mu.imag > 0.0]) - 1.0).min() < CRITICAL, point
        if point.kind == "ZERO":
            assert orbit.least_impact_speed < 1e-8 * branch.impact_speed.max(), point
        if point.kind == "GR":
            touch = point.nearest
            assert touch is not None
            compiled = orbit.problem.compiled(orbit.parameter_value)
            state = compiled.after(orbit.states[touch.segment], touch.time)
            n, contact = orbit.mechanism.degrees, orbit.mechanism.rigid_stops[touch.contact]
            row, limit = np.array(contact.row), (contact.lower, contact.upper)[touch.side > 0]
            fastest = branch.impact_speed.max()
            assert abs(limit - row @ state[:n]) < 1e-8 * fastest * orbit.period, point
            assert abs(row @ state[n : 2 * n]) < TOUCH * fastest, point


@pytest.mark.slow
@pytest.mark.parametrize("both", [True, False])
@pytest.mark.parametrize("start", [0.1, -0.2])
def test_a_loop_along_which_the_phase_turns_once_is_gone_round_once(
    start: float, both: bool
) -> None:
    # omega = 2: the flight between impacts takes half a free period, and s = -cos(theta) / 3
    system = vi.Family(oscillator, s=start, r=0.8, omega=2.0)
    orbit = vi.find_orbit(system, vi.State((start,), (-0.5,), 0.0))
    branch = vi.continue_orbit(orbit, "s", (-3.0, 3.0), both=both, inadmissible=True)
    assert closed(branch)
    turn = branch.orbit(len(branch) - 1).states[0] - branch.orbit(0).states[0]
    np.testing.assert_allclose(np.abs(turn), [0.0, 0.0, 2.0 * math.pi], atol=1e-6)
    at = sorted(p.parameter for p in branch.special_points if p.kind == "ZERO")
    assert at == pytest.approx([-1.0 / 3.0, 1.0 / 3.0], abs=1e-10)
    assert_each_point_once(branch)
    assert_points_are_what_they_say(branch)


@pytest.mark.slow
def test_a_loop_longer_than_one_direction_is_joined_where_the_two_meet() -> None:
    system = vi.Family(oscillator, s=0.1, r=0.8, omega=2.0)
    orbit = vi.find_orbit(system, vi.State((0.1,), (-0.5,), 0.0))
    steps = vi.Steps(first=0.02, largest=0.5, points=250)
    branch = vi.continue_orbit(orbit, "s", (-3.0, 3.0), steps=steps, inadmissible=True)
    assert [end.reason for end in branch.curve.ends] == [Stopped.CLOSED, Stopped.CLOSED]
    turn = branch.orbit(len(branch) - 1).states[0] - branch.orbit(0).states[0]
    np.testing.assert_allclose(np.abs(turn), [0.0, 0.0, 2.0 * math.pi], atol=1e-6)
    assert [p.kind for p in branch.special_points].count("ZERO") == 2
    assert_each_point_once(branch)


def budd_dux(r: float, omega: float, cycles: int) -> tuple[float, float]:
    """(gamma, kappa) of undamped orbits with one impact in so many periods: a loop in s.

    Between impacts x is gamma cos(omega t + theta) and a free oscillation of the same height q at
    both ends, with speeds +-q tan(T / 2). The law of impact makes s = gamma cos(theta) + kappa
    sin(theta), and the speed before the impact -2 gamma omega sin(theta) / (1 - r).
    """
    gamma = 1.0 / (1.0 - omega * omega)
    kappa = gamma * omega * (1.0 + r) / ((1.0 - r) * math.tan(math.pi * cycles / omega))
    return gamma, kappa


LOOPS = [(0.8, 3.7, 2), *((r, w, n) for r, w, n in zip(
    np.random.default_rng(8).uniform(0.5, 0.9, 3), np.random.default_rng(9).uniform(1.6, 3.4, 3),
    (1, 2, 1), strict=True))]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("r", "omega", "cycles"), LOOPS)
def test_the_folds_and_touches_of_a_loop_are_those_of_its_closed_form(
    r: float, omega: float, cycles: int
) -> None:
    gamma, kappa = budd_dux(r, omega, cycles)
    theta = 1.2
    s = gamma * math.cos(theta) + kappa * math.sin(theta)
    before = -2.0 * gamma * omega * math.sin(theta) / (1.0 - r)
    guess = vi.Guess(
        np.array([[s, -r * before, theta + math.pi / 2.0]]),
        np.array([2.0 * math.pi * cycles / omega]),
    )
    system = vi.Family(oscillator, s=s, r=r, omega=omega)
    orbit = vi.find_orbit(system, guess, stops="A", cycles=cycles)
    np.testing.assert_allclose(orbit.states, guess.states, rtol=1e-9)
    fold = math.hypot(gamma, kappa)
    branch = vi.continue_orbit(orbit, "s", (-2.0 * fold, 2.0 * fold), inadmissible=True)
    assert closed(branch)
    for kind, at in (("SN", fold), ("ZERO", abs(gamma))):
        found = sorted(p.parameter for p in branch.special_points if p.kind == kind)
        assert found == pytest.approx([-at, at], abs=1e-10)
    assert_each_point_once(branch)
    assert_points_are_what_they_say(branch)


def test_the_fold_of_budd_and_dux_is_the_published_one() -> None:
    assert math.hypot(*budd_dux(0.8, 3.7, 2)) == pytest.approx(0.345147124452810, abs=1e-14)


@pytest.mark.slow
def test_what_is_no_special_point_is_unresolved_with_the_reason() -> None:
    # at omega = 3 the force turns three times in a free period: F is singular at speed zero
    system = oscillator(s=0.3, r=0.9, omega=4.2, force=-0.2)
    orbit = vi.find_orbit(system, vi.State((-0.1,), (0.5,), 0.3))
    assert orbit.symbol == "3-1-0"
    branch = vi.continue_orbit(orbit, "omega", (2.2, 6.5), inadmissible=True)
    kinds = sorted((p.kind, round(p.parameter, 6)) for p in branch.special_points)
    assert kinds == [("SN", 4.895148), ("ZERO", 3.0), ("ZERO", 3.0)]
    assert_each_point_once(branch)
    assert_points_are_what_they_say(branch)
    reasons = [note.reason for note in branch.curve.unresolved]
    assert any(text.startswith("PD at omega = 3") and "no multiplier is -1" in text
               for text in reasons)  # fmt: skip


def test_an_orbit_that_does_not_solve_its_equations_is_not_converged() -> None:
    system = vi.Family(oscillator, s=0.1, r=0.8, omega=2.0)
    orbit = vi.find_orbit(system, vi.State((0.1,), (-0.5,), 0.0))
    branch = vi.continue_orbit(orbit, "s", (0.0, 0.2))
    z = branch.curve.z[3]
    assert branch.family.orbit(z, float(branch.values[3])).converged
    off = branch.family.orbit(z * (1.0 + 1e-6), float(branch.values[3]))
    assert not off.converged
    assert "do not hold" in off.status
    assert np.isnan(off.multipliers).all()


# ---- random systems ------------------------------------------------------------------------------


def random_system(seed: int) -> vi.Mechanism:
    """One or two masses, a stop or two mirror images of one."""
    rng = np.random.default_rng(seed)
    n, stop = int(rng.integers(1, 3)), rng.uniform(0.1, 0.8)
    k, c = rng.uniform(0.3, 2.0, n + 1), rng.uniform(0.01, 0.15, n + 1)
    k[n], c[n] = 0.0, 0.0

    def chain(parts: np.ndarray) -> np.ndarray:
        return np.diag(parts[:-1] + parts[1:]) - np.diag(parts[1:-1], 1) - np.diag(parts[1:-1], -1)

    contact = vi.RigidStop(
        ((1.0,), (1.0, -1.0))[n - 1],
        lower=-stop if rng.random() < 0.5 else -math.inf,
        upper=stop,
        restitution=rng.uniform(0.3, 0.9),
    )
    return vi.Mechanism(
        mass=np.diag(rng.uniform(0.4, 1.0, n)),
        damping=chain(c),
        stiffness=chain(k),
        forces=(vi.Harmonic(rng.uniform(0.6, 2.2), (1.0, 0.0)[:n]),),
        elements=(contact,),
    )


def assert_found_again_alone(branch: vi.Branch) -> None:
    """The orbits at special points are those of their own system, with the map's multipliers."""
    for point in branch.special_points:
        if point.kind not in ("PD", "NS", "GR"):
            continue  # Newton's matrix is singular there, or the map has no derivative
        alone = vi.find_orbit(point.orbit.system, point.orbit)
        assert alone.converged, point
        size = np.abs(point.orbit.states).max()
        np.testing.assert_allclose(alone.states, point.orbit.states, atol=1e-8 * size)
        if point.kind != "GR":
            own, mu = solved_map(alone).jacobian(), point.multipliers
            mu = mu if point.orbit.half_multipliers is None else point.orbit.half_multipliers
            apart = np.abs(np.linalg.eigvals(own)[:, None] - mu).min(axis=0)
            assert apart.max() < CRITICAL * max(1.0, np.abs(mu).max())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2, 4, 5])
def test_special_points_of_random_systems_are_real_and_listed_once(seed: int) -> None:
    system = random_system(seed)
    orbit = vi.find_orbit(system, vi.State((0.0,) * system.degrees, (0.5,) * system.degrees))
    assert orbit.converged
    steps, omega = vi.Steps(first=0.05, largest=0.5, points=90), system.omega
    branches = [vi.continue_orbit(orbit, "omega", (0.7 * omega, 1.3 * omega), steps=steps)]
    births = [p for p in branches[0].special_points if p.kind in ("PD", "BP")]
    born = [vi.switch_branch(p, steps=steps) for p in births[:1]]
    for branch in [*branches, *(b for b in born if isinstance(b, vi.Branch))]:
        assert_each_point_once(branch)
        assert_points_are_what_they_say(branch)
        assert_found_again_alone(branch)


@pytest.mark.slow
def test_a_grazing_that_cannot_be_located_is_unresolved_and_loses_no_branch(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.52
    )

    def fails(_problem: object, guess: np.ndarray, *_: object) -> Attempt:
        return Attempt(NewtonStatus.NO_CONVERGENCE, guess)

    orbit = vi.symmetric_orbits(damper)[0]
    before = vi.continue_orbit(orbit, "omega", (0.5, 0.53), inadmissible=True)
    assert [p.kind for p in before.special_points] == ["GR"]
    monkeypatch.setattr(grazing, "correct", fails)
    branch = vi.continue_orbit(orbit, "omega", (0.5, 0.53), inadmissible=True)
    assert len(branch) == len(before)
    assert not branch.special_points
    [note] = branch.curve.unresolved
    assert note.name == "gap"
    assert branch.values[note.first] < before["GR1"].parameter < branch.values[note.last]


def test_the_share_that_is_stable_is_that_of_the_range() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.75
    )
    low, high = 0.69, 0.76
    branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (low, high))
    at = branch["BP1"].parameter  # unstable below
    share = (high - at) / (high - low)
    assert branch.stable_share == pytest.approx(share, rel=1e-12)
    assert branch.stable.mean() != pytest.approx(share, rel=1e-3)
    assert branch.extent == (low, high)
    assert f", {share:.0%} of it stable" in repr(branch)
