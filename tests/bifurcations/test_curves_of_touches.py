"""Points of codimension two on curves of touches, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from vibroimpact_papers.witness import once_a_period

import vibroimpact as vi
from vibroimpact.orbits.find import unfolded

ZETA, R = 0.1, 0.7
DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.95
)
OMEGA_D = math.sqrt(1.0 - ZETA**2)
FEW = vi.Steps(first=0.2, points=30)


@pytest.mark.slow
def test_a_touch_is_resonant_where_whole_half_periods_of_vibration_fit_between_two() -> None:
    """C L w is -exp(-zeta T) sin(omega_d T) / omega_d: zero at omega = 2 omega_d / k."""
    amplitude = lambda omega: 1.0 / math.hypot(1.0 - omega**2, 2.0 * ZETA * omega)  # noqa: E731
    machine = vi.ImpactOscillator(
        zeta=ZETA, omega=1.988, restitution=R, clearance=1.01 * amplitude(1.988)
    )
    free = vi.find_orbit(machine, vi.State((0.0,), (0.0,)))
    wide = (amplitude(1.988) * 0.99, amplitude(1.988) * 1.02)
    touch = vi.continue_orbit(free, "clearance", wide)["GR1"]
    curve = vi.continue_bifurcation(
        touch, ("omega", "clearance"), ((1.985, 1.995), (0.32, 0.35)), steps=vi.Steps(first=0.5)
    )
    (point,) = curve.special_points
    assert (point.kind, point.curve.label) == ("RES", "GR")
    assert point.parameters["omega"] == pytest.approx(2.0 * OMEGA_D, abs=1e-9)
    omega, clearance = curve.values.T
    np.testing.assert_allclose(clearance, [amplitude(one) for one in omega], rtol=1e-12)


@pytest.mark.slow
def test_a_touch_meets_the_flip_of_a_mass_that_it_does_not_act_on() -> None:
    """Two masses apart: the first one's orbit doubles where V = kappa g, the second one touches at its amplitude."""
    omega, stop = 2.1, 0.25
    reach = 1.0 / math.hypot(2.0 - omega**2, 0.3 * omega)
    far, near = (
        vi.Family(apart, u=(stop + other) / 2.0, w=(stop - other) / 2.0)
        for other in (reach + 0.4, reach + 0.03)
    )
    start = vi.find_orbit(near, vi.find_orbit(far, vi.State((0.0, 0.0), (0.0, 0.0))))
    touch = vi.continue_orbit(start, "w", (-0.1, -0.055))["GR1"]
    bounds = ((0.33, 0.36), (-0.08, -0.04))
    curve = vi.continue_bifurcation(touch, ("u", "w"), bounds, steps=FEW)
    point = curve["PD_1"]
    expected = float(once_a_period(omega, ZETA, R).flip)
    assert point.parameters["u"] + point.parameters["w"] == pytest.approx(expected, abs=1e-9)
    assert point.parameters["u"] - point.parameters["w"] == pytest.approx(reach, abs=1e-9)
    form = point.normal_form
    assert (form.kind, form.curve_kind, form.order) == ("GR", "PD", 1)
    assert abs(form.coefficient) == pytest.approx(2.0)


def apart(u: float, w: float) -> vi.Mechanism:
    """Two oscillators with stops at u + w and u - w."""
    return vi.Mechanism(
        mass=((1.0, 0.0), (0.0, 1.0)), damping=((2.0 * ZETA, 0.0), (0.0, 0.3)),
        stiffness=((1.0, 0.0), (0.0, 2.0)), forces=(vi.Harmonic(2.1, (1.0, 1.0)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=u + w, restitution=R),
            vi.RigidStop((0.0, 1.0), upper=u - w, restitution=0.6),
        ),
    )  # fmt: skip


# ---- SIDE, SN and NS -----------------------------------------------------------------------------

MODES = np.array([[0.8, 0.6], [-0.6, 0.8]])  # of unit masses, by columns
RATES = np.array([1.0, 2.3])  # natural frequencies
SHARE = 0.05  # damping ratio of both


def coupled(omega: float, gap: float) -> vi.Mechanism:
    """Two coupled masses; the first one is forced, before a stop."""
    damping, stiffness = (
        MODES @ np.diag(values) @ MODES.T for values in (2.0 * SHARE * RATES, RATES**2)
    )
    return vi.Mechanism(
        mass=np.eye(2), damping=damping, stiffness=stiffness, forces=(vi.Harmonic(omega, (1.0, 0.0)),),
        elements=(vi.RigidStop((1.0, 0.0), upper=gap, restitution=R),),
    )  # fmt: skip


def response(omega: float) -> np.ndarray:
    """Complex amplitudes of the positions without the stop, in units of exp(i omega t) / i."""
    modal = MODES[0] / (RATES**2 - omega**2 + 2j * SHARE * RATES * omega)
    amplitudes: np.ndarray = MODES @ modal
    return amplitudes


def reach(omega: float) -> float:
    """Amplitude of the first mass without the stop."""
    return float(abs(response(omega)[0]))


def periodic_push(omega: float) -> float:
    """Place of the first mass at the instant of unit impulses once a period, relative to that without them."""
    w, t = RATES * math.sqrt(1.0 - SHARE**2), 2.0 * math.pi / omega
    q = np.exp((-SHARE * RATES + 1j * w) * t)
    return float(np.sum(MODES[0] ** 2 * (q / (1.0 - q)).imag / w))


