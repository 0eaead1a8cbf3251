"""Observers of periodic and chaotic motion: symbol, settling, Lyapunov exponents."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.families import CHAIN
from support.members import Case, cases, impacts_in_window
from support.systems import ball, paper_damper

import vibroimpact as vi
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.sweeps.observers import Section, Settling, Symbol

CASES = cases()


def states(record: vi.Run, at: Any, omega: float) -> tuple[Any, Any]:
    """(x, v / omega), and sine and cosine of the phase, at some events."""
    phase = record.phase[at]
    waves = np.column_stack([np.sin(phase), np.cos(phase)])
    return np.column_stack([record.position[at], record.velocity_after[at] / omega]), waves


def same(a: tuple[Any, Any], b: tuple[Any, Any], tolerance: float) -> Any:
    """Which rows agree, by the definition in ``Symbol``."""
    size = np.maximum(abs(a[0]).max(axis=1), abs(b[0]).max(axis=1))
    apart = [abs(x - y).max(axis=1) for x, y in zip(a, b, strict=True)]
    return (apart[0] <= tolerance * size) & (apart[1] <= tolerance)


def symbol_of(case: Case, record: vi.Run, tolerance: float, returns: int) -> tuple[int, ...]:
    """The definition of ``Symbol``, on the record: every K is tried."""
    omega = case.mechanism.omega
    at = np.flatnonzero(impacts_in_window(case, record))
    if not len(at):
        return 0, 0, 0
    first = tuple(part[:1] for part in states(record, at, omega))
    back = same(first, states(record, at, omega), tolerance)
    back &= (record.contact[at] == record.contact[at[0]]) & (record.side[at] == record.side[at[0]])
    for k in range(1, (len(at) - 1) // returns + 1):
        if back[k::k].all():
            part = at[1 : k + 1]
            periods = (record.time[at[k]] - record.time[at[0]]) * omega / (2.0 * math.pi)
            p, q = ((record.side[part] == side).sum() for side in (1, -1))
            return round(periods), int(p), int(q)
    return 0, 0, 0


def damper_case(omega: float, settle: float = 150.0, observe: float = 50.0, **of: float) -> Case:
    damper = paper_damper("A", omega, **of)
    unit = damper.period
    return Case(damper, vi.State((0.0, 0.0), (0.0, 1.0)), settle * unit, observe * unit)


def test_the_symbol_is_what_its_definition_says_of_the_record() -> None:
    seen = set()
    for omega in np.linspace(0.9, 1.25, 36):
        case = damper_case(float(omega))
        record = case.record()
        for tolerance, returns in ((1e-6, 2), (3e-3, 5)):
            found = case.member(Symbol(tolerance=tolerance, returns=returns))
            symbol = tuple(int(found[k]) for k in "npq")
            assert symbol == symbol_of(case, record, tolerance, returns)
            seen.add(symbol)
    assert {(0, 0, 0), (1, 1, 1), (2, 2, 2)} <= seen


def test_an_elastic_ball_repeats_itself_without_forcing_periods() -> None:
    found = Case(ball(1.0), vi.State((1.0,), (0.0,)), 1.0, 20.0).member("symbol", "impacts")
    assert [int(found[k]) for k in "npq"] == [0, 0, 1]
    fall = math.sqrt(2.0 * 1.0 / 9.8)
    struck = [t for k in range(30) if 1.0 <= (t := (2 * k + 1) * fall) <= 1.0 + 20.0]
    assert found["impacts_b"] == len(struck) / 20.0


@pytest.mark.parametrize("omega", [1.2, 1.21])
def test_settling_is_the_time_of_the_last_impact_off_the_orbit(omega: float) -> None:
    case = damper_case(omega, settle=500.0)
    record, found = case.record(), case.member(Settling(tolerance=1e-4), "symbol")
    at = np.flatnonzero(impacts_in_window(replace(case, settle=0.0), record))
    period = int(found["p"] + found["q"])
    assert period == 2
    orbit = at[len(at) - 1 - (len(at) - 1 - np.arange(len(at))) % period]
    off = ~same(states(record, orbit, omega), states(record, at, omega), 1e-4)
    off |= record.side[orbit] != record.side[at]
    assert found["settling"] == record.time[at[np.flatnonzero(off)[-1]]] > 10.0


def test_a_motion_that_starts_on_its_orbit_has_settled_at_once() -> None:
    case = damper_case(1.2, settle=1000.0)
    record = case.record()
    on_orbit = replace(case, state=record.last)
    assert on_orbit.member("settling")["settling"] == 0.0
    assert math.isnan(on_orbit.member(Settling(longest=1))["settling"])
    assert math.isnan(CASES["chaotic"].member("settling")["settling"])


# ---- Lyapunov exponents --------------------------------------------------------------------------


def test_exponents_of_a_periodic_motion_are_those_of_its_multipliers() -> None:
    case = damper_case(1.24, settle=600.0, observe=2000.0)
    orbit = vi.find_orbit(case.system, case.record().last)
    sizes = np.sort(abs(np.asarray(orbit.multipliers)))[::-1]
    wanted = np.log(sizes[sizes > 0.0]) / case.system.period
    found = case.member("spectrum", "lyapunov")
    # lengths of the tangents, and of section to whole period, differ by bounded factors
    error = 8.0 / case.observe
    np.testing.assert_allclose(found["spectrum"], wanted, rtol=0.0, atol=error)
    assert found["lyapunov"] == pytest.approx(wanted[0], abs=error)


def test_the_exponent_of_a_bouncing_ball_is_that_of_its_speeds() -> None:
    """Every impact after the first in the window shrinks a difference of speeds by R."""
    case = CASES["ball"]
    record, found = case.record(), case.member("lyapunov", "spectrum")
    times = record.time[impacts_in_window(case, record)]
    wanted = (len(times) - 1) * math.log(0.9) / (times[-1] - times[0])
    assert found["lyapunov"] == pytest.approx(wanted, rel=1e-13)
    assert found["spectrum"] == [found["lyapunov"]]


@pytest.mark.parametrize("omega", [0.933, 1.2])
def test_the_exponents_add_up_to_the_contraction_of_flights_and_impacts(omega: float) -> None:
    """Volumes shrink by exp(-2 zeta omega_n t) in flight and by R^2 in an impact."""
    case = damper_case(omega, settle=100.0, observe=1500.0)
    found = case.member("spectrum", "impacts")
    d = case.system
    rate = (found["impacts_a"] + found["impacts_b"]) / d.period
    wanted = -2.0 * d.zeta * d.omega_n + 2.0 * math.log(d.restitution) * rate
    # at both ends the section's volume enters: rates and accelerations of order 1 to 10
    assert found["spectrum"].sum() == pytest.approx(wanted, abs=8.0 / case.observe)


def test_the_largest_exponent_of_chaos_agrees_with_the_one_of_the_impact_map() -> None:
    damper, state = CASES["chaotic"].system, CASES["chaotic"].state
    wanted = vi.lyapunov_exponent(damper, state, impacts=20_000)
    assert wanted.is_positive
    unit = damper.period
    found = Case(damper, state, 500 * unit, 8_000 * unit).member("lyapunov")
    # two runs of about the same number of impacts, each within four standard errors
    assert abs(found["lyapunov"] - wanted.value) <= 4.0 * math.sqrt(2.0) * wanted.error


def test_tangents_change_no_bit_of_the_motion() -> None:
    for case in CASES.values():
        seen = ("final", Section(stop="B"), "extremes", "power")
        plain = case.member(*seen)
        for more in ("lyapunov", "spectrum"):
            found = case.member(*seen, more)
            for name, values in plain.items():
                np.testing.assert_array_equal(found[name], values)
        both = case.member("spectrum", "lyapunov")
        assert both["lyapunov"] == both["spectrum"][0] == case.member("lyapunov")["lyapunov"]


TWO_STOPS = replace(CHAIN, elements=(vi.RigidStop((1.0, 0.0, 0.0), upper=0.4, restitution=0.3),
                                     vi.RigidStop((0.0, -1.0, 1.0), -0.3, 0.2)))  # fmt: skip


@pytest.mark.parametrize(
    ("system", "over"),
    [
        (paper_damper("A", 1.0), {"omega": (0.9, 1.1), "half_clearance": (1.0, 10.0)}),
        (paper_damper("C", 0.4), {"omega": (0.3, 0.9), "restitution": (0.0, 1.0)}),
        (TWO_STOPS, {"stiffness[1][1]": (2.0, 3.0), "elements[0].upper": (0.1, 1.0)}),
    ],
)
def test_tangents_in_lanes_have_the_bits_of_tangents_alone(
    system: System, over: dict[str, tuple[float, float]]
) -> None:
    """All exponents of a member are found alone, the largest one for many members at once."""
    grid = {name: np.linspace(*ends, 14) for name, ends in over.items()}
    n = len(mechanism_of(system).mass)
    start = vi.State((0.0,) * n, (0.0,) * (n - 1) + (1.0,))

    def seen(exponents: str) -> Any:
        return vi.sweep(
            system, over=grid, start=start, observe=[exponents, "final", "shares"],
            settle_periods=20, periods=20, workers=1, progress=False,
        )  # fmt: skip

    lanes, alone = seen("lyapunov"), seen("spectrum")
    np.testing.assert_array_equal(lanes.lyapunov, alone.spectrum[..., 0])
    assert np.isfinite(lanes.lyapunov).sum() > 100
    for name in lanes.drop_vars("lyapunov"):
        np.testing.assert_array_equal(lanes[name], alone[name])


@pytest.mark.parametrize(
    ("restitution", "omega"), [(0.3, 0.35), (0.3, 0.4205), (0.5, 0.3), (0.5, 0.35), (0.5, 0.4205)]
)
def test_rest_on_a_stop_takes_two_exponents_away(restitution: float, omega: float) -> None:
    damper = paper_damper("C", omega, restitution=restitution)
    case = replace(CASES["chatter"], system=damper)
    found = case.member("spectrum", "shares")
    assert found["chatters"] > 0
    assert np.isfinite(found["spectrum"][:2]).all()
    assert np.isneginf(found["spectrum"][2:]).all()
