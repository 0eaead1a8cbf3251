"""Contacts at rest on their stops: what holds them and releases them, whatever the units."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support import UNIT

import vibroimpact as vi

Status = vi.Status
SCALES = [1.0, 0.001, 0.1, 0.3, 3.0, 7.1, 1e-6, 1e3]


def names(run: vi.Run) -> list[str]:
    return [Status(int(s)).name for s in run.status]


def block(q: float, length: float = 1.0) -> vi.Mechanism:
    """A block of mass q that friction of level q holds on a plastic stop at the start."""
    return vi.Mechanism(
        mass=[[q]], damping=[[0.0]], stiffness=[[0.7 * q]],
        forces=(vi.Harmonic(1.0, (3.0 * q * length,)),), constant_force=(-0.9 * q * length,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.0),
                  vi.Friction((1.0,), kinetic=q * length)),
    )  # fmt: skip


@pytest.mark.parametrize("q", SCALES)
@pytest.mark.parametrize("length", [1.0, 1e-3, 0.7])
def test_a_block_that_breaks_away_from_its_stop_does_not_strike_it(q: float, length: float) -> None:
    run = vi.simulate(block(q, length), vi.State((0.0,), (0.0,)), t_max=4.0)
    # it breaks away where 3 sin t = 0.9 + 1; at rest above there it slips back
    assert names(run) == ["CHANGE", "CHANGE", "HORIZON"]
    assert run.time[0] == pytest.approx(math.asin(1.9 / 3.0), abs=16 * UNIT)
    assert abs(run.position[0, 0]) <= 16 * UNIT * length


def held_machine(seed: int, mass: float, length: float) -> tuple[vi.Mechanism, vi.State]:
    """One to three masses, each at rest on a plastic stop and held by friction, in some units."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    masses, springs = rng.uniform(0.3, 3.0, n), rng.uniform(0.2, 1.0, n)
    levels, loads = rng.uniform(0.3, 1.5, n), rng.uniform(-1.0, 0.2, n)
    force, size = rng.normal(size=n), mass * length
    unit = np.eye(n)
    stops = [vi.RigidStop(tuple(unit[i]), lower=0.0, restitution=0.0) for i in range(n)]
    frictions = [vi.Friction(tuple(unit[i]), kinetic=float(size * levels[i])) for i in range(n)]
    m = vi.Mechanism(
        mass=mass * np.diag(masses), damping=np.zeros((n, n)), stiffness=mass * np.diag(springs),
        forces=(vi.Harmonic(1.0, tuple(3.0 * size * force)),),
        constant_force=tuple(size * loads), elements=(*stops, *frictions),
    )  # fmt: skip
    return m, vi.State((0.0,) * n, (0.0,) * n)


@pytest.mark.parametrize(
    ("first", "last"),
    [
        (0, 12),
        pytest.param(12, 60, marks=pytest.mark.slow),
    ],
)
@pytest.mark.slow
def test_random_blocks_leave_their_stops_alike_in_all_units_of_force(first: int, last: int) -> None:
    for seed in range(first, last):
        runs = []
        for mass, length in ((1.0, 1.0), (1e-3, 1.0), (7.1, 1.0)):
            m, start = held_machine(seed, mass, length)
            runs.append(vi.simulate(m, start, t_max=9.0))
        rates = [run.rate_before[run.status == Status.IMPACT] for run in runs]
        # a blow has a speed of the size of forces by masses
        assert all(
            np.all(np.abs(r) > 1e-6 * s) for r, s in zip(rates, (1.0, 1.0, 1.0), strict=True)
        )
        for run in runs[1:]:
            assert names(run) == names(runs[0]), seed
            assert list(run.contact) == list(runs[0].contact), seed
            np.testing.assert_allclose(run.time, runs[0].time, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("time", [1.0, 2.0, 0.5, 1e-3, 1e3, 0.37, 3.0, 7.1, 1e-6])
@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_a_mass_thrown_on_a_wall_where_its_spring_is_slack_sticks_there(
    time: float, damping: float
) -> None:
    for length in (1.0, 1e-3, 0.7, 3.3):
        m = vi.Mechanism(
            mass=[[1.0]], damping=[[damping / time]], stiffness=[[1.0 / time**2]],
            elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.0),),
        )  # fmt: skip
        run = vi.simulate(m, vi.State((length,), (0.0,)), t_max=40.0 * time)
        assert names(run) == ["IMPACT", "STICK", "HORIZON"]


def test_of_contacts_that_are_met_at_once_the_first_is_named() -> None:
    """Two equal balls fall from one height on floors of their own; either may have the lower number."""
    for height in np.random.default_rng(1).uniform(0.5, 2.0, 100):
        for order in ((0, 1), (1, 0)):
            m = vi.Mechanism(
                mass=np.diag([1.0, 3.0]), damping=np.zeros((2, 2)), stiffness=np.zeros((2, 2)),
                constant_force=(-1.1, -3.3),
                elements=tuple(vi.RigidStop(tuple(np.eye(2)[i]), lower=0.0, restitution=0.7)
                               for i in order),
            )  # fmt: skip
            run = vi.simulate(m, vi.State((height, height), (0.0, 0.0)), impacts=1)
            assert (names(run), run.contact[0]) == (["SIMULTANEOUS"], 0)


