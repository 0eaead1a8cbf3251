"""Bodies that touch: rest without force, impacts that move several, and nothing at what departs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls
from support import UNIT

import vibroimpact as vi

IMPACTS = (vi.Status.IMPACT, vi.Status.SIMULTANEOUS)


def links(n: int) -> list[tuple[float, ...]]:
    """Rows of the gaps between neighbours in a chain."""
    return [tuple(float(j == i + 1) - float(j == i) for j in range(n)) for i in range(n - 1)]


def chain(
    masses: list[float],
    rates: list[float],
    restitution: float | list[float],
    forces: tuple[vi.Harmonic, ...] = (),
) -> vi.Mechanism:
    """Pendula side by side: masses on springs to the ground, with these natural frequencies."""
    n = len(masses)
    bounce = np.broadcast_to(restitution, n - 1)
    return vi.Mechanism(
        mass=np.diag(masses),
        damping=np.zeros((n, n)),
        stiffness=np.diag([m * w * w for m, w in zip(masses, rates, strict=True)]),
        forces=forces,
        elements=tuple(
            vi.RigidStop(row, lower=0.0, restitution=float(r))
            for row, r in zip(links(n), bounce, strict=True)
        ),
    )


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("masses", [[1.0, 1.0], [1.0, 2.0], [1.0, 0.3, 7.0], [0.01, 1.0]])
@pytest.mark.parametrize("rate", [1.0, math.sqrt(1.7)])
def test_pendula_of_one_frequency_that_swing_together_touch_for_ever(
    masses: list[float], rate: float, restitution: float
) -> None:
    n = len(masses)
    m = chain(masses, [rate] * n, restitution)
    run = vi.simulate(m, vi.State((0.0,) * n, (1.0,) * n), impacts=5, t_max=50.0)
    assert [vi.Status(s) for s in run.status] == [vi.Status.STICK, vi.Status.HORIZON]
    t = np.linspace(0.0, 50.0, 40)
    # 50 w radians, each frequency off by its last digits
    np.testing.assert_allclose(
        run.at(t)[0], np.sin(rate * t)[:, None] / rate * np.ones(n), atol=200.0 * 16.0 * UNIT
    )


def test_pendula_shaken_alike_touch_for_ever() -> None:
    for masses in ([1.0, 1.0], [1.0, 2.0], [0.2, 1.0, 3.0]):
        n = len(masses)
        shaken = vi.Harmonic(1.7, tuple(0.3 * m for m in masses), tuple(0.2 * m for m in masses))
        m = chain(masses, [1.0] * n, 0.5, (shaken,))
        run = vi.simulate(m, vi.State((0.0,) * n, (0.0,) * n), impacts=5, t_max=40.0)
        assert [vi.Status(s) for s in run.status] == [vi.Status.STICK, vi.Status.HORIZON]


@pytest.mark.parametrize("apart", range(0, 400, 20))
def test_pendula_whose_frequencies_differ_by_rounding_open_once_if_they_do(apart: int) -> None:
    """What is pulled open by more than the margin of a tie does not tie again."""
    for masses in ([1.0, 1.0], [1.0, 2.0]):
        m = chain(masses, [1.0, 1.0 + apart * UNIT], 0.5)
        run = vi.simulate(m, vi.State((0.0, 0.0), (1.0, 1.0)), impacts=50, t_max=20.0)
        assert run.end is vi.RunEnd.HORIZON
        again = (run.status[:-1] == vi.Status.RELEASE) & (run.status[1:] == vi.Status.STICK)
        assert not (again & (np.diff(run.time) < 1e-6)).any()


def test_pendula_that_collide_plastically_swing_on_together() -> None:
    m = chain([1.0, 1.0], [1.0, 1.0], 0.0)
    run = vi.simulate(m, vi.State((0.0, 0.5), (1.0, 0.0)), impacts=5, t_max=20.0)
    assert [vi.Status(s) for s in run.status] == [
        vi.Status.IMPACT, vi.Status.STICK, vi.Status.HORIZON,
    ]  # fmt: skip
    # the centre of mass has never left its own oscillation
    assert run.position[-1].mean() == pytest.approx(
        0.5 * math.sin(20.0) + 0.25 * math.cos(20.0), abs=64.0 * UNIT * 20.0
    )


@pytest.mark.parametrize("n", range(2, 9))
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_newtons_cradle_loses_energy_at_impacts_alone(n: int, restitution: float) -> None:
    m = chain([1.0] * n, [1.0] * n, restitution)
    run = vi.simulate(m, vi.State((0.0,) * n, (1.0,) + (0.0,) * (n - 1)), impacts=9, t_max=25.0)
    audit(m, run)
    energy = 0.5 * np.sum(run.position**2 + run.velocity_after**2, axis=1)
    if restitution == 1.0:
        np.testing.assert_allclose(energy, 0.5, rtol=1e-13)
    if restitution == 0.0:
        assert run.velocity_after[0] == pytest.approx(np.full(n, 1.0 / n), abs=16.0 * UNIT)


def test_a_contact_that_departs_takes_no_part() -> None:
    for masses in ([1.0, 1.0, 1.0], [1.0, 0.01, 1.0]):
        m = chain(masses, [1.0] * 3, 1.0)
        run = vi.simulate(m, vi.State((0.0,) * 3, (1.0, 0.0, 0.0)), impacts=1, t_max=1.0)
        share = 2.0 / (1.0 + sum(masses[1:]))  # the others move as one
        assert run.status[0] == vi.Status.SIMULTANEOUS
        assert run.velocity_after[0] == pytest.approx([1.0 - share * sum(masses[1:]), share, share])
        on = vi.simulate(m, run.last, impacts=1, t_max=1.0)
        assert [vi.Status(s) for s in on.status] == [vi.Status.STICK, vi.Status.HORIZON]
        assert set(on.contact) == {1, -1}


@pytest.mark.parametrize("seed", range(20))
def test_a_body_struck_to_the_speed_of_the_next_one_goes_on_with_it(seed: int) -> None:
    """Body 2 gets (1 + R) m1 / (m1 + m2) of the speed of 1, which is what 3 has."""
    rng = np.random.default_rng(seed)
    masses, bounce = [*rng.uniform(0.2, 3.0, 3)], float(rng.uniform(0.1, 0.9))
    speed = float(rng.uniform(0.5, 2.0))
    next_one = (1.0 + bounce) * masses[0] / (masses[0] + masses[1]) * speed
    m = chain(masses, [0.0] * 3, [bounce, 0.5])
    run = vi.simulate(m, vi.State((0.0,) * 3, (speed, 0.0, next_one)), impacts=5, t_max=10.0)
    assert [(vi.Status(s), c) for s, c in zip(run.status, run.contact, strict=True)] == [
        (vi.Status.IMPACT, 0), (vi.Status.STICK, 1), (vi.Status.HORIZON, -1),
    ]  # fmt: skip
    assert run.velocity_after[-1, 1:] == pytest.approx([next_one] * 2, rel=16.0 * UNIT)


def test_inelastic_collapse_ends_in_rest() -> None:
    """Three balls at e below 7 - 4 sqrt(3) meet infinitely often, and stay together."""
    m = chain([1.0] * 3, [0.0] * 3, 0.07)
    for start in ((0.0, 1.0, 2.0), (0.0, 1.0, 2.5), (0.3, 1.0, 1.7), (0.0, 0.0, 0.0)):
        for drift in (0.0, 1.0):
            state = vi.State(start, (1.0 + drift, drift, drift - 0.9))
            run = vi.simulate(m, state, impacts=2000, t_max=20.0)
            audit(m, run)
            assert run.end is vi.RunEnd.HORIZON
            assert vi.Status.GRAZING not in run.status
            assert (run.velocity_after @ np.ones(3)) / 3 == pytest.approx(
                np.full(len(run), drift + 0.1 / 3), abs=64.0 * UNIT
            )


def test_masses_at_rest_against_each_other_begin_without_an_impact() -> None:
    """Of random velocities along the stops, as a user computes them: rounding is no approach."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(2, 5))
        half, spring = rng.normal(size=(2, n, n))
        row, v = rng.normal(size=(2, n))
        x = rng.normal(size=n)
        x, v = x - row * (row @ x - 0.3) / (row @ row), v - row * (row @ v) / (row @ row)
        m = vi.Mechanism(
            mass=half @ half.T + 0.5 * np.eye(n),
            damping=0.05 * np.eye(n) if seed % 2 else np.zeros((n, n)),
            stiffness=spring @ spring.T + 0.3 * np.eye(n),
            elements=(vi.RigidStop(tuple(row), lower=0.3, restitution=0.7),),
        )
        run = vi.simulate(m, vi.State(tuple(x), tuple(v)), impacts=1, t_max=3.0)
        at_once = [vi.Status(s) for s in run.status[run.time < 1e-9]]
        assert at_once in ([], [vi.Status.STICK]), seed


