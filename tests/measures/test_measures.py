"""Measures against closed forms, differences of orbits, sweeps, energy and momentum."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.massless import DASH, OWN, C, K, M, jenkins, maxwell
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.measures.linear import FreeMotion, free_motion, free_motions
from vibroimpact.model.parameters import parameter_value, with_parameter
from vibroimpact.orbits.stability import Stability

ROWS = [
    "x1", "v1", "a1", "x1 - 0.5*x2", "peak x1", "rms x1", "rms v1", "rms a1", "harmonic 1 x1",
    "harmonic 3 x1", "transmissibility x1",
]  # fmt: skip
OTHERS = ["power", "power of dashpots", "contact force 0", "impact speed", "impact rate"]


def pressed(k: float, c: float, w: float, x: float) -> vi.Mechanism:
    """Two coupled masses, the first of which, less half the second, meets a soft stop."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.5]], damping=[[0.1, -0.02], [-0.02, c]],
        stiffness=[[k, -0.3], [-0.3, 0.8]], forces=(vi.Harmonic(w, (1.0, 0.1), (0.0, 0.2)),),
        elements=(vi.SoftStop((1.0, -0.5), upper=x, stiffness=20.0, damping=0.5),),
    )  # fmt: skip


@pytest.fixture(scope="module")
def soft() -> tuple[vi.Family, vi.Orbit]:
    system = vi.Family(pressed, k=1.0, c=0.1, w=0.8, x=0.3)
    return system, vi.find_orbit(system, vi.State((0.0, 0.0), (0.0, 0.0)))


@pytest.fixture(scope="module")
def damped() -> tuple[vi.ImpactDamper, vi.Orbit]:
    system = paper_damper("A", 1.2)
    return system, vi.find_orbit(system, vi.symmetric_orbits(system)[0])


# ---- derivatives ---------------------------------------------------------------------------------


def differences(system: Any, orbit: vi.Orbit, parameter: str) -> dict[str, float]:
    """Fourth-order differences of every measure over neighbouring orbits.

    The error is 4 h^4 f^(5) / 5!, some 1e-11 of f, and rounding 1e-13 / h = 1e-10.
    """
    p = parameter_value(system, parameter)
    h = 1e-3 * p
    found: dict[str, float] = dict.fromkeys([*ROWS, *OTHERS], 0.0)
    for step, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
        there = with_parameter(system, parameter, p + step * h)
        near = vi.find_orbit(there, orbit)
        for name in found:
            found[name] += weight * vi.measure_of(there, name).of_orbit(near) / (12.0 * h)
    return found


@pytest.mark.parametrize("parameter", ["omega", "half_clearance", "restitution"])
def test_derivatives_of_a_damper_are_those_of_neighbouring_orbits(
    damped: tuple[vi.ImpactDamper, vi.Orbit], parameter: str
) -> None:
    system, orbit = damped
    for name, expected in differences(system, orbit, parameter).items():
        found = vi.measure_of(system, name).derivative(orbit, parameter)
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-7), name


@pytest.mark.parametrize("parameter", ["k", "w", "x"])
def test_derivatives_of_a_machine_with_a_soft_stop_are_those_of_neighbouring_orbits(
    soft: tuple[vi.Family, vi.Orbit], parameter: str
) -> None:
    system, orbit = soft
    for name, expected in differences(system, orbit, parameter).items():
        found = vi.measure_of(system, name).derivative(orbit, parameter)
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-7), name


# ---- values --------------------------------------------------------------------------------------


def sampled(system: Any, orbit: vi.Orbit, count: int = 20_001) -> tuple[np.ndarray, ...]:
    """Times, x, v of a simulated period, evenly spaced."""
    state = orbit.state
    run = vi.simulate(system, state, t_max=orbit.period, impacts=1000)
    t = np.linspace(0.0, orbit.period, count)[:-1]
    return t + state.phase / orbit.mechanism.omega, *run.at(t)