# ---- frictions on the same line -----------------------------------------------------------------------------


def on_one_line(frictions: list[vi.Friction], seed: int) -> tuple[vi.Mechanism, vi.State]:
    rng = np.random.default_rng(seed)
    n = len(frictions[0].row)
    a, b = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    m = vi.Mechanism(
        mass=a @ a.T + n * np.eye(n), damping=0.05 * (b @ b.T), stiffness=b @ b.T + 0.3 * np.eye(n),
        forces=(vi.Harmonic(1.1, tuple(2.0 * rng.normal(size=n)), tuple(rng.normal(size=n))),),
        elements=tuple(frictions),
    )  # fmt: skip
    return m, vi.State(tuple(0.5 * rng.normal(size=n)), tuple(rng.normal(size=n)))


@pytest.mark.parametrize("seed", range(40))
def test_frictions_on_one_line_are_one_with_the_sum_of_levels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    row, count = rng.normal(size=n), int(rng.integers(2, 4))
    factors = [1.0, *rng.normal(size=count - 1)]
    if seed == 0:
        row, factors = np.array([1.0]), [-0.603, 0.164]
    levels, speed = rng.uniform(0.1, 1.0, len(factors)), float(rng.choice([0.0, 0.3]))
    excess = float(rng.choice([1.0, 1.3]))
    parts = [
        vi.Friction(
            tuple(c * row), kinetic=float(f), static=float(excess * f), belt_speed=c * speed
        )
        for c, f in zip(factors, levels, strict=True)
    ]
    total = float(np.abs(factors) @ levels)
    whole = vi.Friction(tuple(row), kinetic=total, static=excess * total, belt_speed=speed)
    runs = [vi.simulate(*on_one_line(f, seed), t_max=20.0) for f in (parts, [whole])]
    assert names(runs[0]) == names(runs[1])
    # roundings of forces and, through chaotic times of slip, what they grow to: some 1e4
    np.testing.assert_allclose(runs[0].time, runs[1].time, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(runs[0].position, runs[1].position, rtol=0.0, atol=1e-11)


def test_frictions_on_one_line_carry_their_parts_of_what_holds_it() -> None:
    rows, levels = (1.0, -0.5), (0.3, 0.8)
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        elements=tuple(vi.Friction((r,), kinetic=f) for r, f in zip(rows, levels, strict=True)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.6,), (0.0,)), t_max=1.0)  # 0.6 < 0.3 + 0.5 * 0.8
    forces = np.asarray(run.forces(np.array([0.5])))[0]
    part = 0.6 / 0.7  # of its level, each
    np.testing.assert_allclose(forces, [0.3 * part, -0.8 * part], rtol=16 * UNIT)


def test_frictions_on_nearly_the_same_line_are_named() -> None:
    rows = (1.0, 1.0), (1.0, 1.0 + 1e-7)
    m = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.eye(2),
        elements=tuple(vi.Friction(row, kinetic=0.1) for row in rows),
    )  # fmt: skip
    with pytest.raises(vi.InvalidParameterError, match=r"elements\[0\] and elements\[1\]"):
        vi.simulate(m, vi.State((1.0, 0.0), (0.0, 0.0)), t_max=1.0)


@pytest.mark.parametrize("mass", [0.45, 1.0, 2.0])
def test_a_mass_that_friction_held_on_a_stop_is_pressed_on_it_again(mass: float) -> None:
    """The force N on the mass is known: rest on the stop ends where N = -level, and begins there again."""
    constant, sine, cosine, omega, phase, level = -0.79, 0.047, -0.573, 0.319, 1.744, 0.226
    m = vi.Mechanism(
        mass=[[mass]], damping=[[0.0]], stiffness=[[0.47]], constant_force=(constant,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.5), vi.Friction((1.0,), level)),
        forces=(vi.Harmonic(omega, (sine,), (cosine,)),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (0.0,), phase), t_max=6.0)
    assert run.end is vi.RunEnd.HORIZON
    size, lag = math.hypot(sine, cosine), math.atan2(cosine, sine)
    turn = math.asin((-level - constant) / size)  # constant + size sin(theta + lag) = -level
    leaves, returns = (
        ((angle - phase - lag) % (2.0 * math.pi)) / omega for angle in (turn, math.pi - turn)
    )
    assert run.time[run.status == vi.Status.RELEASE] == pytest.approx([leaves], rel=1e-11)
    assert run.time[run.status == vi.Status.STICK] == pytest.approx([0.0, returns], rel=1e-11)
    assert np.all(run.position == 0.0)