def speed_of_impact(omega: float, side: float) -> float:
    """Speed before the impact of the orbit with one impact a period, g - A being a little to one side of 0."""
    x = response(omega)
    theta = 0.5 * math.pi - float(np.angle(x[0]))
    turned = x * np.exp(1j * theta)
    state = [*turned.imag, *(omega * turned.real), theta]
    machine = coupled(omega, reach(omega) * (1.0 + 1e-5 * side))
    guess = vi.Guess(np.array([state]), np.array([2.0 * math.pi / omega]))
    orbit = vi.find_orbit(machine, guess, stops="A", cycles=1)
    assert orbit.converged
    return -float(orbit.states[0, 2]) / R


@pytest.mark.slow
def test_the_orbit_with_an_impact_changes_its_side_where_impulses_do_not_move_their_place() -> None:
    """To first order in the speed V of the impact g - A is -(1 + R) V times the place that impulses add."""
    low, high = 2.66, 2.76
    expected = brentq(periodic_push, low, high, xtol=1e-14)
    machine = vi.Family(coupled, omega=2.7, gap=1.01 * reach(2.7))
    free = vi.find_orbit(machine, vi.State((0.0, 0.0), (0.0, 0.0)), stops="")
    touch = vi.continue_orbit(free, "gap", (0.99 * reach(2.7), 1.02 * reach(2.7)))["GR1"]
    bounds = ((low, high), (0.9 * reach(high), 1.1 * reach(low)))
    curve = vi.continue_bifurcation(touch, ("omega", "gap"), bounds, steps=FEW)
    found = [p.parameters["omega"] for p in curve.special_points if p.kind == "SIDE"]
    assert found == pytest.approx([expected], abs=1e-9)
    for omega in (expected - 0.02, expected + 0.02):
        side = -math.copysign(1.0, periodic_push(omega))
        assert speed_of_impact(omega, side) > 0.0
        assert speed_of_impact(omega, -side) < 0.0


@pytest.mark.slow
def test_a_touch_meets_the_fold_of_a_mass_that_it_does_not_act_on() -> None:
    """The first mass folds at the largest stop that it meets once a period, the second one touches at its amplitude."""
    omega = 1.95
    fold = float(once_a_period(omega, ZETA, R).fold)
    touching = 1.0 / math.hypot(2.0 - omega**2, 0.3 * omega)
    far, near = (
        vi.Family(apart_at, omega=omega, first=0.97 * fold, second=share * touching)
        for share in (1.5, 1.02)
    )
    start = vi.find_orbit(near, vi.find_orbit(far, vi.State((0.0, 0.0), (0.0, 0.0))))
    touch = vi.continue_orbit(start, "second", (0.98 * touching, 1.03 * touching))["GR1"]
    bounds = ((0.95 * fold, 1.05 * fold), (0.9 * touching, 1.1 * touching))
    curve = vi.continue_bifurcation(
        touch, ("first", "second"), bounds, steps=replace(FEW, points=100)
    )
    at = curve["SN_1"].parameters
    assert at["first"] == pytest.approx(fold, abs=1e-9)
    assert at["second"] == pytest.approx(touching, abs=1e-9)


def apart_at(omega: float, first: float, second: float) -> vi.Mechanism:
    """Two oscillators apart, with their stops."""
    m = apart((first + second) / 2.0, (first - second) / 2.0)
    return replace(m, forces=(vi.Harmonic(omega, (1.0, 1.0)),))


def damper_beside(omega: float, gap: float) -> vi.Mechanism:
    """An impact damper, and a mass apart before a stop."""
    m = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0,
                        omega=omega).mechanism  # fmt: skip
    third = {"mass": 1.0, "damping": 0.3, "stiffness": 2.0}

    def wider(name: str) -> np.ndarray:
        out = np.zeros((3, 3))
        out[:2, :2], out[2, 2] = getattr(m, name), third[name]
        return out

    (line,) = m.forces
    (stop,) = m.elements
    assert isinstance(stop, vi.RigidStop)
    return vi.Mechanism(
        **{name: wider(name) for name in third},
        forces=(vi.Harmonic(omega, (*line.sine, 1.0), (*line.cosine, 0.0)),),
        elements=(replace(stop, row=(*stop.row, 0.0)), vi.RigidStop((0.0, 0.0, 1.0), upper=gap)),
    )


@pytest.mark.slow
def test_a_touch_meets_the_torus_of_a_damper_that_it_does_not_act_on() -> None:
    """Along the touch at the amplitude of the mass apart, where the damper's closed form has a pair of modulus 1."""

    def modulus(omega: float) -> float:
        orbit = vi.symmetric_orbits(replace(DAMPER, omega=omega))[0]
        return float(np.abs(orbit.multipliers).max()) - 1.0

    def touching(omega: float) -> float:
        return 1.0 / math.hypot(2.0 - omega**2, 0.3 * omega)

    torus = brentq(modulus, 0.93, 0.98, xtol=1e-14)
    omega = torus - 0.01
    machine = vi.Family(damper_beside, omega=omega, gap=1.02 * touching(omega))
    known = vi.symmetric_orbits(replace(DAMPER, omega=omega))[0]
    states, durations = unfolded(known)
    x = np.exp(1j * states[:, -1]) / complex(2.0 - omega**2, 0.3 * omega)
    wide = np.column_stack([states[:, :2], x.imag, states[:, 2:4], omega * x.real, states[:, -1]])
    guess = vi.Guess(wide, durations)
    start = vi.find_orbit(machine, guess, stops=known.signature.impacts, cycles=1)
    touch = vi.continue_orbit(start, "gap", (0.98 * touching(omega), 1.03 * touching(omega)))["GR1"]
    bounds = ((torus - 0.02, torus + 0.02), (0.8 * touching(omega), 1.2 * touching(omega)))
    curve = vi.continue_bifurcation(touch, ("omega", "gap"), bounds, steps=FEW)
    at = curve["NS_1"].parameters
    assert at["omega"] == pytest.approx(torus, abs=1e-8)
    assert at["gap"] == pytest.approx(touching(torus), abs=1e-8)