def test_extremes_and_means_are_those_of_a_densely_sampled_motion(
    soft: tuple[vi.Family, vi.Orbit],
) -> None:
    system, orbit = soft
    _, x, v = sampled(system, orbit)
    near = 1e-6  # samples are 4e-4 apart: extremes are missed by less than u'' (2e-4)^2 / 2
    for name, expected in {
        "x1": np.ptp(x[:, 0]) / 2.0, "v2": np.ptp(v[:, 1]) / 2.0,
        "peak x2 - x1": np.abs(x[:, 1] - x[:, 0]).max(),
        "rms v1": math.sqrt(np.mean(v[:, 0] ** 2)),
    }.items():  # fmt: skip
        found = vi.measure_of(system, name).of_orbit(orbit)
        assert found == pytest.approx(expected, abs=near), name


@pytest.mark.parametrize("machine", ["soft", "damped"])
def test_what_the_force_gives_is_what_stops_and_dashpots_take(
    machine: str, request: pytest.FixtureRequest
) -> None:
    system, orbit = request.getfixturevalue(machine)
    t, x, _ = sampled(system, orbit)
    given = 0.0
    for force in orbit.mechanism.forces:  # the mean of F v is that of -F' x; x has no jumps
        rate = np.outer(np.cos(force.omega * t), force.sine) - np.outer(
            np.sin(force.omega * t), force.cosine
        )
        given -= force.omega * float(np.mean(np.sum(rate * x, axis=1)))
    taken = sum(
        vi.measure_of(system, name).of_orbit(orbit) for name in ("power", "power of dashpots")
    )
    assert taken == pytest.approx(given, rel=1e-6)  # the rule of rectangles, 1e-7


def test_an_impulse_is_the_change_of_momentum(damped: tuple[vi.ImpactDamper, vi.Orbit]) -> None:
    system, orbit = damped
    run = vi.simulate(system, orbit.state, impacts=4)
    jump = system.mass_ratio * np.abs(run.velocity_after[:, 1] - run.velocity_before[:, 1])
    assert vi.measure_of(system, "impulse").of_orbit(orbit) == pytest.approx(jump.max(), rel=1e-9)


def test_a_sweep_measures_what_its_settled_orbit_has(
    soft: tuple[vi.Family, vi.Orbit], damped: tuple[vi.ImpactDamper, vi.Orbit]
) -> None:
    for (system, orbit), parameter in ((soft, "k"), (damped, "zeta")):
        names = [*ROWS, *OTHERS, *(["impulse"] if system is damped[0] else [])]
        measures = [vi.measure_of(system, name) for name in names]
        value = parameter_value(system, parameter)
        members = vi.sweep(
            system, over={parameter: [value]}, start=orbit.state, settle_periods=0.37, periods=60,
            observe=[one for measure in measures for one in measure.observers], progress=False,
        )  # fmt: skip
        for name, measure in zip(names, measures, strict=True):
            found = measure.of_sweep(members).item()
            assert found == pytest.approx(measure.of_orbit(orbit), rel=1e-9, abs=1e-9), name


def test_a_subharmonic_is_that_of_a_motion_over_two_periods() -> None:
    oscillator = vi.ImpactOscillator(zeta=0.05, omega=4.0, restitution=0.7, clearance=0.0)
    orbit = vi.find_orbit(oscillator, vi.State((-1.0,), (0.0,)))
    assert orbit.symbol == "2-1-0"
    t, x, _ = sampled(oscillator, orbit)
    whole = 2.0 * abs(np.mean(x[:, 0] * np.exp(-0.5j * oscillator.omega * t)))
    assert vi.measure_of(oscillator, "harmonic 1/2 x1").of_orbit(orbit) == pytest.approx(
        whole, abs=1e-6
    )
    assert vi.measure_of(oscillator, "harmonic 1/3 x1").of_orbit(orbit) == 0.0  # not its own


