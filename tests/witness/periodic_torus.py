"""A Neimark-Sacker point of an orbit of the damper with any impacts.

Orbit and point come from the mechanism (Taylor series), the map and its derivatives from the
closed-form flights of the damper, in (v1+, x1, v2+, theta) just after an impact at stop A, where
the signature must begin.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from .multilinear import stencil
from .periodic import multipliers, phase, solve
from .periodic_damper import around, normal_form
from .precision import Real, mp

if TYPE_CHECKING:
    from .damper import Damper, Stop
    from .multilinear import NeimarkSacker, Vector
    from .periodic import Orbit
    from .periodic_cases import Special

STOPS: dict[str, Stop] = {"upper": "A", "lower": "B"}


@dataclass(frozen=True)
class OrbitTorus:
    """The point, the orbit there, the section's point, and what `periodic_damper.Torus` has."""

    omega: Real
    orbit: Orbit
    point: Vector
    form: NeimarkSacker
    growth: Real
    turning: Real


def speeds(case: Special, omega: Real, o: Orbit, nu: Real) -> tuple[Real, Real]:
    """d|nu|/d omega and d arg nu/d omega, by a central difference."""
    h, logs, last = mp.mpf(10) ** (-(mp.dps // 3)), [], o.after[-1]
    for w in (omega + h, omega - h):
        beside = solve(
            case.build(w), case.signature, case.cycles, [*last.q, *last.v, phase(last)], o.times
        )
        logs.append(mp.log(min(multipliers(beside), key=lambda v: abs(v - nu))))
    rate = (logs[0] - logs[1]) / (2 * h)
    return rate.real, rate.imag


def orbit_torus(case: Special, damper: Damper) -> OrbitTorus:
    """The normal form at a special point; `damper` is the same system at any frequency."""
    omega, o = case.found()
    z, here = o.after[0], replace(damper, omega=omega)
    assert case.signature[0] == (0, "upper")
    stops = [STOPS[side] for _, side in (*case.signature[1:], case.signature[0])]
    times = [*o.times[1:], o.times[0]]
    point = [z.v[0], z.q[0], z.v[1], phase(z)]
    nu = max(multipliers(o), key=lambda v: (round(float(abs(v)), 12), v.imag))
    form = normal_form(stencil(lambda p: around(here, p, stops, times, case.cycles), point), nu)
    return OrbitTorus(omega, o, point, form, *speeds(case, omega, o, form.nu))
