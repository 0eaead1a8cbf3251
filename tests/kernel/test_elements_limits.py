"""Machines with elements where they tend to known systems, and motions with a closed form."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vibroimpact as vi

Array = NDArray[np.float64]


def one(*elements: Any, damping: float = 0.1, stiffness: float = 1.0, push: float = 0.0,
        forces: tuple[vi.Harmonic, ...] = (vi.Harmonic(0.7, (1.0,)),)) -> vi.Mechanism:  # fmt: skip
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], constant_force=(push,),
        forces=forces, elements=elements,
    )  # fmt: skip


def end_of(m: vi.Mechanism, t_max: float) -> Array:
    """State at a time, off all stops."""
    run = vi.simulate(m, vi.State((0.1,), (0.3,), 0.5), t_max=t_max)
    assert run.end is vi.RunEnd.HORIZON
    return np.array([run.position[-1, 0], run.velocity_after[-1, 0]])


def ratios(build: Callable[[float], vi.Mechanism], known: Array, sizes: list[float],
           t_max: float) -> list[float]:  # fmt: skip
    """Distances to a known state, each over the next."""
    apart = [float(np.abs(end_of(build(s), t_max) - known).max()) for s in sizes]
    return [a / b for a, b in itertools.pairwise(apart)]


def test_a_soft_stop_that_hardens_tends_to_a_rigid_one() -> None:
    zeta = 0.2  # of the mass on its stop
    restitution = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    known = end_of(one(vi.RigidStop((1.0,), upper=0.5, restitution=restitution)), 15.0)

    def build(k: float) -> vi.Mechanism:
        damping = 2.0 * zeta * math.sqrt(k)
        return one(vi.SoftStop((1.0,), upper=0.5, stiffness=k, damping=damping, law="linear"))

    # a contact lasts pi / sqrt(k (1 - zeta^2)), and the other forces change the motion by that much
    np.testing.assert_allclose(ratios(build, known, [1e6, 1e8, 1e10], 15.0), 10.0, rtol=0.02)


@pytest.mark.parametrize("static", [1.0, 1.5])
def test_friction_that_weakens_takes_of_first_order(static: float) -> None:
    stop = vi.RigidStop((1.0,), upper=0.5, restitution=0.8)
    known = end_of(one(stop), 15.0)

    def build(level: float) -> vi.Mechanism:
        return one(stop, vi.Friction((1.0,), kinetic=level, static=static * level))

    np.testing.assert_allclose(ratios(build, known, [1e-4, 1e-5, 1e-6], 15.0), 10.0, rtol=0.02)


def test_a_stop_that_hardly_moves_changes_the_motion_in_first_order() -> None:
    known = end_of(one(vi.RigidStop((1.0,), upper=0.5, restitution=0.8)), 15.0)

    def build(a: float) -> vi.Mechanism:
        return one(vi.RigidStop((1.0,), upper=0.5, restitution=0.8,
                                motion=vi.Harmonic(1.3, (a,))))  # fmt: skip

    np.testing.assert_allclose(ratios(build, known, [1e-4, 1e-5, 1e-6], 15.0), 10.0, rtol=0.02)


# ---- ball on a table a sin(t), g = 1: Gamma = a --------------------------------------------------
E = 0.5
BORN = math.pi * (1.0 - E) / (1.0 + E)
DOUBLED = math.hypot(BORN, 2.0 * (1.0 + E * E) / (1.0 + E) ** 2)


def ball(gamma: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=E,
                               motion=vi.Harmonic(1.0, (gamma,))),),
    )  # fmt: skip


def orbit(gamma: float) -> vi.State:
    """After the impact of the one-bounce orbit: pi - w = e (pi + w), w = Gamma cos(phase)."""
    phase = math.acos(BORN / gamma)
    return vi.State((gamma * math.sin(phase),), (math.pi,), phase)


def multipliers(gamma: float) -> Array:
    """Of the map of (phase, v) at impacts."""
    s = orbit(gamma)
    on_table = np.array([[gamma * math.cos(s.phase), 0.0], [0.0, 1.0], [1.0, 0.0]])
    out = vi.map_derivative(ball(gamma), s, impacts=1, directions=on_table)
    assert out.events == 1
    return np.linalg.eigvals(out.matrix[[2, 1]])


def test_the_one_bounce_orbit_is_a_motion_of_the_ball() -> None:
    run = vi.simulate(ball(1.2), orbit(1.2), impacts=200)
    np.testing.assert_allclose(np.diff(run.time), 2.0 * math.pi, rtol=1e-10)
    np.testing.assert_allclose(run.velocity_after[:, 0], math.pi, rtol=1e-10)


def test_its_multiplier_is_one_where_it_is_born() -> None:
    assert pytest.approx(math.pi / 3.0) == BORN
    # sin(phase) is the square root of 2 (Gamma / BORN - 1): 1e-8 at 1e-16
    assert max(multipliers(BORN * (1.0 + 1e-12)).real) == pytest.approx(1.0, abs=1e-5)
    # product: e^2 of each impact
    np.testing.assert_allclose(np.prod(multipliers(1.3)), E * E, rtol=1e-13)


def test_its_multiplier_is_minus_one_at_the_first_period_doubling() -> None:
    assert pytest.approx(1.5268237005190608, rel=1e-15) == DOUBLED
    assert min(multipliers(DOUBLED).real) == pytest.approx(-1.0, abs=1e-12)
    assert min(multipliers(DOUBLED - 1e-6).real) > -1.0 > min(multipliers(DOUBLED + 1e-6).real)


@pytest.mark.parametrize(("gamma", "bounces"), [(1.50, 1), (1.55, 2)])
def test_the_ball_bounces_alike_before_and_in_two_ways_after(gamma: float, bounces: int) -> None:
    s = orbit(gamma)
    run = vi.simulate(ball(gamma), vi.State(s.position, (math.pi + 1e-3,), s.phase), impacts=4000)
    v = run.velocity_after[-8:, 0]
    assert np.ptp(v[::bounces]) < 1e-9
    assert bounces == 1 or abs(v[0] - v[1]) > 0.05


# ---- friction ------------------------------------------------------------------------------------


def test_a_slider_dragged_slowly_goes_in_a_saw_tooth() -> None:
    static, kinetic, k = 0.5, 0.3, 2.0
    drop, w = (static - kinetic) / k, math.sqrt(k)
    for v in (1e-1, 1e-3, 1e-5):
        m = vi.Mechanism(
            mass=[[1.0]], damping=[[0.0]], stiffness=[[k]],
            elements=(vi.Friction((1.0,), kinetic=kinetic, static=static, belt_speed=v),),
        )  # fmt: skip
        run = vi.simulate(m, vi.State((0.0,), (v,)), t_max=20.0 * drop / v)
        # it sticks from -drop to drop beside kinetic / k, and swings back from speed v to speed v;
        # all but the first is lost against 2 drop / v for small v
        period = 2.0 * drop / v + (math.pi + 2.0 * math.atan(v / (w * drop))) / w
        np.testing.assert_allclose(np.diff(run.time[:-1:2]), period, rtol=1e-12)


@pytest.mark.parametrize("r", [0.6, 1.3, 1.8])
def test_a_forced_mass_with_friction_swings_as_den_hartog_has_found(r: float) -> None:
    force, level = 1.0, 0.3
    m = one(vi.Friction((1.0,), kinetic=level), damping=0.0, forces=(vi.Harmonic(r, (force,)),))
    run = vi.simulate(m, vi.State((0.0,), (0.5,)), t_max=4000.0)
    turns = np.abs(run.position[-41:-1, 0])
    # x0 = sqrt(V^2 - (f U)^2), V = 1 / (1 - r^2), U = sin(pi / r) / (r (1 + cos(pi / r)))
    v = 1.0 / (1.0 - r * r)
    u = math.sin(math.pi / r) / (r * (1.0 + math.cos(math.pi / r)))
    expected = math.sqrt(v * v - (level / force * u) ** 2)
    assert np.ptp(turns) < 1e-9  # it has settled, and stops for an instant only
    np.testing.assert_allclose(turns, expected, rtol=1e-9)


# ---- multipliers ---------------------------------------------------------------------------------


def test_sticking_lowers_the_rank_of_the_map() -> None:
    m = one(vi.Friction((1.0,), kinetic=0.5, static=0.75), forces=(vi.Harmonic(0.5, (1.0,)),))
    start = vi.State((0.0,), (0.5,), 0.1)
    run = vi.simulate(m, start, t_max=20.0)
    stuck = [
        i for i in range(len(run) - 1)
        if np.abs(run.at(np.linspace(run.time[i], run.time[i + 1], 9))[1]).max() < 1e-12
    ]  # fmt: skip
    assert stuck
    d = vi.map_derivative(m, start, t_max=20.0, impacts=1000)
    # it leaves at a known force, at a time that depends on one number, its place
    singular = np.linalg.svd(d.matrix[:2, :2])[1]
    assert singular[1] < 1e-12 * singular[0]


def test_a_bilinear_oscillator_that_dies_out_has_half_its_damping_as_exponent() -> None:
    c = 0.0625
    m = one(vi.SoftStop((1.0,), upper=0.0, stiffness=3.0), damping=c, forces=())
    start = vi.State((0.0,), (1.0,))
    d = vi.map_derivative(m, start, impacts=20)
    run = vi.simulate(m, start, impacts=20)
    # its solution is x_0(t) times any number, and x_0 itself shifted in time: at the 20th zero both
    # multipliers are v / v_0
    shrunk = run.velocity_after[-1, 0]
    np.testing.assert_allclose(shrunk, math.exp(-c / 2.0 * run.time[-1]), rtol=1e-13)
    np.testing.assert_allclose(d.matrix[1, 1], shrunk, rtol=1e-13)


def test_the_exponent_of_a_stable_orbit_is_that_of_its_multipliers() -> None:
    m = one(vi.SoftStop((1.0,), upper=0.2, stiffness=9.0, damping=0.3))
    start = vi.State((0.0,), (0.5,), 0.1)
    on_orbit = vi.simulate(m, start, impacts=300).last  # two engagements in a period of the force
    period = vi.simulate(m, on_orbit, impacts=2).time[-1]
    np.testing.assert_allclose(period, 2.0 * math.pi / 0.7, rtol=1e-9)
    size = np.abs(np.linalg.eigvals(vi.map_derivative(m, on_orbit, impacts=2).matrix))
    assert min(size) < 1e-12  # time is determined by the stop
    expected = math.log(max(size)) / period
    estimate = vi.lyapunov_exponent(m, start, impacts=4096, settle_impacts=300)
    # complex multipliers turn the tangent vector: log |vector| wavers by some units in all
    assert abs(estimate.value - expected) < 4.0 / (2048 * period)