def pulled_apart(
    masses: list[float], bounce: list[float], pull: float, gap: float, shift: float
) -> vi.Run:
    """A chain whose first body is pulled off the others, which its first contact keeps plastically;
    the last body strikes them all at speed 1."""
    n = len(masses)
    m = replace(
        chain(masses, [0.0] * n, bounce), constant_force=(-pull * masses[0],) + (0.0,) * (n - 1)
    )
    x = shift + np.array([0.0, *(gap * np.arange(1, n - 1)), gap * (n - 2) + 1e-4])
    return vi.simulate(m, vi.State(tuple(x), (0.0,) * (n - 1) + (-1.0,)), impacts=3000, t_max=0.01)


@pytest.mark.parametrize("shift", [0.0, 1.0, -3.0, 100.0])
@pytest.mark.parametrize("gap", [1e-5, 1e-7, 1e-9, 1e-12, 0.0])
def test_a_plastic_contact_that_alternates_with_its_neighbour_ends_at_rest(
    gap: float, shift: float
) -> None:
    """Gaps are squared each time, and a part of the approach is lost: in the end all of it."""
    masses, pull = [3.0, 0.2, 5.0], 1.0
    run = pulled_apart(masses, [0.0, 0.5], pull, gap, shift)
    last = np.flatnonzero(run.impacts)[-1]
    assert run.status[last] == vi.Status.SIMULTANEOUS
    together = -(masses[2] + pull * masses[0] * run.time[last]) / sum(masses)
    assert run.velocity_after[last] == pytest.approx(np.full(3, together), abs=64.0 * UNIT)
    assert run.end is vi.RunEnd.HORIZON


