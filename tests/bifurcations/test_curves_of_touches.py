"""Points of codimension two on curves of touches, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi

ZETA, R = 0.1, 0.7
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
    e = closed(omega, ZETA)
    expected = e[2] / math.hypot(1.0 + e[0] * e[3], e[1] * e[3] / omega)
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


def closed(omega: float, zeta: float) -> tuple[float, float, float, float]:
    """a, b, A and kappa of test_grazing_contacts.py."""
    w, t = math.sqrt(1.0 - zeta**2), 2.0 * math.pi / omega
    decay = math.exp(-zeta * t)
    q = decay * complex(math.cos(w * t), math.sin(w * t))
    s = q / (1.0 - q)
    a = (1.0 + R) * s.imag / w
    b = 1.0 + (1.0 + R) * (s.real - zeta * s.imag / w)
    kick = (1.0 + R) * decay * math.sin(w * t) / w
    rest = 1.0 + (R * decay) ** 2 - 2.0 * R * decay * math.cos(w * t)
    kappa = omega**2 * kick / (rest + kick * ((1.0 - omega**2) * a + 2.0 * zeta * b))
    return a, b, 1.0 / math.hypot(1.0 - omega**2, 2.0 * zeta * omega), kappa
