"""Periodic orbits against closed forms, 50-digit references, identities and simulation."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from support.periodic import (
    PAPER_RANGES,
    coco,
    damper_orbits,
    guess_of_entry,
    impacts_of,
    largest,
    mechanism_of_entry,
    numbers,
    orbits_of_chains,
    table,
)
from support.systems import oscillator, paper_damper, random_mechanism
from vibroimpact_papers.impact_damper.symmetric_bifurcations import half_map_jacobian

import vibroimpact as vi
from vibroimpact.orbits.find import (
    SAME_ORBIT_RELATIVE,
    Guess,
    nearest_symmetry,
    primitive,
    solve,
    unfolded,
)
from vibroimpact.orbits.problem import Signature

EPS = np.finfo(float).eps
PERIODIC = table("periodic.toml")
# Newton's method ends within some hundred roundings of the largest coordinate.
SOLVED = 1e-12


def sorted_by_angle(values: Any) -> np.ndarray:
    """An order that both sides of a comparison share."""
    z = np.asarray(values, dtype=complex)
    return z[np.lexsort((z.imag, z.real.round(9)))]


def one_sided(entry: dict[str, Any]) -> vi.Mechanism:
    """x'' + x = cos(omega t) before a wall."""
    force = vi.Harmonic(float(entry["omega"]), (0.0,), (1.0,))
    return oscillator(
        stiffness=1.0, damping=0.0, forces=(force,), lower=-math.inf, upper=float(entry["wall"]),
        restitution=float(entry["restitution"]),
    )  # fmt: skip


# ---- found, with multipliers ---------------------------------------------------------------------


@pytest.mark.parametrize("entry", PERIODIC["orbit"], ids=lambda e: e["name"])
def test_orbits_and_multipliers_equal_the_50_digit_reference(entry: dict[str, Any]) -> None:
    exact = guess_of_entry(entry)
    # a start off by a part in 1e4, so that something is left to find
    guess = vi.Guess(exact.states * (1.0 + 1e-4), exact.durations)
    orbit = vi.find_orbit(
        mechanism_of_entry(entry), guess, stops=impacts_of(entry["signature"]),
        cycles=entry["cycles"],
    )  # fmt: skip
    assert orbit.converged
    tolerance = SOLVED * largest(exact.states)
    np.testing.assert_allclose(orbit.states, exact.states, rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(orbit.durations, exact.durations, rtol=SOLVED)
    values = np.array(numbers(entry["multipliers_real"])) + 1j * np.array(
        numbers(entry["multipliers_imag"])
    )
    # a derivative of the map by the state is below 1e2 here: two digits less than the state has
    np.testing.assert_allclose(
        sorted_by_angle(orbit.multipliers), sorted_by_angle(values), rtol=0.0, atol=1e2 * SOLVED
    )
    assert (orbit.stable, orbit.admissible) == (entry["stable"], entry["admissible"])


@pytest.mark.parametrize("entry", PERIODIC["one_sided"], ids=lambda e: e["omega"])
def test_one_sided_orbits_equal_the_closed_form(entry: dict[str, Any]) -> None:
    speed, phase = float(entry["speed"]), float(entry["phase"])
    period = entry["periods"] * 2.0 * math.pi / float(entry["omega"])
    after = -float(entry["restitution"]) * speed
    guess = vi.Guess(np.array([[0.0, after * 1.01, phase + 0.01]]), np.array([period]))
    orbit = vi.find_orbit(one_sided(entry), guess, stops=["A"], cycles=entry["periods"])
    assert orbit.least_impact_speed == pytest.approx(speed, rel=SOLVED)
    assert orbit.state.phase == pytest.approx(phase, rel=SOLVED)
    values = np.array(numbers(entry["multipliers_real"])) + 1j * np.array(
        numbers(entry["multipliers_imag"])
    )
    np.testing.assert_allclose(
        sorted_by_angle(orbit.multipliers), sorted_by_angle(values), rtol=1e2 * SOLVED
    )


def test_the_textbook_oscillator_has_its_published_orbit() -> None:
    orbit = vi.find_orbit(coco(), vi.State((0.0,), (0.0,)))
    assert orbit.symbol == "1-1-0"
    assert orbit.states[0] == pytest.approx([1.0, -1.36, 0.076], abs=5e-3)  # as printed
    product = np.prod(orbit.multipliers).real
    assert product == pytest.approx(0.64 * math.exp(-0.1 * 2.0 * math.pi), rel=1e2 * EPS)
    assert orbit.admissible
    assert orbit.stable


def strikes_b_first(damper: vi.ImpactDamper, state: vi.State) -> bool:
    """Whether a motion that leaves stop A meets B half a period later, and nothing before."""
    half = math.pi / damper.omega
    run = vi.simulate(damper, state, impacts=1, t_max=1.5 * half)
    leaves = state.velocity[1] < state.velocity[0]
    return bool(leaves and len(run) and run.side[0] == -1 and abs(run.time[0] / half - 1.0) < 1e-9)


@pytest.mark.parametrize("name", PAPER_RANGES)
def test_the_symmetric_branch_is_the_closed_form(name: str) -> None:
    for omega in np.linspace(*PAPER_RANGES[name], 21):
        damper = paper_damper(name, omega)
        for closed in vi.symmetric_orbits(damper):
            orbit = vi.find_orbit(damper, closed)
            here = np.array([*orbit.state.position, *orbit.state.velocity])
            there = np.array([*closed.state.position, *closed.state.velocity])
            size = largest(there)
            np.testing.assert_allclose(here, there, rtol=0.0, atol=SOLVED * size)
            assert orbit.half_multipliers is not None
            half, _ = half_map_jacobian(damper, closed.state)
            nus, scale = np.linalg.eigvals(half), largest(half)
            # eigenvalues of matrices that agree to 1e-11 of their entries, well separated or not
            apart = sorted_by_angle(orbit.half_multipliers**2) - sorted_by_angle(nus**2)
            assert largest(apart) <= 1e-5 * scale**2
            # the characteristic polynomial has no such loss
            np.testing.assert_allclose(
                np.poly(orbit.half_multipliers), np.poly(nus), rtol=0.0, atol=1e-10 * scale**2
            )
            assert orbit.admissible == closed.admissible == strikes_b_first(damper, closed.state)
            assert orbit.stable == closed.stable == (closed.admissible and largest(nus) < 1.0)


def test_a_guess_may_be_an_orbit_a_run_a_state_or_segments() -> None:
    damper = paper_damper("A", 1.2)
    wanted = vi.find_orbit(damper, vi.symmetric_orbits(damper)[0])
    run = vi.simulate(damper, vi.State((0.0, 0.0), (0.0, 1.0)), impacts=2000)
    for guess in (wanted, run, run.start):
        found = vi.find_orbit(damper, guess)
        assert found.symmetric
        # a run may begin its loop at the other stop
        assert sorted(np.abs(found.states[0, :4])) == pytest.approx(
            sorted(np.abs(wanted.states[0, :4])), rel=SOLVED
        )
    whole = unfolded(wanted)
    full = vi.find_orbit(damper, whole, stops=["A", "B"], cycles=1)
    assert not full.symmetric
    np.testing.assert_allclose(
        np.poly(full.multipliers), np.poly(wanted.multipliers), rtol=0.0, atol=1e-11
    )


def test_an_orbit_leads_to_the_same_orbit_of_a_system_nearby() -> None:
    before = vi.find_orbit(paper_damper("A", 1.2), vi.symmetric_orbits(paper_damper("A", 1.2))[0])
    there = paper_damper("A", 1.21)
    found = vi.find_orbit(there, before)
    assert found.states[0, :2] == pytest.approx(
        vi.symmetric_orbits(there)[0].state.position, rel=SOLVED
    )


def test_an_orbit_without_forcing_has_a_free_period() -> None:
    """x'' - 0.1 x' + x = 0 before a wall at 1: (1, -w) flies back to (1, w / R)."""
    r = 0.5
    system = oscillator(stiffness=1.0, damping=-0.1, lower=-math.inf, upper=1.0, restitution=r)
    field = np.array([[0.0, 1.0], [-1.0, 0.1]])

    def start(t: float) -> float:
        flow = expm(field * t)
        return float((flow[0, 0] - 1.0) / flow[0, 1])

    def miss(t: float) -> float:
        flow = expm(field * t)
        return float(flow[1, 0] - flow[1, 1] * start(t) - start(t) / r)

    period = brentq(miss, 3.5, 6.0, xtol=1e-14)
    orbit = vi.find_orbit(system, vi.State((0.0,), (1.0,)))
    assert orbit.converged
    assert orbit.period == pytest.approx(period, rel=SOLVED)
    assert orbit.states[0] == pytest.approx([1.0, -start(period), 0.0], rel=SOLVED, abs=SOLVED)
    # the other multiplier, along the motion, is not one of the section
    assert orbit.multipliers == pytest.approx([r**2 * math.exp(0.1 * period)], rel=SOLVED)


