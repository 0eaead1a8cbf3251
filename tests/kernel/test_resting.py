"""Several contacts at rest on bodies that share inertia: which stay closed, which open."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import nnls
from support.members import Case
from support.members import run as members
from support.systems import heavy

import vibroimpact as vi
from vibroimpact.compile.hybrid import _compiled
from vibroimpact.sweeps.execution.batch import batch_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

OMEGA, LIFT = 1.3, (0.2, 1.5)  # of the force; its amplitudes


def pressed() -> vi.Mechanism:
    """Two masses that a weight presses on two stops; the full mass matrix couples them."""
    return vi.Mechanism(
        mass=[[1.0, 0.35], [0.35, 0.8]],
        damping=[[0.05, -0.02], [-0.02, 0.04]],
        stiffness=[[1.5, -0.4], [-0.4, 0.9]],
        forces=(vi.Harmonic(OMEGA, LIFT),),
        constant_force=(-1.1, -0.9),
        elements=tuple(vi.RigidStop(row, 0.0, np.inf, 0.5) for row in ((1.0, 0.0), (0.0, 1.0))),
    )


class Constrained:
    """The same motion with Lagrange multipliers for closed contacts, by SciPy."""

    def __init__(self, m: vi.Mechanism, closed: tuple[int, ...]) -> None:
        self.m, self.closed = m, list(closed)
        n, k = m.degrees, len(closed)
        rows = np.array([m.rigid_stops[i].row for i in closed]).reshape(k, n)
        self.saddle = np.block([[np.array(m.mass), -rows.T], [rows, np.zeros((k, k))]])

    def solve(self, t: float, z: NDArray[Any]) -> NDArray[Any]:
        """Accelerations, then forces of the closed contacts."""
        x, v = np.split(z, 2)
        force = np.array(self.m.constant_force) - np.array(self.m.stiffness) @ x
        force = force - np.array(self.m.damping) @ v + np.array(LIFT) * np.sin(OMEGA * t)
        return np.linalg.solve(self.saddle, np.concatenate([force, np.zeros(len(self.closed))]))

    def run(self, z: NDArray[Any], t: float, end: float, event: Any = None) -> Any:
        """The motion from t on, to the end or to where event(t, z) falls through zero."""
        if event:
            event.terminal, event.direction = True, -1.0

        def field(t: float, z: NDArray[Any]) -> NDArray[Any]:
            return np.concatenate([z[2:], self.solve(t, z)[:2]])

        options = {"rtol": 1e-12, "atol": 1e-13, "method": "DOP853"}
        found = solve_ivp(field, (t, end), z, events=event, **options)
        assert found.status == (1 if event else 0)
        return float(found.t[-1]), found.y[:, -1]


def test_a_release_beside_a_held_contact_is_where_its_force_falls_to_zero() -> None:
    m = pressed()
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=4.0)
    both, first = Constrained(m, (0, 1)), Constrained(m, (0,))
    released, z = both.run(np.zeros(4), 0.0, 50.0, lambda t, z: both.solve(t, z)[3])
    flying, z = first.run(z, released, released + 0.05)
    struck, z = first.run(z, flying, 50.0, lambda _, z: z[1])

    at = list(run.status).index(vi.Status.RELEASE)
    assert run.contact[at] == 1
    assert run.time[at] == pytest.approx(released, abs=1e-9)
    assert run.status[at + 1] == vi.Status.SIMULTANEOUS  # and not stick again; it moves both
    assert run.contact[at + 1] == 1
    assert run.time[at + 1] == pytest.approx(struck, abs=1e-9)
    assert run.velocity_before[at + 1] == pytest.approx(z[2:], abs=1e-9)


@pytest.mark.parametrize("impacts", [1, 2, 3])
def test_a_speed_off_a_stop_that_holds_is_as_good_as_what_a_plastic_impact_leaves_of_it(
    impacts: int,
) -> None:
    """In derivatives, beside impacts that move the contact held: of its rate nothing is left."""
    m = pressed()
    off = np.array([[0.0], [0.0], [1.0], [0.0], [0.0]])
    push = np.linalg.solve(np.array(m.mass), [1.0, 0.0])
    left = off.copy()
    left[2:4, 0] -= push / push[0]
    start = vi.State((0.0, 0.5), (0.0, -1.0))
    found = vi.map_derivative(m, start, impacts=impacts, directions=np.hstack([off, left])).matrix
    assert np.abs(found[:, 1]).max() > 0.01
    # some ten operations each, beside terms of order one
    assert found[:, 0] == pytest.approx(found[:, 1], rel=1e-12, abs=1e-12)


@pytest.mark.slow
def test_bodies_that_come_to_rest_together_go_on() -> None:
    """Most of them: three that chatter at once may use up their impacts (known-limits.md)."""
    through = 0
    for seed in range(60):
        mechanism, state = heavy(seed)
        run = vi.simulate(mechanism, state, impacts=20_000, t_max=60.0)
        assert run.end in (vi.RunEnd.IMPACTS, vi.RunEnd.HORIZON), seed
        through += run.end == vi.RunEnd.HORIZON
        assert np.all(run.rate_before[run.status == vi.Status.IMPACT] < 0.0), seed
        gaps = run.position[:, : len(mechanism.rigid_stops)]
        assert gaps.min() > -1e-12, seed
    assert through >= 48


DAMPED = pytest.mark.parametrize("damping", ["none", "Rayleigh", "general"])
SEEDS = range(100, 140)


def unbuilt(seed: int, damping: str) -> tuple[vi.Mechanism, vi.State]:
    """Such a system, none of whose modes was wanted yet."""
    _compiled.cache_clear()
    return heavy(seed, damping)


@DAMPED
def test_contacts_held_stay_on_their_stops_between_events(damping: str) -> None:
    """Also where others leave first, or are pulled off by an impact: the gaps of every motion are
    samples of the flights between its events, to rounding in coordinates of some ten units."""
    left = 0
    for seed in SEEDS:
        mechanism, state = unbuilt(seed, damping)
        run = vi.simulate(mechanism, state, impacts=3000, t_max=60.0)
        x, _ = run.at(np.linspace(0.0, run.time[-1], 6001))
        assert x[:, : len(mechanism.rigid_stops)].min() > -1e-11, seed
        left += len(mechanism.rigid_stops) > 2 and vi.Status.RELEASE in run.status
    assert left > 5


@DAMPED
def test_a_run_is_the_same_when_all_its_modes_were_built_before(damping: str) -> None:
    for seed in SEEDS:
        mechanism, state = unbuilt(seed, damping)
        first, again = (vi.simulate(mechanism, state, impacts=1000, t_max=60.0) for _ in range(2))
        t = np.linspace(0.0, first.time[-1], 2001)
        for one, other in zip(first.at(t), again.at(t), strict=True):
            np.testing.assert_array_equal(one, other)


@DAMPED
@pytest.mark.parametrize("seed", [6, 18, 26, 67])
def test_extremes_of_contacts_at_rest_are_their_stops(seed: int, damping: str) -> None:
    mechanism, state = heavy(seed, damping)
    found = Case(mechanism, state, 0.0, 30.0).member("extremes", "shares")
    assert found["share_at_rest"] > (0.01 if damping == "none" else 0.1)
    assert found["x_smallest"][: len(mechanism.rigid_stops)].min() > -1e-11


@DAMPED
@pytest.mark.slow
def test_members_that_come_to_rest_run_as_alone(damping: str) -> None:
    for seed in range(10):
        mechanism, _ = heavy(seed, damping)
        rng, n = np.random.default_rng(seed), mechanism.degrees
        states = [
            vi.State(tuple(abs(rng.normal(size=n)) + 0.1), tuple(rng.normal(size=n)))
            for _ in range(5)
        ]
        batch = batch_of(mechanism, {})
        together, alone = (
            [members(batch, group, 2.0, 8.0, ("final", "extremes", "lyapunov")) for group in groups]
            for groups in ([states], [[state] for state in states])
        )
        for name, values in together[0].items():
            np.testing.assert_array_equal(values, np.concatenate([one[name] for one in alone]))


def jerks_of(mass: NDArray[Any], force: NDArray[Any]) -> NDArray[Any]:
    """The rates of change of all accelerations: contact 0 stays closed, its own force is free.

    Of all motions with x_0 = 0 and x_1, x_2 >= 0 the one nearest to the free one (Gauss).
    """
    rest, free = mass[1:, 1:], np.linalg.solve(mass[1:, 1:], force[1:])
    half = np.linalg.cholesky(rest).T
    return nnls(half, half @ free)[0]


@pytest.mark.parametrize("seed", range(40))
def test_contacts_that_all_tie_are_decided_together(seed: int) -> None:
    rng = np.random.default_rng(seed)
    half, force = rng.normal(size=(3, 3)), rng.normal(size=3)
    mass = half @ half.T + 0.3 * np.eye(3)
    m = vi.Mechanism(
        mass=mass.tolist(),
        damping=np.zeros((3, 3)).tolist(),
        stiffness=(0.1 * np.eye(3)).tolist(),
        forces=(vi.Harmonic(1.0, tuple(force)),),  # zero at first, its rate is not
        constant_force=(-8.0, 0.0, 0.0),
        elements=tuple(vi.RigidStop(tuple(row), 0.0, np.inf, 0.5) for row in np.eye(3)),
    )
    run = vi.simulate(m, vi.State((0.0,) * 3, (0.0,) * 3), t_max=0.1)
    jerks = jerks_of(mass, force)
    # x = jerk t^3 / 6 up to parts of t^2, of the size of the largest jerk without contacts
    slack = 0.1**2 * np.abs(np.linalg.solve(mass, force)).max()
    x, _ = run.at(0.1)
    moved = x[1:] / (0.1**3 / 6.0)
    assert x[0] == pytest.approx(0.0, abs=1e-15)
    assert moved == pytest.approx(jerks, abs=slack)
    assert np.all((np.abs(moved) < 1e-9) == (jerks == 0.0))
    assert set(run.status) <= {vi.Status.STICK, vi.Status.HORIZON}  # decided at once


def impulses(m: vi.Mechanism, touching: list[int], v: NDArray[Any]) -> NDArray[Any]:
    """Moreau's law as a least squares problem with p >= 0, from which v+ follows."""
    rows = np.array([m.rigid_stops[i].row for i in touching])
    keep = 1.0 + np.array([m.rigid_stops[i].restitutions[0] for i in touching])
    half = np.linalg.cholesky(np.linalg.inv(np.array(m.mass))).T @ rows.T  # A = half^T half
    target = -np.linalg.lstsq(half.T, keep * (rows @ v), rcond=None)[0]
    return rows.T @ nnls(half, target)[0]


