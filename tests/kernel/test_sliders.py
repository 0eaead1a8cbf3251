"""Friction on coordinates without mass: plastic soil, springs in series with a slider. Closed forms and SciPy."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import vibroimpact as vi
from vibroimpact.machines.toml_file import read_case

ULPS = 64 * 2.0**-53
STUCK, FORWARD, BACKWARD = (
    vi.FrictionState.STICK, vi.FrictionState.FORWARD, vi.FrictionState.BACKWARD,
)  # fmt: skip


def with_slider(
    mass: float, level: float, *elements: Any, spring: float = 0.0, k: float = 0.0, c: float = 0.0,
    belt: float = 0.0, **more: Any,
) -> vi.Mechanism:  # fmt: skip
    """A mass x and a slider z; a spring between them, and k, c between the mass and the ground."""
    return vi.Mechanism(
        mass=[[mass, 0.0], [0.0, 0.0]], damping=[[c, 0.0], [0.0, 0.0]],
        stiffness=[[k + spring, -spring], [-spring, spring]],
        elements=(*elements, vi.Friction((0.0, 1.0), level, belt_speed=belt)), **more,
    )  # fmt: skip


def test_a_blow_drives_a_pile_into_elastoplastic_soil_by_the_closed_form() -> None:
    mass, k, level, v = 2.0, 50.0, 3.0, 1.5
    stop = vi.SoftStop((1.0, -1.0), upper=0.0, stiffness=k)
    run = vi.simulate(with_slider(mass, level, stop), vi.State((-0.3, 0.0), (v, 0.0)), t_max=4.0)
    w, root = math.sqrt(k / mass), math.sqrt(k * mass)
    slips = math.sqrt(v * v - (level / root) ** 2)  # speed at which the soil yields
    lasts = [0.3 / v, math.asin(level / (v * root)) / w, mass * slips / level, math.pi / (2.0 * w)]
    np.testing.assert_allclose(run.time[:4], np.cumsum(lasts), rtol=1e2 * ULPS)
    assert run.states[:4, 1].tolist() == [STUCK, FORWARD, STUCK, STUCK]
    set_ = (mass * v * v / 2.0 - level**2 / (2.0 * k)) / level
    np.testing.assert_allclose(run.last.position[1], set_, rtol=1e2 * ULPS)
    np.testing.assert_allclose(run.last.velocity, [-level / root, 0.0], rtol=1e2 * ULPS)
    inside = np.linspace(run.time[1], run.time[2], 9)[:-1]
    np.testing.assert_allclose(run.forces(inside), [[-level, -level]] * 8, rtol=1e2 * ULPS)
    found = vi.sweep(with_slider(mass, level, stop), over={"mass[0][0]": [mass]}, settle_periods=0, periods=4.0,
                     start=run.start, observe=["dissipation", "progress", "final"], progress=False)  # fmt: skip
    assert tuple(found.final_position.values[0]) == run.last.position
    np.testing.assert_allclose(found.x_progress.values[0, 1] * 4.0, set_, rtol=1e2 * ULPS)
    work = found.work_on_element.values[0] * 4.0  # the spring gives back what it took
    np.testing.assert_allclose(work, [0.0, level * set_], atol=1e3 * ULPS)


def test_soil_with_a_dashpot_yields_as_soon_as_it_is_struck() -> None:
    """The force of the dashpot is above the level: the stop is met and the slider slips at once."""
    mass, k, c, level, v = 1.0, 20.0, 5.0, 2.0, 1.0
    stop = vi.SoftStop((1.0, -1.0), upper=0.0, stiffness=k, damping=c)
    run = vi.simulate(with_slider(mass, level, stop), vi.State((-0.5, 0.0), (v, 0.0)), t_max=3.0)
    assert run.states[0].tolist() == [vi.SoftStopState.UPPER, FORWARD]
    with mp.workdps(50):  # c d' + k d = F, x'' = -F / m, until z' = x' - d' is zero

        def slip(t: Any) -> Any:
            return v - level * t / mass - mpf(level) / c * mp.exp(-mpf(k) * t / c)

        t = mp.findroot(slip, 0.49)
        depth = mpf(level) / k * (1 - mp.exp(-mpf(k) * t / c))
        set_ = v * t - level * t**2 / (2 * mpf(mass)) - depth
    np.testing.assert_allclose(run.time[1] - run.time[0], float(t), rtol=1e2 * ULPS)
    np.testing.assert_allclose(run.position[1, 1], float(set_), rtol=1e2 * ULPS)
    assert run.states[1].tolist() == [vi.SoftStopState.UPPER, STUCK]


def test_a_forced_oscillator_on_a_spring_with_a_slider_is_that_of_scipy() -> None:
    mass, own, spring, level, c, w, a = 1.0, 0.3, 4.0, 0.5, 0.1, 1.1, 0.9
    m = with_slider(mass, level, vi.SoftStop((1.0, 0.0), upper=9.0), spring=spring, k=own, c=c,
                    forces=(vi.Harmonic(w, (a, 0.0)),))  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.5, 0.0)), t_max=40.0, impacts=1000)

    def rate(t: float, y: np.ndarray, slips: int) -> list[float]:
        x, v, z = y
        f = a * math.sin(w * t) - own * x - c * v - spring * (x - z)
        return [v, f / mass, v if slips else 0.0]

    def limit(_: float, y: np.ndarray, slips: int) -> float:
        return y[1] * slips if slips else level - abs(spring * (y[0] - y[2]))

    limit.terminal, limit.direction = True, -1  # type: ignore[attr-defined]
    t, y, slips, times = 0.0, np.array([0.0, 0.5, 0.0]), 0, list[float]()
    while t < 40.0:
        s = solve_ivp(rate, (t, 40.0), y, args=(slips,), events=limit, rtol=1e-12, atol=1e-13)
        t, y = s.t[-1], s.y[:, -1]
        times.append(t)
        slips = 0 if slips else int(np.sign(y[0] - y[2]))
    assert len(times) > 20
    np.testing.assert_allclose(run.time, times, atol=1e-9)
    np.testing.assert_allclose([*run.last.position, run.last.velocity[0]], [y[0], y[2], y[1]], atol=1e-9)  # fmt: skip


def test_a_slider_may_be_on_either_side_of_its_spring() -> None:
    """Friction on the ground and a spring to the mass, or the other way round."""
    force = (vi.Harmonic(1.1, (0.9, 0.0)),)
    stop = vi.SoftStop((1.0, 0.0), upper=0.4, stiffness=7.0)
    ground = with_slider(1.0, 0.5, stop, spring=4.0, k=0.3, c=0.1, forces=force)
    mass = vi.Mechanism(
        mass=ground.mass, damping=ground.damping, stiffness=[[0.3, 0.0], [0.0, 4.0]], forces=force,
        elements=(ground.switching[0], vi.Friction((1.0, -1.0), 0.5)),
    )  # fmt: skip
    start = vi.State((0.0, 0.0), (0.5, 0.0))
    a, b = (vi.simulate(m, start, t_max=15.0, impacts=1000) for m in (ground, mass))
    np.testing.assert_allclose(a.time, b.time, atol=1e-12)
    np.testing.assert_allclose(a.position[:, 0], b.position[:, 0], atol=1e-12)
    assert {*a.states[:, 1]} == {STUCK, FORWARD, BACKWARD}


def test_a_slider_follows_a_force_of_its_own_without_inertia() -> None:
    k, level, a, w = 2.0, 0.3, 1.0, 1.7
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.0] * 2] * 2, stiffness=[[1.0, 0.0], [0.0, k]],
        forces=(vi.Harmonic(w, (0.0, a)),), elements=(vi.Friction((0.0, 1.0), level),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=12.0)
    top = (a - level) / k
    back = (math.pi - math.asin((a - 2.0 * level) / a)) / w
    wanted = [math.asin(level / a) / w, math.pi / (2.0 * w), back]
    np.testing.assert_allclose(run.time[:3], wanted, rtol=1e2 * ULPS)
    np.testing.assert_allclose(run.position[1, 1], top, rtol=1e2 * ULPS)
    t = np.linspace(wanted[0], wanted[1], 9)[:-1]
    x, v = run.at(t)
    np.testing.assert_allclose(x[:, 1], (a * np.sin(w * t) - level) / k, atol=1e2 * ULPS)
    np.testing.assert_allclose(v[:, 1], a * w * np.cos(w * t) / k, atol=1e3 * ULPS)


def test_a_belt_carries_a_slider_up_to_its_level() -> None:
    k, level, speed = 2.0, 0.3, 0.1
    m = with_slider(1.0, level, vi.SoftStop((1.0, 0.0), upper=9.0), spring=0.0, k=1.0, belt=speed)
    held = vi.Mechanism(mass=m.mass, damping=m.damping, stiffness=[[1.0, 0.0], [0.0, k]],
                        elements=m.switching)  # fmt: skip
    run = vi.simulate(held, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=5.0)
    np.testing.assert_allclose(run.time[0], level / k / speed, rtol=ULPS)
    np.testing.assert_allclose(run.last.position, [0.0, level / k], atol=1e2 * ULPS)
    assert run.states[0, 1] == BACKWARD  # the belt overtakes it


@pytest.mark.parametrize("offset", [0.0, 0.02])
def test_blows_of_a_shaken_ram_drive_on_by_the_balance_of_energy(offset: float) -> None:
    """Forcing, weight and damping do the work that the slider takes: level times progress."""
    level, w = 0.6, 1.0
    stop = vi.SoftStop((1.0, -1.0), upper=0.05, stiffness=40.0, damping=offset * 40.0)
    m = with_slider(1.0, level, stop, c=0.2, forces=(vi.Harmonic(w, (0.8, 0.0)),),
                    constant_force=(0.2, 0.0))  # fmt: skip
    start, periods = vi.State((0.0, 0.0), (0.0, 0.0)), 12
    length = periods * 2.0 * math.pi / w
    found = vi.sweep(m, over={}, start=vi.ListedStarts([start.position], [start.velocity], [0.0]),
                     settle_periods=0, periods=periods, progress=False,
                     observe=["dissipation", "progress", "forces", "impulse", "final"])  # fmt: skip
    run = vi.simulate(m, start, t_max=length, impacts=10_000)
    assert run.last.position == tuple(found.final_position.values[0])
    moved = found.x_progress.values[0, 1] * periods
    assert moved > 1.0
    slips = np.diff(run.position[:, 1])
    assert slips.min() >= -1e2 * ULPS  # it never comes back
    work = found.work_on_element.values[0] * length
    np.testing.assert_allclose(work[1], level * moved, rtol=1e3 * ULPS)
    np.testing.assert_allclose(found.force_smallest.values[0, 1], -level, rtol=1e2 * ULPS)
    # the soil hands the impulse of the ram on: nothing between them has mass
    np.testing.assert_allclose(*found.impulse.values[0], rtol=1e3 * ULPS)


def test_derivatives_pass_through_the_beginning_and_the_end_of_a_slip() -> None:
    stop = vi.SoftStop((1.0, -1.0), upper=0.0, stiffness=50.0, damping=0.5)
    m = with_slider(2.0, 3.0, stop, k=1.0)

    def after(x: float, v: float, z: float) -> np.ndarray:
        run = vi.simulate(m, vi.State((x, z), (v, 0.0)), t_max=2.0)
        assert FORWARD in run.states[:, 1]
        assert run.states[-1].tolist() == [vi.SoftStopState.OPEN, STUCK]
        return np.array([*run.last.position, run.last.velocity[0]])

    start = vi.State((-0.3, 0.1), (1.5, 0.0))
    matrix = vi.map_derivative(m, start, impacts=9, t_max=2.0).matrix[:3]
    at, h = np.array([-0.3, 1.5, 0.1]), 1e-6
    for i, column in enumerate((0, 2, 1)):
        step = np.eye(3)[i] * h
        difference = (after(*(at + step)) - after(*(at - step))) / (2.0 * h)
        np.testing.assert_allclose(matrix[:, column], difference, atol=1e-7)


def test_a_start_beyond_the_level_of_a_slider_is_undecided() -> None:
    m = with_slider(1.0, 0.5, vi.SoftStop((1.0, 0.0), upper=9.0), spring=4.0)
    run = vi.simulate(m, vi.State((1.0, 0.0), (0.0, 0.0)), t_max=1.0)
    assert run.end is vi.RunEnd.UNDECIDED


def test_what_leaves_a_slider_undetermined_is_refused() -> None:
    def machine(*elements: Any, damping: float = 0.0) -> vi.Mechanism:
        d = damping
        return vi.Mechanism(
            mass=np.diag([1.0, 0.0, 0.0]), damping=[[0, 0, 0], [0, d, -d], [0, -d, d]],
            stiffness=np.diag([1.0, 1.0, 1.0]), elements=elements,
        )  # fmt: skip

    a, b = (vi.Friction(tuple(float(j == i) for j in range(3)), 1.0) for i in (1, 2))
    machine(a, b)
    with pytest.raises(vi.InvalidParameterError, match="neither a dashpot nor friction"):
        machine(a)
    with pytest.raises(vi.InvalidParameterError, match="one constant level"):
        machine(a, vi.Friction((0.0, 0.0, 1.0), 1.0, 1.5))
    with pytest.raises(vi.InvalidParameterError, match="one constant level"):
        machine(a, vi.Friction((0.0, 0.0, 1.0), 1.0, load=vi.NormalLoad(1.0)))
    with pytest.raises(vi.InvalidParameterError, match="each slider holds one of its own"):
        machine(a, b, a)
    with pytest.raises(vi.InvalidParameterError, match="each slider holds one of its own"):
        machine(vi.Friction((0.0, 1.0, -1.0), 1.0))
    machine(a, b, damping=1.0)
    with pytest.raises(vi.InvalidParameterError, match="rigid stop on coordinate 1"):
        machine(a, b, vi.RigidStop((1.0, -1.0, 0.0), upper=1.0))
    kick = vi.PhaseSwitch(1.0, (0.0,), ((0.0,) * 3,), ((0.0, 1.0, 0.0),))
    with pytest.raises(
        vi.InvalidParameterError, match="one acts on coordinate 1, which has no mass"
    ):
        machine(a, b, kick)


def test_a_file_describes_a_slider(tmp_path: Path) -> None:
    path = tmp_path / "pile.toml"
    path.write_text(
        "[mechanism]\nmass = [[2.0, 0.0], [0.0, 0.0]]\ndamping = [[0.0, 0.0], [0.0, 0.0]]\n"
        "stiffness = [[0.0, 0.0], [0.0, 0.0]]\n"
        '[[mechanism.elements]]\nkind = "soft_stop"\nrow = [1.0, -1.0]\nupper = 0.0\nstiffness = 50.0\n'
        '[[mechanism.elements]]\nkind = "friction"\nrow = [0.0, 1.0]\nkinetic = 3.0\n'
    )
    stop = vi.SoftStop((1.0, -1.0), upper=0.0, stiffness=50.0)
    assert read_case(path).system == with_slider(2.0, 3.0, stop)
