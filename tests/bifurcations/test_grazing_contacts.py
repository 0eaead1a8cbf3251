"""Where curves of bifurcations end because an orbit touches a stop, against closed forms and power laws.

Motions with one impact of speed V a period are those of vibroimpact_papers.witness: V = 0 is g = A, SN the largest g,
on PD V = kappa g. Both meet V = 0 where a = 0: omega_d T = pi.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from vibroimpact_papers.witness import OnceAPeriod, once_a_period

import vibroimpact as vi
from vibroimpact.bifurcations.grazing_contact import free_gap_rate
from vibroimpact.bifurcations.of_orbits import OrbitPlane

ZETA, R = 0.1, 0.7
OMEGA_D = math.sqrt(1.0 - ZETA**2)
AT = 2.0 * OMEGA_D
BOUNDS = ((1.9, 2.08), (0.28, 0.4))
FEW = vi.Steps(first=0.2, points=100)


def closed(omega: Any) -> OnceAPeriod:
    return once_a_period(omega, ZETA, R)


def slope_at_the_point() -> tuple[float, float, float]:
    """d(a)/d(omega), b and d(kappa)/d(omega) where omega_d T = pi."""
    t = math.pi / OMEGA_D
    rate = -2.0 * math.pi / AT**2  # dT / d(omega)
    decay = math.exp(-ZETA * t)
    a = -(1.0 + R) * decay * rate / (1.0 + decay) ** 2
    b = 1.0 - (1.0 + R) * decay / (1.0 + decay)
    kappa = -(AT**2) * (1.0 + R) * decay * rate / (1.0 + R * decay) ** 2
    return a, b, kappa


@cache
def fold() -> vi.BifurcationCurve:
    """SN of the oscillator."""
    system = vi.ImpactOscillator(zeta=ZETA, omega=1.95, restitution=R, clearance=0.3)
    orbit = vi.find_orbit(system, vi.State((0.0,), (0.0,)))
    branch = vi.continue_orbit(orbit, "clearance", (0.3, 0.45))
    return vi.continue_bifurcation(branch["SN1"], ("omega", "clearance"), BOUNDS, steps=FEW)


@cache
def at_fold() -> tuple[vi.BifurcationCurve, ...]:
    found = vi.switch_curve(fold()["ZERO_1"], steps=vi.Steps(first=0.2, points=40))
    assert isinstance(found, tuple), found
    return found


def exponent(away: Any, size: Any) -> float:
    return float(np.polyfit(np.log(np.abs(away)), np.log(np.abs(size)), 1)[0])


@pytest.mark.slow
def test_fold_and_flip_end_at_zero_speed_where_half_a_period_of_vibration_fits() -> None:
    zero, flip = at_fold()
    assert (zero.kind, flip.kind) == ("ZERO", "PD")
    for curve in (fold(), flip):
        at = curve["ZERO_1"].parameters
        assert at["omega"] == pytest.approx(AT, abs=1e-9)
        assert at["clearance"] == pytest.approx(closed(AT).amplitude, abs=1e-9)
        # what vanishes with the closing rate is no point of another name; c has a pole there
        assert {part.name for part in curve.curve.unresolved} <= {"cubic"}
        assert "ZERO" in {p.kind for p in curve.special_points} <= {"ZERO", "GR"}


@pytest.mark.slow
def test_all_three_curves_are_those_of_the_closed_form() -> None:
    zero, flip = at_fold()
    for curve in (zero, flip, fold()):
        omega, g = curve.values.T
        e = closed(omega)
        expected = {
            "ZERO": e.amplitude,
            "SN": e.fold,
            "PD": e.flip,
        }[curve.kind]
        np.testing.assert_allclose(g, expected, rtol=0.0, atol=1e-9)
        assert omega.min() < AT < omega.max()


def test_the_coefficients_of_contact_are_those_of_the_closed_form() -> None:
    a, b, kappa = slope_at_the_point()
    amplitude = closed(AT).amplitude
    expected = {  # of the difference of clearances, by expansion of the closed forms
        "SN": -amplitude * (a * AT / b) ** 2 / 2.0,
        "PD": amplitude * (a * kappa + (b * kappa / AT) ** 2 / 2.0),
    }
    for curve in (fold(), at_fold()[1]):
        form = curve["ZERO_1"].normal_form
        assert (form.along, form.across, form.order) == ("omega", "clearance", 2)
        assert form.at == pytest.approx(AT, abs=1e-9)
        # the point is known to 1e-9, and its multipliers are infinite: half of the digits are asked for
        assert form.coefficient == pytest.approx(expected[curve.kind], rel=1e-7)


def test_the_impact_speed_grows_as_the_square_root_of_the_distance_from_the_touch() -> None:
    for curve in (fold(), at_fold()[1]):
        t = curve.values[:, 0] - AT
        near = np.flatnonzero((np.abs(t) < 0.04) & (np.abs(t) > 1e-4))
        assert len(near) > 6
        distance = closed(curve.values[near, 0]).amplitude - curve.values[near, 1]
        after = np.array([curve.orbit(int(k)).states[0, 1] for k in near])
        # the next terms are t times what those at one side differ from the coefficient
        off = np.abs(distance / t[near] ** 2 / curve["ZERO_1"].normal_form.coefficient - 1.0).max()
        assert off < 0.1
        assert exponent(t[near], distance) == pytest.approx(2.0, abs=off)
        assert exponent(distance, after) == pytest.approx(0.5, abs=off)


def test_the_sides_of_both_kinds_of_motions_are_those_of_the_closed_form() -> None:
    sides = tuple(int(-np.sign(closed(AT + step).a)) for step in (-0.05, 0.05))  # g - A = -a V
    a, b, kappa = slope_at_the_point()
    for curve in (fold(), at_fold()[1]):
        point = curve["ZERO_1"]
        form = point.normal_form
        assert form.impacts == (1, 0)
        assert form.own_sides == sides
        assert form.other_sides == (1, 1)  # without impacts: the amplitude is below the clearance
        speed = {"SN": -a / b, "PD": kappa}[curve.kind]  # V / (t g), up to a factor above zero
        assert form.admissible_side == np.sign(speed)
        half = form.admissible_side * (curve.values[:, 0] - AT)
        assert curve.admissible[(half > 0.0) & (half < 0.05)].all()
        assert not curve.admissible[half < 0.0].any()
        assert "non-smooth fold" in form.meaning
        assert "one becomes the other" in form.meaning
        assert "without its only impact" in form.why_not


def test_the_gap_of_the_motion_without_impacts_changes_as_its_amplitude() -> None:
    zero = at_fold()[0]
    for k in (0, len(zero) - 1):  # at the point itself places and velocities are decoupled
        omega = float(zero.values[k, 0])
        plane, z = zero.problem.equations, zero.problem.parts(zero.curve.z[k], 0.0)[0]
        assert isinstance(plane, OrbitPlane)
        a = (omega, float(zero.values[k, 1]))
        slope = 2.0 * omega * (1.0 - omega**2) - 4.0 * ZETA**2 * omega
        slope *= closed(omega).amplitude ** 3  # dA / d(omega)
        # relative to the residual of a solution, 1e-10
        assert free_gap_rate(plane, z, a, 0) == pytest.approx(-slope, rel=1e-8)
        assert free_gap_rate(plane, z, a, 1) == pytest.approx(1.0, rel=1e-8)


# ---- the impact damper ---------------------------------------------------------------------------

AXES = ("omega", "restitution")
DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, half_clearance=5.0, restitution=0.35, omega=0.7
)


@cache
def damper() -> tuple[vi.Branch, vi.Branch]:
    """1-1-1 orbits that are not symmetric, and 1-2-1 orbits that begin where they graze."""
    symmetric = vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.66, 0.7))
    once = vi.switch_branch(symmetric["BP1"], (0.62, 0.68), inadmissible=True)
    assert isinstance(once, vi.Branch)
    twice = vi.switch_branch(once["GR1"], (0.64, 0.65))
    assert isinstance(twice, vi.Branch)
    return once, twice


def across_at(curve: vi.BifurcationCurve, along: int, value: float) -> float:
    """The other parameter on a curve, from the nearest points by a polynomial."""
    x = curve.values[:, along] - value
    near = np.argsort(np.abs(x))[:7]
    scale = np.abs(x[near]).max()
    return float(np.polyfit(x[near] / scale, curve.values[near, 1 - along], 6)[-1])


def switched(point: vi.BifurcationPoint, **options: Any) -> tuple[vi.BifurcationCurve, ...]:
    found = vi.switch_curve(point, **options)
    assert isinstance(found, tuple), found
    return found


@pytest.mark.slow
def test_the_fold_of_the_damper_is_tangent_to_its_touch() -> None:
    once, twice = damper()
    bounds = ((0.64, 0.65), (0.27, 0.36))
    curve = vi.continue_bifurcation(twice["SN1"], AXES, bounds, steps=FEW)
    form = curve["ZERO_1"].normal_form
    assert (form.along, form.order, form.impacts) == ("restitution", 2, (3, 2))
    i = AXES.index(form.along)
    (touch,) = switched(curve["ZERO_1"], steps=vi.Steps(points=30))
    steps = np.array([0.004, 0.016])
    parted = np.array(
        [
            [across_at(touch, i, form.at + s) - across_at(curve, i, form.at + s) for s in (-h, h)]
            for h in steps
        ]
    )
    # odd terms of the next order cancel in the mean of both sides; their square is what is left
    odd = np.abs(parted[:, 1] - parted[:, 0]) / np.abs(parted.sum(axis=1))
    mean = parted.mean(axis=1)
    assert mean[0] / steps[0] ** 2 == pytest.approx(form.coefficient, rel=4.0 * odd[0] ** 2)
    assert exponent(steps, mean) == pytest.approx(2.0, abs=4.0 * odd[1] ** 2)
    # the fold is one of motions for larger restitution: there both orbits lie beyond the touch, as the branches do
    assert form.admissible_side == 1
    graze = once["GR1"].parameter
    inside = once.curve.parameter[once.admissible]
    assert (np.sign(twice.curve.parameter[1] - graze), np.sign(inside.mean() - graze)) == (
        form.own_sides[1],
        form.other_sides[1],
    )
    assert form.own_sides[0] == -form.own_sides[1]
    assert form.other_sides[0] == form.other_sides[1]
    assert "orbits with 2 impacts have no SN there" in form.why_not


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["GR", "ZERO"])
def test_the_touch_of_doubled_orbits_begins_tangent_to_the_flip(kind: str) -> None:
    once, twice = damper()
    branch, bounds = {
        "GR": (once, ((0.62, 0.65), (0.34, 0.48))),
        "ZERO": (twice, ((0.63, 0.66), (0.26, 0.36))),
    }[kind]
    flips = vi.continue_bifurcation(branch["PD1"], AXES, bounds, steps=FEW)
    point = flips[f"{kind}_1"]
    form = point.normal_form
    assert (form.order, form.admissible_side) == (1, 1)
    assert [str(new) for new in form.switchable] == [kind, f"{kind} of period 2"]
    i = AXES.index(form.along)
    touch, doubled = switched(point, steps=vi.Steps(points=30))
    assert doubled.kind == kind
    h = 1e-3  # the two curves of (1) cross: their slopes differ by the coefficient
    parted = [across_at(touch, i, form.at + s) - across_at(flips, i, form.at + s) for s in (-h, h)]
    assert (parted[1] - parted[0]) / (2.0 * h) == pytest.approx(form.coefficient, rel=h)
    t = np.abs(doubled.values[:, i] - form.at)
    near = np.argsort(t)[:8]
    assert doubled.admissible[near].all()
    distance = np.array(
        [doubled.values[k, 1 - i] - across_at(flips, i, doubled.values[k, i]) for k in near]
    )
    other = np.array([_of_other_turn(doubled.orbit(int(k)), point) for k in near])
    for size, power in ((distance, 2.0), (other, 1.0)):
        law = (
            size / t[near] ** power
        )  # c (1 + k t + ...): its changes are the terms of the next order
        off = float(np.ptp(law) / np.abs(law).min() * t[near].max() / np.ptp(t[near]))  # k t
        assert off < 0.1
        assert exponent(t[near], size) == pytest.approx(power, abs=off)


def _of_other_turn(orbit: vi.Orbit, point: vi.BifurcationPoint) -> float:
    """Gap, or closing rate, of the turn that does not touch."""
    turn = len(point.orbit.durations)
    if point.nearest is None:
        rates = orbit.problem.linearised(
            orbit.problem.packed(orbit.states, orbit.durations), orbit.parameter_value
        ).rate
        return float(max(np.abs(rates[[point.segment, point.segment + turn]])))
    first = point.nearest.place
    return max(orbit.gaps[p].gap for p in (first, first._replace(segment=first.segment + turn)))


# ---- two masses that do not act on each other ----------------------------------------------------


def apart(u: float, w: float) -> vi.Mechanism:
    """Two oscillators with stops at u + w and u - w; only the first one's orbit doubles."""
    return vi.Mechanism(
        mass=((1.0, 0.0), (0.0, 1.0)),
        damping=((2.0 * ZETA, 0.0), (0.0, 0.3)),
        stiffness=((1.0, 0.0), (0.0, 2.0)),
        forces=(vi.Harmonic(2.1, (1.0, 1.0)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=u + w, restitution=R),
            vi.RigidStop((0.0, 1.0), upper=u - w, restitution=0.6),
        ),
    )