def test_an_impact_beside_contacts_at_rest_follows_moreaus_law() -> None:
    checked = 0
    for seed in range(40):
        m, state = heavy(seed)
        run = vi.simulate(m, state, impacts=300, t_max=200.0)
        for i in np.flatnonzero(np.isin(run.status, [vi.Status.IMPACT, vi.Status.SIMULTANEOUS])):
            gaps, v = run.position[i, : len(m.rigid_stops)], run.velocity_before[i]
            near = np.flatnonzero(gaps < 1e-8)
            at_rest = (gaps[near] < 1e-13) & (abs(v[near]) < 1e-13)
            if len(near) < 2 or not np.all(at_rest | (near == run.contact[i])):
                continue
            touching = near.tolist()
            after = v + np.linalg.solve(np.array(m.mass), impulses(m, touching, v))
            assert run.velocity_after[i] == pytest.approx(after, abs=1e-9), (seed, i)
            checked += 1
    assert checked > 50


def test_contacts_at_rest_that_depend_on_each_other_hold_each_other() -> None:
    """What holds the third contact of such a body is in the span of what holds the others."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        half, rows = rng.normal(size=(2, 3, 3))
        rows[2] = rng.uniform(-1.5, 1.5, 2) @ rows[:2]
        mechanism = vi.Mechanism(
            mass=(half @ half.T + 0.5 * np.eye(3)).tolist(),
            damping=np.zeros((3, 3)).tolist(),
            stiffness=np.eye(3).tolist(),
            forces=(vi.Harmonic(1.0, tuple(rng.normal(size=3))),),
            constant_force=tuple(-2.0 * rows.sum(axis=0)),
            elements=tuple(vi.RigidStop(tuple(row), 0.0, np.inf, 0.5) for row in rows),
        )
        run = vi.simulate(mechanism, vi.State((0.0,) * 3, (0.0,) * 3), impacts=3000, t_max=10.0)
        assert run.end in (vi.RunEnd.HORIZON, vi.RunEnd.IMPACTS), seed
        x, _ = run.at(np.linspace(0.0, run.time[-1], 2001))
        assert (x @ rows.T).min() > -1e-11, seed


@pytest.mark.parametrize("damping", ["none", "Rayleigh", "general"])
@pytest.mark.slow
def test_a_contact_that_follows_from_others_changes_nothing(damping: str) -> None:
    """Listed twice, or the sum of two with positive weights: its gap closes with theirs."""
    rested = through = 0
    for seed in range(20):
        m, _ = heavy(seed, damping)
        rng, n = np.random.default_rng(seed), m.degrees
        rows = np.array([c.row for c in m.rigid_stops])
        weights = rng.uniform(0.2, 2.0, len(rows)) if seed % 2 else np.eye(len(rows))[0]
        stops = [vi.RigidStop(tuple(row), 0.0, np.inf, 0.5) for row in rows]
        more = vi.RigidStop(tuple(weights @ rows), 0.0, np.inf, 0.5)
        rest = vi.State((0.0,) * n, (0.0,) * n, phase=rng.uniform(0.0, 6.0))
        alone, beside = (
            vi.simulate(replace(m, elements=tuple(some)), rest, impacts=3000, t_max=4.0)
            for some in (stops, rng.permutation([*stops, more]))
        )
        through += beside.end is alone.end is vi.RunEnd.HORIZON  # or chatter uses up impacts
        assert {beside.end, alone.end} <= {vi.RunEnd.HORIZON, vi.RunEnd.IMPACTS}, seed
        t = np.linspace(0.0, min(beside.time[-1], alone.time[-1]), 201)
        # rest after a chatter forgets; impacts between magnify roundings by some 10 each
        np.testing.assert_allclose(beside.at(t)[0], alone.at(t)[0], rtol=0.0, atol=1e-9)
        rested += vi.Status.STICK in alone.status
    assert min(rested, through) > 15