def test_a_repeated_orbit_is_reduced_to_the_primitive_one() -> None:
    damper = paper_damper("A", 1.2)
    once = vi.find_orbit(damper, vi.symmetric_orbits(damper)[0])
    whole = unfolded(once)
    for turns in (2, 3):
        turn = np.array([0.0, 0.0, 0.0, 0.0, 2.0 * math.pi])
        later = [whole.states + k * turn for k in range(turns)]
        guess = vi.Guess(np.vstack(later), np.tile(whole.durations, turns))
        around = solve(damper, Signature(((0, 1), (0, -1)) * turns, turns), guess)
        assert around.symbol == f"{turns}-{turns}-{turns}"
        reduced = primitive(around)
        assert reduced.symbol == "1-1-1"
        assert reduced.symmetric
        np.testing.assert_allclose(reduced.states, once.states, rtol=0.0, atol=SAME_ORBIT_RELATIVE)


def test_an_orbit_is_not_mistaken_for_the_shorter_one_it_doubles() -> None:
    """2-2-2 with unequal halves stays what it is."""
    entry = next(e for e in PERIODIC["orbit"] if e["name"] == "damper_2_2_2")
    orbit = vi.find_orbit(
        mechanism_of_entry(entry), guess_of_entry(entry), stops=impacts_of(entry["signature"]),
        cycles=2,
    )  # fmt: skip
    assert primitive(orbit).symbol == "2-2-2"


