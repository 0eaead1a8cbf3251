"""Tongues of locked orbits, against planted normal forms and simulation."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi

E5 = 0.3  # coefficient of conj(z)^4


def planted(x: Any, p: Any) -> list[Any]:
    """z -> e^(2 pi i / 5) ((1 + a + i b) z - z |z|^2 + e conj(z)^4), in real coordinates."""
    u, v = x
    square = u * u + v * v
    re = (1.0 + p[0] - square) * u - p[1] * v
    im = (1.0 + p[0] - square) * v + p[1] * u
    c2, s2 = u * u - v * v, -2.0 * u * v  # conj(z)^2
    re, im = re + E5 * (c2 * c2 - s2 * s2), im + E5 * 2.0 * c2 * s2
    c, s = math.cos(2.0 * math.pi / 5.0), math.sin(2.0 * math.pi / 5.0)
    return [c * re - s * im, s * re + c * im]


@cache
def of_the_map() -> vi.Tongue:
    model = vi.ExplicitMap(planted, dimension=2, parameters=("a", "b"))
    start = vi.map_bifurcation("NS", model, (0.0, 0.0), (-0.02, 0.2))
    curve = vi.continue_bifurcation(start, ("a", "b"), ((-0.3, 0.3), (-0.3, 0.3)))
    found = vi.tongue(curve["1/5_1"])
    assert isinstance(found, vi.Tongue)
    return found


@pytest.mark.slow
def test_both_sides_of_a_planted_tongue_obey_its_normal_form() -> None:
    # locked orbits solve a + i b - r^2 + e r^3 exp(-5 i phi) = 0: the sides are b = +-e a^(3/2) to leading order
    sides = of_the_map().sides
    signs = set()
    for side in sides:
        near = (side.values[:, 0] > 0.01) & (side.values[:, 0] < 0.03)
        a, b = side.values[near].T
        assert a.size
        signs |= set(np.sign(b))
        # the next order is relative a^(1/2), with a constant of order one
        np.testing.assert_allclose(np.abs(b) / a**1.5, E5, rtol=0.2)
        scaled = (np.abs(b) / a**1.5 - E5) / np.sqrt(a)
        assert np.ptp(scaled) < np.abs(scaled).max()  # it is that order
    assert signs == {-1.0, 1.0}


def test_sides_of_a_tongue_are_folds_of_orbits_of_its_period() -> None:
    for side in of_the_map().sides:
        assert np.abs(side.multipliers - 1.0).min(axis=1).max() < 1e-6
        assert side.problem.equations.map.iterate == 5  # type: ignore[attr-defined]


PLANE = ("omega", "half_clearance")
SETS = {  # of the paper: a damper beside the curve, ranges, the resonance, and a clearance in the tongue
    "A": (
        vi.ImpactDamper(
            mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=10.6, omega=0.93
        ),
        ((0.85, 0.95), (9.0, 10.7)), "2/9_1", 9.2,
    ),
    "B": (
        vi.ImpactDamper(
            mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=9.8, omega=1.0
        ),
        ((0.95, 1.03), (8.5, 10.5)), "1/5_1", 9.0,
    ),
}  # fmt: skip


@cache
def of_the_damper(name: str) -> vi.Tongue:
    damper, bounds, label, _ = SETS[name]
    branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", bounds[0])
    start = next(p for p in branch.special_points if p.kind == "NS")
    found = vi.tongue(vi.continue_bifurcation(start, PLANE, bounds)[label])
    assert isinstance(found, vi.Tongue)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("name", "distance"), [("A", 0.3), ("B", 0.125)])
def test_a_tongue_narrows_with_the_power_of_its_period(name: str, distance: float) -> None:
    # width ~ r^(q - 2) and distance ~ r^2: exponent (q - 2) / 2, approached from above
    tongue = of_the_damper(name)
    tip = tongue.tip.parameters["half_clearance"]
    near, far = tongue.width(tip - distance), tongue.width(tip - 2.0 * distance)
    law = (tongue.resonance[1] - 2) / 2
    assert law < math.log(far / near) / math.log(2.0) < law + 0.4


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_motion_is_locked_inside_a_tongue_and_not_outside(name: str) -> None:
    tongue = of_the_damper(name)
    damper, _, _, clearance = SETS[name]
    low, high = sorted(float(np.interp(clearance, *_sorted(side))) for side in tongue.sides)
    shares = np.array([-1.0, -0.4, -0.1, 0.1, 0.5, 0.9, 1.1, 1.4, 2.0])
    swept = vi.sweep(
        replace(damper, half_clearance=clearance),
        start=vi.State((0.0, 0.0), (0.0, 1.0)),
        over={"omega": low + shares * (high - low)},
        settle_periods=30_000,
        periods=400,
        progress=False,
    )
    inside = (shares > 0.0) & (shares < 1.0)
    q = tongue.resonance[1]
    for count in (
        swept.n,
        swept.p,
        swept.q,
    ):  # q half maps of a symmetric orbit: q impacts at each stop
        np.testing.assert_array_equal(count.values, np.where(inside, q, 0))


def _sorted(side: vi.BifurcationCurve) -> tuple[np.ndarray, np.ndarray]:
    """The part of a side that begins at the tip, by rising clearance."""
    values = side.values if side.values[0, 1] > side.values[-1, 1] else side.values[::-1]
    down = values[: int(np.argmin(values[:, 1])) + 1][::-1]
    return down[:, 1], down[:, 0]


@pytest.mark.slow
def test_the_tongue_of_a_stop_that_moves_is_that_of_its_own_coordinates() -> None:
    """Seen from the stop, the second mass is driven by its mass times the acceleration of the stop."""
    damper, bounds, label, _ = SETS["B"]
    sine, cosine = 4e-4, 1e-3

    def moving(omega: float = 1.0, half_clearance: float = 9.8) -> vi.Mechanism:
        m = replace(damper, omega=omega, half_clearance=half_clearance).mechanism
        line = vi.Harmonic(omega, (sine,), (cosine,))
        return m.replace(elements=(replace(m.elements[0], motion=line),))

    def still(omega: float = 1.0, half_clearance: float = 9.8) -> vi.Mechanism:
        m = replace(damper, omega=omega, half_clearance=half_clearance).mechanism
        force, a = m.forces[0], m.mass[1][1] * omega * omega
        line = vi.Harmonic(omega, (force.sine[0], a * sine), (force.cosine[0], a * cosine))
        return m.replace(forces=(line,))

    widths = []
    for make in (moving, still):
        orbit = vi.find_orbit(vi.Family(make), vi.symmetric_orbits(damper)[0])
        start = vi.continue_orbit(orbit, "omega", bounds[0])["NS1"]
        found = vi.tongue(vi.continue_bifurcation(start, PLANE, bounds)[label])
        assert isinstance(found, vi.Tongue), found
        widths.append([found.width(clearance) for clearance in (8.8, 9.2, 9.6)])
    # Sides are interpolated between points that are 0.01 to 0.1 apart: their third differences.
    np.testing.assert_allclose(*widths, rtol=1e-6)


def test_only_weak_resonances_have_tongues() -> None:
    model = vi.ExplicitMap(planted, dimension=2, parameters=("a", "b"))
    start = vi.map_bifurcation("NS", model, (0.0, 0.0), (-0.02, 0.2))
    curve = vi.continue_bifurcation(start, ("a", "b"), ((-0.5, 0.3), (-0.5, 0.6)))
    strong = next(p for p in curve.special_points if p.kind == "R4")
    with pytest.raises(vi.InvalidParameterError, match="weak resonances"):
        vi.tongue(strong)
    with pytest.raises(vi.InvalidParameterError, match="must hold"):
        vi.tongue(curve["1/5_1"], ((0.1, 0.2), (-0.3, 0.3)))