@pytest.mark.parametrize("beta", [0.7, 1.3])
def test_a_mass_with_dry_friction_has_den_hartogs_amplitude(beta: float) -> None:
    """Steady motion without stops, in closed form: Trans. ASME 53 (1931) APM-107."""
    ratio = 0.3  # friction over force
    rubbing = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]], forces=(vi.Harmonic(beta, (1.0,)),),
        elements=(vi.Friction((1.0,), ratio),),
    )  # fmt: skip
    orbit = vi.find_orbit(rubbing, vi.State((1.0,), (0.0,)))
    direct = 1.0 / (1.0 - beta**2)
    angle = math.pi / beta
    across = math.sin(angle) / (beta * (1.0 + math.cos(angle)))
    expected = math.sqrt(direct**2 - (ratio * across) ** 2)
    amplitude = vi.measure_of(rubbing, "x1").of_orbit(orbit)
    assert amplitude == pytest.approx(expected, rel=1e-9)
    power = vi.measure_of(rubbing, "power 0").of_orbit(orbit)
    assert power == pytest.approx(ratio * 4.0 * expected * beta / (2.0 * math.pi), rel=1e-9)


# ---- motions without impacts ---------------------------------------------------------------------


def test_the_motion_without_impacts_is_that_of_the_linear_oscillator() -> None:
    damper = paper_damper("A", 1.2)
    motion = free_motion(damper)
    assert isinstance(motion, FreeMotion)
    w, wn, z = damper.omega, damper.omega_n, damper.zeta
    below = complex(wn * wn - w * w, 2.0 * z * wn * w)
    amplitude = 1.0 / abs(below)
    by = -((below.real * -2.0 * w) + below.imag * 2.0 * z * wn) / abs(below) ** 3
    for name, order in (("x1", 0), ("v1", 1), ("a1", 2)):
        value, derivative = vi.measure_of(damper, name).along(motion, "omega")
        assert value == pytest.approx(amplitude * w**order, rel=1e-12)
        expected = by * w**order + order * amplitude * w ** max(order - 1, 0)
        assert derivative == pytest.approx(expected, rel=1e-12)
    power = vi.measure_of(damper, "power of dashpots").of_orbit(motion)
    assert power == pytest.approx(z * wn * (amplitude * w) ** 2, rel=1e-12)
    assert motion.clearance_to_grazing == pytest.approx(
        damper.half_clearance - amplitude, rel=1e-12
    )
    assert motion.stability is Stability.NEUTRAL  # the free mass stands anywhere


def test_the_motion_without_impacts_of_a_massless_coordinate_is_that_of_its_impedance() -> None:
    """A Maxwell element beside the spring: i w DASH OWN / (OWN + i w DASH) of stiffness. A slider is not linear."""
    stop, w, h = vi.SoftStop((1.0, 0.0), upper=9.0, stiffness=1.0), 1.3, 1e-6

    def amplitude(w: float) -> float:
        return abs(0.5 / (K - w * w * M + 1j * w * C + 1j * w * DASH * OWN / (OWN + 1j * w * DASH)))

    machine = maxwell(stop, w)
    motion = free_motion(machine)
    assert isinstance(motion, FreeMotion)
    value, derivative = vi.measure_of(machine, "x1").along(motion, "omega")
    assert value == pytest.approx(amplitude(w), rel=1e-12)
    slope = (amplitude(w + h) - amplitude(w - h)) / (2.0 * h)
    assert derivative == pytest.approx(slope, rel=1e-8)
    light = vi.measure_of(machine, "x2").of_orbit(motion)
    assert light == pytest.approx(
        amplitude(w) * abs(1j * w * DASH / (OWN + 1j * w * DASH)), rel=1e-12
    )
    assert motion.stable
    assert free_motion(jenkins(stop)) == (
        "friction alone gives the motion of coordinate 1, which has no mass"
    )
    response = vi.frequency_response(machine, "omega", (1.2, 1.4), points=3, starts=1, settle_periods=50, periods=5,
                                     progress=False)  # fmt: skip
    assert "no motion without impacts" not in str(response)