# ---- the product of the multipliers --------------------------------------------------------------


def test_the_product_of_the_multipliers_is_exact_for_every_mechanism() -> None:
    orbits = [*orbits_of_chains(), *damper_orbits()]
    assert {orbit.mechanism.degrees for orbit in orbits} == {1, 2, 3, 4, 5, 6}
    assert any(len({c for c, _ in orbit.signature.impacts}) > 1 for orbit in orbits)
    for orbit in orbits:
        sizes = np.abs(orbit.multipliers)
        # each is known to some roundings of the largest; the smallest loses most
        allowed = 1e3 * EPS * len(sizes) * sizes[0] / sizes[-1]
        assert orbit.determinant_error <= allowed, (orbit, orbit.determinant_error, allowed)


def test_the_determinant_error_notices_a_wrong_multiplier() -> None:
    orbit = vi.find_orbit(coco(), vi.State((0.0,), (0.0,)))
    wrong = replace(orbit)
    wrong.__dict__["_of_solved_map"] = orbit.multipliers * (1.0 + 1e-9)
    assert wrong.determinant_error == pytest.approx(2e-9, rel=1e-3)


@pytest.mark.parametrize("speed", [1e-1, 1e-3, 1e-4, 1e-5, 1e-6])
def test_multipliers_stay_right_next_to_grazing(speed: float) -> None:
    """An orbit of given impact speed is linear in the force: A cos(phase), A sin(phase)."""
    # y' = F y + g (A cos theta): the forced response to cos and sin, flown over one period
    field, period = np.array([[0.0, 1.0], [-1.0, -0.1]]), 2.0 * math.pi
    response = np.linalg.solve(np.array([[0.0, 0.1], [-0.1, 0.0]]), np.eye(2))
    steady = np.vstack([response @ [1.0, 0.0], [[0.0, 1.0], [-1.0, 0.0]] @ (response @ [1.0, 0.0])])
    flow = expm(field * period)
    # x_p = a cos theta + b sin theta; with p = A (cos, sin)(phase) both are linear in p
    a, b = steady[0]
    at_start = np.array([[a, b], [b, -a]])  # (x_p, v_p) = at_start @ (p_cos, p_sin)
    before, after = np.array([1.0, speed]), np.array([1.0, -0.8 * speed])
    p = np.linalg.solve((np.eye(2) - flow) @ at_start, before - flow @ after)
    amplitude, phase = math.hypot(*p), math.atan2(p[1], p[0])
    guess = vi.Guess(np.array([[1.0, -0.8 * speed, phase]]), np.array([period]))
    orbit = vi.find_orbit(coco(amplitude), guess, stops=["A"], cycles=1)
    assert orbit.converged
    assert orbit.least_impact_speed == pytest.approx(speed, rel=1e3 * EPS / speed)
    exact = 0.64 * math.exp(-0.1 * period)
    # the speed is known to EPS / speed of itself, and one multiplier with it
    assert orbit.determinant_error <= 1e3 * EPS / speed
    assert np.prod(orbit.multipliers).real == pytest.approx(exact, rel=1e3 * EPS / speed)
    assert np.all(np.isfinite(orbit.multipliers))
    # the saltation matrix: (1 + R) |x''| / speed times the flow of velocity to place; x'' = -1 at
    # grazing, and what is left of the trace is of order one
    leading = 1.8 * abs(flow[0, 1]) / speed
    assert abs(np.sum(orbit.multipliers).real) == pytest.approx(leading, abs=3.0)


