"""Maps of the impact damper through prescribed impacts, near its symmetric 1-1-1 orbits.

In the section on stop A just after impact, z = (v1+, x1, v2+, theta) and x2 = x1 + delta:

    leg     fly until the gap at the named stop vanishes, by Newton from a guess, impact    (1)
    H       leg to B, then (x, v, theta) -> (-x, -v, theta - pi)                              (2)
    P       leg to B, leg to A, theta -> theta - 2 pi;  P = H^2                               (3)

Parameters may follow z as further coordinates, so that one stencil differentiates by both; the
section coordinates stay fixed while a parameter changes, and x2 moves with delta.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from .bifurcations import at_omega
from .damper import SIGN, State, flight, gap, gap_rate, impact
from .multilinear import NeimarkSacker, Stencil, form, jacobian, neimark_sacker, stencil
from .precision import Real, exact, mp
from .symmetric import half_multipliers, orbit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .damper import Damper, Stop
    from .multilinear import Vector
    from .symmetric import Orbit

Which = Literal["half", "full"]
STATE = range(4)  # the coordinates of z


def leg(damper: Damper, z: State, stop: Stop, time: Real) -> tuple[State, Real]:
    """(1): the state after the impact and the flight time."""
    tolerance = mp.mpf(10) ** (8 - mp.dps)
    for _ in range(50):
        before = flight(damper, z, time)
        change = gap(damper, before, stop) / gap_rate(before, stop)
        time -= change
        if abs(change) < tolerance * time:
            before = flight(damper, z, time)
            return impact(damper, before), time
    raise ArithmeticError("Newton's method does not find the impact")


def on_section(damper: Damper, point: Sequence[Real]) -> State:
    v1, x1, v2, theta = point
    cos, sin = mp.cos_sin(theta)
    return State(x1, v1, x1 - SIGN["A"] * damper.half_clearance, v2, sin, cos)


def coordinates(o: Orbit) -> Vector:
    """z of an orbit."""
    s = o.state
    return [s.v1, s.x1, s.v2, s.phase]


def half_map(damper: Damper, point: Sequence[Real], time: Real) -> Vector:
    """(2), from a guess of the flight time."""
    after, time = leg(damper, on_section(damper, point), "B", time)
    return [-after.v1, -after.x1, -after.v2, point[3] + damper.omega * time - mp.pi]


def around(
    damper: Damper, point: Sequence[Real], stops: Sequence[Stop], times: Sequence[Real], cycles: int
) -> Vector:
    """The map back to stop A through the impacts named, from guesses of the flight times."""
    z, total = on_section(damper, point), mp.mpf(0)
    for stop, guess in zip(stops, times, strict=True):
        z, time = leg(damper, z, stop, guess)
        total += time
    return [z.v1, z.x1, z.v2, point[3] + damper.omega * total - 2 * mp.pi * cycles]


def full_map(damper: Damper, point: Sequence[Real], time: Real) -> Vector:
    """(3), from a guess of each flight time."""
    return around(damper, point, ("B", "A"), (time, time), 1)


def at_orbit(o: Orbit, which: Which, parameters: Sequence[str] = ()) -> Stencil:
    """The stencil of H or P about an orbit, the parameters named being coordinates after z."""
    damper, evaluate = o.damper, half_map if which == "half" else full_map

    def f(z: Vector) -> Vector:
        here = (
            replace(damper, **dict(zip(parameters, z[4:], strict=True))) if parameters else damper
        )
        return evaluate(here, z[:4], o.half_period)

    return stencil(f, coordinates(o) + [getattr(damper, p) for p in parameters])


def normal_form(s: Stencil, near: Real) -> NeimarkSacker:
    """(2) of `multilinear` at the multiplier in the upper half plane near one, or its conjugate."""
    A, B, C = (form(s, k, STATE) for k in (1, 2, 3))
    return neimark_sacker(jacobian(A), B, C, near if near.imag > 0 else mp.conj(near))


@dataclass(frozen=True)
class Torus:
    """A Neimark-Sacker point: normal forms of both maps and how the pair crosses the circle."""

    half: NeimarkSacker
    full: NeimarkSacker
    growth: Real  # d|nu|/d omega
    turning: Real  # d arg nu/d omega

    @property
    def supercritical(self) -> bool:
        return bool(self.half.d.real < 0)

    @property
    def squared_radius(self) -> Real:
        """|z|^2 / (omega - omega_c): its sign is the side on which the circle lies."""
        return -self.growth / self.half.d.real


def torus(damper: Damper, sign: int, near: Real) -> Torus:
    """Both normal forms at a bifurcation; `near` is the multiplier of H."""
    o = orbit(damper, sign)
    assert o is not None
    half = normal_form(at_orbit(o, "half"), near)
    full = normal_form(at_orbit(o, "full"), near**2)
    return Torus(half, full, *speeds(damper, sign, half.nu))


def speeds(damper: Damper, sign: int, nu: Real) -> tuple[Real, Real]:
    """d|nu|/d omega and d arg nu/d omega along the orbits, by a central difference."""
    h, logs = mp.mpf(10) ** (-(mp.dps // 3)), []
    for omega in (damper.omega + h, damper.omega - h):
        o = orbit(at_omega(damper, omega), sign)
        assert o is not None
        logs.append(mp.log(min(half_multipliers(o), key=lambda v: abs(v - nu))))
    rate = (logs[0] - logs[1]) / (2 * h)
    return rate.real, rate.imag


def polished(damper: Damper, sign: int, omega: Real, test: Callable[[Damper, int], Real]) -> Damper:
    """The damper at a root of a test function beside `omega`, good to about 30 digits on entry."""
    guess = exact(omega)
    beside = guess * (1 + mp.mpf(10) ** -25)
    root = mp.findroot(
        lambda w: test(at_omega(damper, w), sign),
        (guess, beside), solver="secant", tol=mp.mpf(10) ** (10 - 2 * mp.dps), verify=False,
    )  # fmt: skip
    return at_omega(damper, root)
