"""The impact law: momentum, restitution and energy at every impact, one contact or several."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import UNIT
from support.systems import oscillator, paper_damper, random_mechanism

import vibroimpact as vi

RUNS = [("A", 1.2), ("A", 0.9817), ("B", 0.937), ("C", 0.4172), ("C", 0.35)]


def run_of(name: str, omega: float) -> tuple[vi.ImpactDamper, vi.Run, Any]:
    d = paper_damper(name, omega)
    run = vi.simulate(d, vi.State((0.3, 0.1), (0.2, 0.7), 0.4), impacts=2000)
    return d, run, run.status == vi.Status.IMPACT


# velocities before and after are read from the same coordinates, each a sum of six terms
def rounding(run: vi.Run) -> float:
    return 32.0 * UNIT * (1.0 + float(np.abs(run.velocity_before).max()))


@pytest.mark.parametrize(("name", "omega"), RUNS)
def test_momentum_is_kept_at_every_impact(name: str, omega: float) -> None:
    d, run, hits = run_of(name, omega)
    masses = np.array([1.0, d.mass_ratio])
    gained = (run.velocity_after - run.velocity_before)[hits] @ masses
    assert np.abs(gained).max() <= rounding(run)


@pytest.mark.parametrize(("name", "omega"), RUNS)
def test_relative_velocity_is_reversed_and_reduced(name: str, omega: float) -> None:
    d, run, hits = run_of(name, omega)
    before, after = (v[hits, 1] - v[hits, 0] for v in (run.velocity_before, run.velocity_after))
    assert np.abs(after + d.restitution * before).max() <= 2.0 * rounding(run)
    np.testing.assert_array_equal(run.rate_after[hits], -d.restitution * run.rate_before[hits])


@pytest.mark.parametrize(("name", "omega"), RUNS)
def test_recorded_rates_are_those_of_the_gap(name: str, omega: float) -> None:
    _, run, hits = run_of(name, omega)
    side = run.side[hits]
    before = -side * (run.velocity_before[hits, 1] - run.velocity_before[hits, 0])
    assert np.abs(before - run.rate_before[hits]).max() <= 4.0 * rounding(run)
    assert np.all(run.rate_before[hits] < 0.0)


@pytest.mark.parametrize(("name", "omega"), RUNS)
def test_energy_lost_is_that_of_the_effective_mass(name: str, omega: float) -> None:
    d, run, hits = run_of(name, omega)
    masses = np.array([1.0, d.mass_ratio])
    lost = 0.5 * ((run.velocity_after**2 - run.velocity_before**2)[hits] @ masses)
    m_eff = d.mass_ratio / (1.0 + d.mass_ratio)
    balance = -0.5 * (1.0 - d.restitution**2) * m_eff * run.rate_before[hits] ** 2
    fastest = float(np.abs(run.velocity_before).max())
    assert np.abs(lost - balance).max() <= 4.0 * rounding(run) * fastest


@pytest.mark.parametrize(("name", "omega"), RUNS)
def test_impacts_happen_on_the_stops(name: str, omega: float) -> None:
    d, run, hits = run_of(name, omega)
    u = (run.position[:, 1] - run.position[:, 0])[hits]
    side = run.side[hits]
    # eps_g of one flight: some 20 steps, terms below 100
    assert np.abs(u - side * d.half_clearance).max() <= 64.0 * UNIT * 100.0


def _another_touches(m: vi.Mechanism, contact: vi.RigidStop, x: np.ndarray) -> bool:
    others = [c for c in m.rigid_stops if c is not contact]
    return any(min(c.upper - np.dot(c.row, x), np.dot(c.row, x) - c.lower) < 1e-9 for c in others)


@given(
    seed=st.integers(0, 10_000), n=st.integers(1, 6), contacts=st.integers(1, 3),
)  # fmt: skip
def test_impulse_acts_along_the_contact_and_loses_the_right_energy(
    seed: int, n: int, contacts: int
) -> None:
    """v+ - v- = -(1 + R) u' M^-1 n / (n M^-1 n), where nothing rests on a stop."""
    m = random_mechanism(np.random.default_rng(seed), n, contacts=min(n, contacts))
    run = vi.simulate(m, vi.State((0.0,) * n, (1.0,) * n), impacts=20, t_max=200.0)
    mass = np.array(m.mass)
    for i in np.flatnonzero(run.status == vi.Status.IMPACT):
        contact = m.rigid_stops[run.contact[i]]
        if _another_touches(m, contact, run.position[i]):
            continue  # it takes an impulse too: tests/kernel/test_resting.py
        row, v = np.array(contact.row), run.velocity_before[i]
        push = np.linalg.solve(mass, row)
        r = contact.restitutions[1 if run.side[i] > 0 else 0]
        jump = -(1.0 + r) * (row @ v) / (row @ push) * push
        # the condition of M is below 100 here; the rest is a dozen roundings
        error = np.abs(run.velocity_after[i] - v - jump).max()
        assert error <= 100.0 * 16.0 * UNIT * (1.0 + np.abs(v).max())
        energy = [0.5 * w @ mass @ w for w in (v, run.velocity_after[i])]
        loss = 0.5 * (1.0 - r * r) * (row @ v) ** 2 / (row @ push)
        assert abs(energy[1] - energy[0] + loss) <= 100.0 * 64.0 * UNIT * (1.0 + energy[0])


def test_each_stop_has_its_own_restitution() -> None:
    m = vi.Mechanism(
        mass=[[2.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.RigidStop((1.0,), -1.0, 1.0, (0.25, 0.5)),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (1.0,)), impacts=4)
    np.testing.assert_array_equal(run.side, [1, -1, 1, -1])
    expected = [-0.5, 0.125, -0.0625, 0.015625]
    np.testing.assert_allclose(run.velocity_after[:, 0], expected, rtol=32.0 * UNIT)  # four jumps
    np.testing.assert_allclose(run.time, [1.0, 5.0, 21.0, 53.0], rtol=32.0 * UNIT)


def test_plastic_impact_ends_relative_motion_at_once() -> None:
    d = paper_damper("A", 1.2, restitution=0.0)
    run = vi.simulate(d, vi.State((0.3, 0.1), (0.2, 0.7)), impacts=50)
    hits = run.status == vi.Status.IMPACT
    v = run.velocity_after[hits]
    assert hits.sum() == 50
    assert np.abs(v[:, 1] - v[:, 0]).max() <= rounding(run)
    assert vi.Status.CHATTER not in run.status  # nothing to sum where R = 0


def test_elastic_undamped_motion_keeps_its_energy() -> None:
    m = oscillator(stiffness=1.3, damping=0.0, lower=-0.4, upper=0.7, restitution=1.0)
    run = vi.simulate(m, vi.State((0.1,), (1.0,)), impacts=10_000)
    energy = 0.5 * run.velocity_after[:, 0] ** 2 + 0.65 * run.position[:, 0] ** 2
    # one flight adds a few roundings of relative size: at worst all with the same sign
    assert np.abs(energy / energy[0] - 1.0).max() <= 10_000 * 16.0 * UNIT
