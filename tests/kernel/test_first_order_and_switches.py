"""Coordinates without mass, phase switches, friction under a changing load, active stops."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi

ULPS = 64 * 2.0**-53
FAR = 100.0  # a stop that is not met


def test_a_maxwell_element_has_its_frequency_response() -> None:
    """A mass on a spring, and beside it a dashpot in series with another spring."""
    k, c, own, w = 1.0, 0.3, 2.0, 1.3
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[c, -c], [-c, c]], stiffness=[[k, 0.0], [0.0, own]],
        forces=(vi.Harmonic(w, (0.5, 0.2)),), constant_force=(0.1, 0.05),
        elements=(vi.SoftStop((1.0, 0.0), upper=FAR),),
    )  # fmt: skip
    impedance = np.array([[k - w * w + 1j * w * c, -1j * w * c], [-1j * w * c, own + 1j * w * c]])
    response = np.linalg.solve(impedance, [0.5, 0.2])
    rest = np.linalg.solve([[k, 0.0], [0.0, own]], [0.1, 0.05])
    x, v = response.imag + rest, (1j * w * response).imag  # of exp(i w t) at t = 0: sine is Im
    run = vi.simulate(m, vi.State(tuple(x), (v[0], 0.0)), t_max=20.0)
    t = np.linspace(0.0, 20.0, 50)
    wave = np.exp(1j * w * t)[:, None]
    position, velocity = run.at(t)
    np.testing.assert_allclose(position, (response * wave).imag + rest, atol=1e3 * ULPS)
    np.testing.assert_allclose(velocity, (1j * w * response * wave).imag, atol=1e3 * ULPS)


def test_a_square_wave_and_kicks_move_a_free_mass_as_a_sum() -> None:
    w, mass, force, kick = 2.0, 2.0, 1.0, 0.4
    switch = vi.PhaseSwitch(
        w, (0.5, 0.5 + math.pi), ((force,), (-force,)), impulses=((kick,), (0.0,))
    )
    m = vi.Mechanism(mass=[[mass]], damping=[[0.0]], stiffness=[[0.0]], elements=(switch,))
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), t_max=20.0)
    half = math.pi / w
    switched = 0.25 + half * np.arange(len(run) - 1)
    np.testing.assert_allclose(run.time[:-1], switched, rtol=ULPS)
    jumps = (run.velocity_after - run.velocity_before)[:-1, 0]
    np.testing.assert_allclose(jumps[::2], kick / mass, rtol=ULPS)
    np.testing.assert_allclose(jumps[1::2], 0.0, atol=ULPS)
    gained = np.diff(run.velocity_after[:-1, 0]) - jumps[1:]
    np.testing.assert_allclose(np.abs(gained), force / mass * half, rtol=1e2 * ULPS)


def test_an_arc_longer_than_pi_is_one_force_in_two_pieces() -> None:
    switch = vi.PhaseSwitch(1.0, (0.0, 5.0), ((1.0,), (-2.0,)))
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(switch,))
    run = vi.simulate(m, vi.State((0.0,), (0.0,), 0.1), t_max=10.0)
    _, velocity = run.at([4.9, 2.0 * math.pi - 0.1])
    np.testing.assert_allclose(velocity[0], 4.9, rtol=ULPS)
    np.testing.assert_allclose(velocity[1], 4.9 - 2.0 * (2.0 * math.pi - 5.0), rtol=1e2 * ULPS)


@pytest.mark.parametrize(
    "phases", [(0.5,), (0.0, math.pi), (1.0, 1.0 + math.pi), (0.0, 1.0, 1.0 + math.pi), (0.0, 3.0)]
)
@pytest.mark.parametrize("stiffness", [0.0, 1.3])
def test_every_kick_comes_once_for_hundreds_of_periods(
    phases: tuple[float, ...], stiffness: float
) -> None:
    """Of arcs that are pi long too: where one of them ends both of its sines vanish."""
    w, kicks = 0.9, (0.7, -0.3, 0.2)[: len(phases)]
    switch = vi.PhaseSwitch(w, phases, ((0.0,),) * len(phases), impulses=tuple((p,) for p in kicks))
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[stiffness]], forces=(vi.Harmonic(w, (0.2,)),),
        elements=(switch,),
    )  # fmt: skip
    periods = 300
    run = vi.simulate(m, vi.State((0.3,), (0.2,), 0.01), t_max=periods * 2.0 * math.pi / w)
    jumps = (run.velocity_after - run.velocity_before)[:, 0]
    kicked = np.abs(jumps) > 0.1
    expected = np.resize([*kicks[1:], kicks[0]] if phases[0] < 0.01 else kicks, kicked.sum())
    np.testing.assert_allclose(jumps[kicked], expected, rtol=1e2 * ULPS, atol=1e2 * ULPS)
    assert kicked.sum() == periods * len(phases)


def test_friction_ends_where_the_load_has_lifted_off() -> None:
    """Load 1 + 2 cos 3 t: gone from 3 t = 2 pi / 3 to 4 pi / 3."""
    load = vi.NormalLoad(1.0, motion=vi.Harmonic(3.0, (0.0,), (2.0,)))
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.Friction((1.0,), 0.3, 0.4, load=load),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (5.0,)), t_max=2.0)
    np.testing.assert_allclose(run.time[:2], [2.0 * math.pi / 9.0, 4.0 * math.pi / 9.0], rtol=ULPS)
    t = run.time[0]
    impulse = 0.3 * (t + 2.0 / 3.0 * math.sin(3.0 * t))
    np.testing.assert_allclose(run.velocity_after[:2, 0], 5.0 - impulse, rtol=ULPS)


def test_friction_under_the_force_of_a_soft_stop_is_the_same_as_its_load() -> None:
    """A mass pressed on a plate by a spring, sliding along it: N = k (z - gap) while it presses."""
    k, gap, mu = 50.0, 0.2, 0.3
    stop = vi.SoftStop((0.0, 1.0), upper=gap, stiffness=k)
    load = vi.NormalLoad(-k * gap, position=(0.0, k))
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.0] * 2] * 2, stiffness=[[0.0, 0.0], [0.0, 1.0]],
        elements=(stop, vi.Friction((1.0, 0.0), mu, load=load)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (9.0, 1.0)), t_max=3.0)
    meeting = run.time[run.status == vi.Status.ENGAGE][0]
    np.testing.assert_allclose(meeting, math.asin(gap), rtol=ULPS)
    end = meeting + 0.02  # the plate has stopped the mass by mu times the impulse of the stop
    _, velocity = run.at([meeting, end])
    drift = -(run.at(np.linspace(meeting, end, 2001))[0][:, 1]).sum() * 0.02 / 2000  # of the spring
    pressed = (velocity[0, 1] - velocity[1, 1]) + drift
    np.testing.assert_allclose(velocity[0, 0] - velocity[1, 0], mu * pressed, rtol=1e-2)


def test_an_active_stop_returns_more_than_it_takes() -> None:
    bumper = vi.RigidStop((1.0,), upper=1.0, restitution=1.5, active=True)
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]], elements=(bumper,))
    run = vi.simulate(m, vi.State((0.0,), (2.0,)), impacts=10)
    np.testing.assert_allclose(run.rate_after, -1.5 * run.rate_before, rtol=ULPS)


def test_sweeps_take_phase_switches_and_loads() -> None:
    load = vi.NormalLoad(1.0, motion=vi.Harmonic(2.0, (0.0,), (0.5,)))
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
        elements=(
            vi.SoftStop((1.0,), upper=0.5, stiffness=20.0),
            vi.Friction((1.0,), 0.1, load=load),
            vi.PhaseSwitch(2.0, (0.0, math.pi), ((1.0,), (-1.0,))),
        ),
    )  # fmt: skip
    start = vi.State((0.0,), (0.5,))
    out = vi.sweep(m, over={"stiffness[0][0]": [1.0, 1.2]}, start=start, settle_periods=0.0, periods=3,
                   observe="final")  # fmt: skip
    end = vi.simulate(m, start, t_max=3.0 * math.pi).position[-1, 0]
    assert out["final_position"].values[0, 0] == end


def test_sweeps_and_exponents_take_coordinates_without_mass() -> None:
    c, own = 0.3, 2.0
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[c, -c], [-c, c]], stiffness=[[1.0, 0.0], [0.0, own]],
        forces=(vi.Harmonic(1.3, (0.5, 0.2)),),
        elements=(vi.SoftStop((1.0, 0.0), upper=0.2, stiffness=5.0),),
    )  # fmt: skip
    start = vi.State((0.0, 0.0), (1.0, 0.0))
    out = vi.sweep(m, over={"stiffness[0][0]": [1.0, 1.1]}, start=start, settle_periods=0.0, periods=4,
                   observe=["final", "symbol"])  # fmt: skip
    end = vi.simulate(m, start, t_max=4.0 * 2.0 * math.pi / 1.3).position[-1]
    assert (out["final_position"].values[0] == end).all()
    with pytest.raises(vi.InvalidParameterError, match="massless; spectra in sweeps need masses"):
        vi.sweep(m, over={"stiffness[0][0]": [1.0]}, start=start, observe="spectrum")


@pytest.mark.parametrize(
    ("force", "d", "chaotic"), [(0.4, 0.5, False), (0.4, 0.2, False), (1.5, 0.5, True)]
)
def test_a_spectrum_has_an_exponent_less_for_a_massless_coordinate(
    force: float, d: float, chaotic: bool
) -> None:
    """Their sum is what flight and impacts do to volumes of (x, v, z): -c/m - k/d, and log r^2 each.

    The one that is left out is the least of the kernel's, or with the weak dashpot not the least.
    """
    c, k, r = 0.02, 0.5, 0.85
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[c, 0.0], [0.0, d]],
        stiffness=[[1.0 + k, -k], [-k, k]], forces=(vi.Harmonic(1.1, (force, 0.0)),),
        elements=(vi.RigidStop((1.0, 0.0), lower=-0.5, upper=0.5, restitution=r),),
    )  # fmt: skip
    found = vi.lyapunov_spectrum(m, vi.State((0.0, 0.0), (0.1, 0.0)), impacts=8192)
    assert found.values.shape == (3,)
    frequency = found.values[0] / found.per_impact[0]  # of impacts, as their mean
    lost = -c - k / d + math.log(r**2) * frequency
    np.testing.assert_allclose(found.values.sum(), lost, atol=1e-9 + found.errors.sum())
    assert (found.values[0] > 0.0) == chaotic


def test_the_exponent_of_a_maxwell_element_is_its_slowest_root() -> None:
    """Both stops of a bilinear spring have the stiffness of one: the machine is linear throughout."""
    c, own, k = 0.3, 2.0, 1.5
    spring = vi.SoftStop((1.0, 0.0), lower=0.0, upper=0.0, stiffness=k)
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[c, -c], [-c, c]], stiffness=[[1.0, 0.0], [0.0, own]],
        forces=(vi.Harmonic(1.3, (0.5, 0.2)),), elements=(spring,),
    )  # fmt: skip
    # x'' + (1 + k) x + own z = 0, c (z' - x') + own z = 0
    roots = np.roots([1.0, own / c, 1.0 + k + own, (1.0 + k) * own / c])
    found = vi.lyapunov_exponent(m, vi.State((0.0, 0.0), (1.0, 0.0)), impacts=4000)
    assert found.value == pytest.approx(roots.real.max(), abs=3.0 * found.error + 1e-9)