def test_motions_without_impacts_at_many_values_are_those_one_by_one_and_resonance_has_none() -> (
    None
):
    def undamped(omega: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0, 0.0], [0.0, 0.1]], damping=[[0.0, 0.0], [0.0, 0.0]], stiffness=[[1.0, 0.0], [0.0, 0.0]],
            forces=(vi.Harmonic(omega, (1.0, 0.0)),),
            elements=(vi.RigidStop((-1.0, 1.0), lower=-3.0, upper=9.0),),
        )  # fmt: skip

    values = np.array([0.5, 1.0, 2.0])
    below, resonance, above = free_motions(vi.Family(undamped, omega=0.5), "omega", values)
    assert resonance == "it resonates without damping"
    for omega, motion in ((0.5, below), (2.0, above)):
        assert isinstance(motion, FreeMotion)
        assert motion.clearance_to_grazing == pytest.approx(6.0 - 1.0 / abs(1.0 - omega**2))
        alone = free_motion(undamped(omega))
        assert isinstance(alone, FreeMotion)
        np.testing.assert_allclose(motion.offset, alone.offset, rtol=1e-12)
        assert motion.reaches == [
            (stop, pytest.approx(gap, rel=1e-12)) for stop, gap in FreeMotion(alone.system, alone.offset).reaches
        ]  # fmt: skip


def test_a_free_mass_stands_in_the_middle_of_what_the_motion_leaves() -> None:
    unequal = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.1]], damping=[[0.1, 0.0], [0.0, 0.0]],
        stiffness=[[1.0, 0.0], [0.0, 0.0]], forces=(vi.Harmonic(2.0, (1.0, 0.0)),),
        elements=(vi.RigidStop((-1.0, 1.0), -1.0, 3.0, 0.5),),
    )  # fmt: skip
    motion = free_motion(unequal)
    assert isinstance(motion, FreeMotion)
    amplitude = 1.0 / abs(complex(1.0 - 4.0, 0.2))
    assert motion.offset == pytest.approx([0.0, 1.0], abs=1e-9)
    assert [reach.gap for reach in motion.reaches] == pytest.approx([2.0 - amplitude] * 2)
    falling = replace(unequal, constant_force=(0.0, -1.0))
    assert free_motion(falling) == "a constant force acts on a mass that no spring holds"


# ---- misuse --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("y1", "'harmonic 3 x1'"), ("rms", "must be"), ("x3", "coordinates 1 to 2"),
        ("x1 - v1", "a difference such as"), ("harmonic 0 x1", "> 0"), ("power 7", "0 to 0"),
        ("transmissibility x2", "no static deflection"), (3, "a measure or its name"),
        (vi.measures.Amplitude, "with its arguments"), (vi.measures.Rms((1.0, 0.0, 0.0)), "row"),
    ],
)  # fmt: skip
def test_what_is_no_measure_is_refused(what: Any, words: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=words):
        vi.measure_of(paper_damper("A", 1.2), what)


def test_a_sweep_without_the_observers_is_refused() -> None:
    damper = paper_damper("A", 1.2)
    members = vi.sweep(
        damper, over={"omega": [1.2]}, start=vi.State((0.0, 0.0), (0.0, 1.0)), progress=False
    )
    with pytest.raises(vi.InvalidParameterError, match=r"measure\.observers"):
        vi.measure_of(damper, "x1").of_sweep(members)


@pytest.mark.parametrize("force", [1e-13, 1.0, 1e13])
def test_transmissibility_does_not_depend_on_the_size_of_the_force(force: float) -> None:
    machine = vi.Mechanism(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]],
        forces=(vi.Harmonic(1.2, (force,)),), elements=(vi.RigidStop((1.0,), upper=50.0 * force),),
    )  # fmt: skip
    found = vi.frequency_response(
        machine, "omega", (1.2, 1.3), measure="transmissibility x1", points=2, starts=1, settle_periods=1,
        periods=1, most_branches=0, progress=False,
    )  # fmt: skip
    assert found.curves[0].value[0] == pytest.approx(1.0 / abs(1.0 - 1.2**2 + 0.024j), rel=1e-10)