@pytest.mark.parametrize("entry", PERIODIC["grazing"], ids=lambda e: e["omega"])
def test_the_orbit_that_touches_the_wall_has_no_clearance(entry: dict[str, Any]) -> None:
    """At the grazing amplitude the steady motion solves the equations with no impact speed."""
    omega, amplitude = float(entry["omega"]), float(entry["amplitude"])
    phase = math.atan2(0.1 * omega, 1.0 - omega**2)
    guess = vi.Guess(np.array([[1.0, 0.0, phase]]), np.array([2.0 * math.pi / omega]))
    orbit = vi.find_orbit(coco(amplitude, omega), guess, stops=["A"], cycles=1)
    assert orbit.least_impact_speed <= 1e-6  # a double root: half the digits


# ---- misuse and failure --------------------------------------------------------------------------

GUESS = vi.Guess(np.array([[1.0, -1.3, 0.1]]), np.array([6.3]))


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"stops": ["A"], "cycles": 0}, "cycles = 0: must be at least 1"),
        ({"stops": ["C"], "cycles": 1}, '"A", "B"'),
        ({"stops": ["B"], "cycles": 1}, "no stop on side -1"),
        ({"stops": [(1, 1)], "cycles": 1}, "is not a stop"),
        ({"stops": [], "cycles": 1}, "must be an Orbit, Run or State"),
        ({"stops": ["A", "A"], "cycles": 1}, "expected \\(2, 3\\)"),
        ({"stops": ["A"], "cycles": 1, "symmetric": True}, "not symmetric"),
        ({"cycles": 1}, "stops = None"),
    ],
)
def test_a_contradictory_signature_is_refused(wanted: dict[str, Any], message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.find_orbit(coco(), GUESS, **wanted)


def test_symmetry_is_refused_where_the_system_or_the_cycles_have_none() -> None:
    damper = paper_damper("A", 1.2)
    two = vi.Guess(np.zeros((2, 5)), np.ones(2))
    with pytest.raises(vi.InvalidParameterError, match="does not change sign"):
        vi.find_orbit(damper, two, stops=["A", "B"], cycles=2, symmetric=True)
    lopsided = replace(
        damper.mechanism, elements=(replace(damper.mechanism.elements[0], upper=4.0),)
    )
    with pytest.raises(vi.InvalidParameterError, match="mirror images"):
        vi.find_orbit(lopsided, two, stops=["A", "B"], cycles=1, symmetric=True)


def test_cycles_over_which_the_force_does_not_repeat_are_refused() -> None:
    lines = (vi.Harmonic(1.0, (1.0,)), vi.Harmonic(1.5, (0.3,)))
    system = replace(coco(), forces=lines)
    with pytest.raises(vi.InvalidParameterError, match="not periodic"):
        vi.find_orbit(system, GUESS, stops=["A"], cycles=1)


def test_a_guess_that_leads_nowhere_is_a_status() -> None:
    """A wall out of reach: the steady motion has amplitude 0.1 / 0.1 = 1 < 2."""
    far = replace(coco(0.1), elements=(vi.RigidStop((1.0,), upper=2.0, restitution=0.8),))
    orbit = vi.find_orbit(far, GUESS, stops=["A"], cycles=1)
    assert not orbit.converged
    assert "no convergence" in orbit.status
    assert not orbit.stable
    assert orbit.status in repr(orbit)


def test_a_motion_without_a_loop_is_a_status() -> None:
    far = replace(coco(0.1), elements=(vi.RigidStop((1.0,), upper=2.0, restitution=0.8),))
    orbit = vi.find_orbit(far, vi.State((0.0,), (0.0,)), stops="A")
    assert not orbit.converged
    assert "no loop" in orbit.status


def test_random_mechanisms_with_two_sided_contacts_give_consistent_orbits() -> None:
    """What find_orbit returns from any run solves the equations or says that it does not."""
    for seed in range(12):
        m = random_mechanism(np.random.default_rng([7, seed]), 1 + seed % 3, contacts=1)
        start = vi.State((0.0,) * m.degrees, (0.3,) * m.degrees)
        run = vi.simulate(m, start, impacts=30)
        stops = {"?AB"[s] for s in run.side[run.status == vi.Status.IMPACT]}
        if stops != {"A", "B"}:
            continue
        orbit = vi.find_orbit(m, run, stops=["A", "B"], cycles=1)
        assert orbit.converged == (orbit.residual < 1e-9)


@pytest.mark.filterwarnings("error")
def test_a_coordinate_at_rest_does_not_hide_how_far_a_loop_is_from_its_image() -> None:
    """The second mass never moves: 0 / 0 of it was NaN, which passed for a mirror image."""
    pair = vi.Mechanism(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=np.eye(2),
        forces=(vi.Harmonic(1.0, (1.0, 0.0)),),
        elements=(vi.RigidStop((1.0, 0.0), -1.0, 1.0, 0.7),),
    )  # fmt: skip
    orbit = vi.find_orbit(pair, vi.State((0.0, 0.0), (0.5, 0.0)), symmetric=False)
    assert orbit.symbol == "1-1-1"
    assert not orbit.states[:, [1, 3]].any()
    loop = Guess(orbit.states, orbit.durations)
    assert nearest_symmetry(pair, orbit.signature, loop)[0] < 1e-9
    loop.states[0, 2] *= 1.5
    assert nearest_symmetry(pair, orbit.signature, loop)[0] == pytest.approx(1.0 / 3.0)