@pytest.mark.slow
def test_where_orbits_with_one_impact_more_are_critical_too_their_curve_is_followed() -> None:
    reach = 1.0 / math.hypot(2.0 - 2.1**2, 0.3 * 2.1)  # amplitude of the second mass
    far, near = (
        vi.Family(apart, u=(0.25 + stop) / 2.0, w=(0.25 - stop) / 2.0)
        for stop in (reach + 0.4, reach + 0.03)
    )
    start = vi.find_orbit(near, vi.find_orbit(far, vi.State((0.0, 0.0), (0.0, 0.0))))
    flip = vi.continue_orbit(start, "w", (-0.12, -0.05), inadmissible=True)["PD1"]
    bounds, few = ((0.33, 0.37), (-0.1, -0.04)), vi.Steps(first=0.2, points=30)
    flips = vi.continue_bifurcation(flip, ("u", "w"), bounds, steps=few)
    point = flips["GR_1"]
    form = point.normal_form
    # u - w = reach on the touch, u + w is constant on PD
    assert (form.order, form.impacts, form.why_not) == (1, (1, 2), "")
    assert {form.along: form.coefficient} in ({"u": pytest.approx(2.0)}, {"w": pytest.approx(2.0)})
    touch, more = switched(point, steps=few)  # the doubling does not move the second mass
    np.testing.assert_allclose(touch.values @ (1.0, -1.0), reach, rtol=0.0, atol=1e-9)
    assert (more.kind, len(more.orbit(0).durations)) == ("PD", 2)
    np.testing.assert_allclose(more.values.sum(axis=1), flips.values[0].sum(), rtol=0.0, atol=1e-9)