@pytest.mark.parametrize("seed", range(40))
def test_impacts_that_alternate_do_not_depend_on_a_shift(seed: int) -> None:
    rng = np.random.default_rng(seed)
    masses = [*10.0 ** rng.uniform(-1.0, 1.0, 3)]
    bounce, pull = [0.0, float(rng.uniform(0.05, 0.95))], float(rng.uniform(0.3, 3.0))
    after = []
    for gap in (0.0, 1e-8, 1e-11):
        for shift in (0.0, 1.0, -3.0, 100.0):
            run = pulled_apart(masses, bounce, pull, gap, shift)
            assert run.end is vi.RunEnd.HORIZON
            after.append(run.velocity_after[-1])
    # 1e-8 later or earlier, at speeds and forces of order one
    np.testing.assert_allclose(after, np.broadcast_to(after[0], (len(after), 3)), atol=1e-5)


def drawn(seed: int) -> tuple[vi.Mechanism, vi.State]:
    """A random chain of two to six bodies that touch or nearly do."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    mass = 10.0 ** rng.uniform(-2, 1, n) if rng.random() < 0.6 else np.ones(n)
    floor = bool(rng.random() < 0.4)
    rows = [tuple(float(j == 0) for j in range(n))] * floor + links(n)
    alike, between = rng.uniform(0.5, 2.0) ** 2, np.array(links(n))
    stiffness = (
        np.zeros((n, n)), np.diag(mass * alike), np.diag(mass * rng.uniform(0.2, 4.0, n)),
        np.diag(mass * alike) + 0.3 * between.T @ between,
    )[rng.integers(4)]  # fmt: skip
    gravity = rng.uniform(0.5, 2.0) * (rng.random() < 0.4)
    bounce = rng.choice([0.0, 1.0, 0.5, 0.05, rng.random()], len(rows))
    gaps = rng.choice([0.0, 0.0, 0.0, 1e-15, 1e-12, 0.3], len(rows))
    x = gaps[0] * floor + np.concatenate([[0.0], np.cumsum(gaps[-(n - 1) :])])
    v = rng.choice([0.0, 1.0, -1.0, rng.normal()], n)
    m = vi.Mechanism(
        mass=np.diag(mass),
        damping=np.zeros((n, n)),
        stiffness=stiffness,
        constant_force=tuple(-gravity * mass),
        elements=tuple(
            vi.RigidStop(row, lower=0.0, restitution=float(r))
            for row, r in zip(rows, bounce, strict=True)
        ),
    )
    return m, vi.State(tuple(x), tuple(v))


def audit(m: vi.Mechanism, run: vi.Run) -> None:
    """Check that velocities jump at impacts alone, along gaps that touch, by Moreau's law."""
    mass, rows = np.array(m.mass), np.array([c.row for c in m.rigid_stops])
    bounce = np.array([c.restitutions[0] for c in m.rigid_stops])
    fastest = float(np.abs(run.velocity_before).max()) + float(np.abs(run.start.velocity).max())
    size = fastest + float(np.abs(run.position).max())
    ratio = mass.diagonal().max() / mass.diagonal().min()
    # coordinates are scaled by roots of masses; some hundred roundings between two events
    small = 1e-13 * size * math.sqrt(ratio) * 10.0
    before, time = np.array(run.start.velocity), 0.0
    for i, what in enumerate(run.status):
        arrived, after = run.velocity_before[i], run.velocity_after[i]
        if what == vi.Status.CHATTER:
            before, time = after, run.time[i]
            continue
        if run.time[i] == time:
            assert arrived == pytest.approx(before, abs=small)
        assert (rows @ run.position[i]).min() >= -1e-12 * max(size, 1.0)
        if what in IMPACTS:
            impulse, miss = nnls(rows.T, mass @ (after - arrived))
            assert miss <= 1e-9 * fastest * mass.max()
            gained = 0.5 * (after @ mass @ after - arrived @ mass @ arrived)
            assert gained <= 1e-12 * fastest**2 * mass.max()
            struck = impulse > 1e-10 * fastest * mass.diagonal().min()
            assert (rows @ run.position[i])[struck] == pytest.approx(0.0, abs=1e-12 * size)
            kept = rows @ after + bounce * (rows @ arrived)
            if not (bounce[struck] == 0.0).any():  # else impacts may have alternated with it
                assert kept[struck] == pytest.approx(0.0, abs=1e-9 * fastest)
            assert np.sum(struck) < 2 or what == vi.Status.SIMULTANEOUS
        else:
            assert after == pytest.approx(arrived, abs=small)
        if what in (vi.Status.GRAZING, vi.Status.STICK):
            assert (rows @ arrived)[run.contact[i]] <= 1e-7 * fastest
        before, time = after, run.time[i]


@pytest.mark.parametrize("seed", range(0, 120, 20))
@pytest.mark.one_in(3)
def test_chains_of_touching_bodies_jump_at_impacts_alone(seed: int) -> None:
    for one in range(seed, seed + 20):
        m, state = drawn(one)
        run = vi.simulate(m, state, impacts=600, t_max=10.0)
        audit(m, run)
        assert run.end in (vi.RunEnd.HORIZON, vi.RunEnd.IMPACTS, vi.RunEnd.SILENT), one


def test_an_alternation_that_stops_by_itself_leaves_what_its_last_impact_gave() -> None:
    """Masses 1, 1, 1 with R = (0, 0.8), pulled apart: c^2 = 1 / 4, and c^2 (1 + R) < R.

    The first impact leaves (1/2, 1/2, 0); the second, of closing rate 1/2, drives 2 away from 3 at
    0.4; the first contact closes at 0.45 once more, and its plastic impact leaves 0.175 between 2
    and 3. However small the gap is, the rebound is that of a gap that is plain to see.
    """
    rows = ((-1.0, 1.0, 0.0), (0.0, -1.0, 1.0))
    ends = []
    for gap in (0.0, 1e-16, 1e-13, 1e-9):
        m = vi.Mechanism(
            mass=np.eye(3).tolist(), damping=np.zeros((3, 3)).tolist(),
            stiffness=np.zeros((3, 3)).tolist(), constant_force=(-1.0, 0.0, 1.0),
            elements=tuple(
                vi.RigidStop(row, lower=0.0, restitution=r)
                for row, r in zip(rows, (0.0, 0.8), strict=True)
            ),
        )  # fmt: skip
        run = vi.simulate(m, vi.State((0.0, 0.0, gap), (1.0, 0.0, 0.0)), t_max=1e-6)
        ends.append(run.velocity_after[-1])
    expected = np.array([0.275, 0.275, 0.45])  # of the last, 1e-6 later, 1e-6 of force
    np.testing.assert_allclose(ends, [expected] * 4, atol=3e-6)


def test_bodies_that_touch_without_force_stay_so_until_there_is_an_event() -> None:
    """Two free masses that drift together for 10^6 units of time to a wall: one STICK before it."""
    m = vi.Mechanism(
        mass=np.eye(2).tolist(), damping=np.zeros((2, 2)).tolist(),
        stiffness=np.zeros((2, 2)).tolist(),
        elements=(
            vi.RigidStop((-1.0, 1.0), lower=0.0, restitution=0.5),
            vi.RigidStop((0.0, 1.0), upper=1e6, restitution=0.5),
        ),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (1.0, 1.0)), impacts=1)
    assert [vi.Status(s).name for s in run.status[:-1]] == ["STICK"]
    assert run.time[-1] == pytest.approx(1e6, rel=1e-12)
