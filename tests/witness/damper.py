"""The impact damper in high precision: every event from closed forms.

    x1'' + 2 zeta omega_n x1' + omega_n^2 x1 = force sin(theta),  x2'' = 0            (1)
    u = x2 - x1;  gaps: A, delta - u;  B, delta + u;  both positive in flight
    impact: v1 + mu v2 is kept, v2+ - v1+ = -R (v2- - v1-)                            (2)
    stuck to a stop, the masses are one:
        (1 + mu) x1'' + 2 zeta omega_n x1' + omega_n^2 x1 = force sin(theta)          (3)
        until x1'' changes sign (x1'' < 0 at A and > 0 at B while the contact pushes)

Chatter is simulated impact by impact down to departing speeds w near 1e-20; the rest takes

    T = 2 w / (a (1 - R)) (1 - (b w / a + 2 a' w / a^2) / (3 (1 - R))) + O(w^3)       (4)

with a the closing acceleration of the stuck pair's free parts, a' its rate along (3), and
b = 2 zeta omega_n mu / (1 + mu), because g'' = -a - a' t - b g' + O(w^2) near the stop;
their mean motion over T is (3) up to O(w^3).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from .oscillator import Motion, Oscillator, start
from .precision import Real, exact, mp
from .striding import first_root

Stop = Literal["A", "B"]
STOPS: tuple[Stop, Stop] = ("A", "B")
SIGN = {"A": -1, "B": 1}  # the gap is delta + SIGN u

PAPER_SETS = {
    "A": {
        "mass_ratio": "0.1", "omega_n": "0.5", "zeta": "0.045",
        "restitution": "0.8", "half_clearance": "5",
    },
    "B": {
        "mass_ratio": "0.04", "omega_n": "0.6", "zeta": "0.025",
        "restitution": "0.7", "half_clearance": "8",
    },
    "C": {
        "mass_ratio": "0.05092", "omega_n": "1", "zeta": "0.015",
        "restitution": "0.7", "half_clearance": "6",
    },
}  # fmt: skip

CHATTER_SPEED = "1e-20"  # below this departing speed (4) may take over,
CHATTER_TERM = "1e-15"  # once the correction in (4) is this small; its square is neglected


@dataclass(frozen=True, kw_only=True)
class Damper:
    """Parameters of (1), (2). Doubles are taken exactly, strings as decimals."""

    mass_ratio: Real
    omega_n: Real
    zeta: Real
    restitution: Real
    half_clearance: Real
    omega: Real
    force: Real = 1
    apart: Oscillator = field(init=False, repr=False)
    together: Oscillator = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in (
            "mass_ratio", "omega_n", "zeta", "restitution", "half_clearance", "omega", "force",
        ):  # fmt: skip
            object.__setattr__(self, name, exact(getattr(self, name)))
        sigma, k, whole = self.zeta * self.omega_n, self.omega_n**2, 1 + self.mass_ratio
        object.__setattr__(self, "apart", Oscillator(sigma, k, self.force, self.omega))
        joined = Oscillator(sigma / whole, k / whole, self.force / whole, self.omega)
        object.__setattr__(self, "together", joined)


def paper_set(name: Literal["A", "B", "C"], omega: Real) -> Damper:
    """One of the paper's parameter sets, as decimals."""
    return Damper(**PAPER_SETS[name], omega=omega)


@dataclass(frozen=True)
class State:
    """Positions, velocities and the forcing phasor s = sin(theta), c = cos(theta)."""

    x1: Real
    v1: Real
    x2: Real
    v2: Real
    s: Real
    c: Real

    @property
    def phase(self) -> Real:
        """The phase theta in [0, 2 pi)."""
        return mp.atan2(self.s, self.c) % (2 * mp.pi)


def state(
    x1: Real, v1: Real, x2: Real, v2: Real, *, phase: Real = None, phasor: Real = None
) -> State:
    """Make a state from a phase, or from a phasor (s, c) as it stands, of any length."""
    if (phase is None) == (phasor is None):
        raise TypeError("give either phase or phasor")
    if phasor is None:
        cos, sin = mp.cos_sin(exact(phase))
        phasor = (sin, cos)
    return State(*map(exact, (x1, v1, x2, v2, *phasor)))


def on_stop(damper: Damper, z: State, stop: Stop) -> State:
    """Put the free mass exactly on a stop (a double can only be near it)."""
    return State(z.x1, z.v1, z.x1 - SIGN[stop] * damper.half_clearance, z.v2, z.s, z.c)


def gap(damper: Damper, z: State, stop: Stop) -> Real:
    """Distance to a stop."""
    return damper.half_clearance + SIGN[stop] * (z.x2 - z.x1)


def gap_rate(z: State, stop: Stop) -> Real:
    """Its rate: negative approaches."""
    return SIGN[stop] * (z.v2 - z.v1)


def _apart(damper: Damper, z: State) -> Motion:
    return start(damper.apart, z.x1, z.v1, z.s, z.c)


def flight(damper: Damper, z: State, t: Real) -> State:
    """The state a time `t` later, both masses free: the solution of (1)."""
    m = _apart(damper, z).at(exact(t))
    return State(m.derivative(0), m.derivative(1), z.x2 + z.v2 * exact(t), z.v2, *m.phasor)


def sticking(damper: Damper, z: State, t: Real) -> State:
    """The state a time `t` later, stuck together: the solution of (3)."""
    m = start(damper.together, z.x1, z.v1, z.s, z.c).at(exact(t))
    x, v = m.derivative(0), m.derivative(1)
    return State(x, v, x + z.x2 - z.x1, v, *m.phasor)


@dataclass(frozen=True)
class Contact:
    """The end of a flight: when, at which stop, and the state just before."""

    time: Real
    stop: Stop
    before: State
    grazing: bool


def first_contact(
    damper: Damper, z: State, *, t_max: Real, from_stop: Stop | None = None, order: int = 1
) -> Contact | None:
    """Find the first contact of a flight, or None where there is none up to `t_max`.

    A start on a stop is put on it exactly. `order` is that of the first derivative of its gap
    that is not zero: 1 after an impact, 2 at rest on the stop, 3 at a release from sticking.
    """
    speed = abs(gap_rate(z, from_stop)) if from_stop and order == 1 else mp.mpf(1)
    extra = 0 if not 0 < speed < 1 else int(-2 * mp.log10(speed)) + 1
    with mp.extradps(extra):  # gaps of a slow flight are of the order of the speed squared
        z = on_stop(damper, z, from_stop) if from_stop else z
        motion = _apart(damper, z)
        t = _first_stride(damper, z, motion, from_stop, order)

        def samples(t: Real) -> list[tuple[Real, Real, Real]]:
            m = motion.at(t)
            u, rate = z.x2 + z.v2 * t - m.derivative(0), z.v2 - m.derivative(1)
            bound = m.bound(2)
            return [(damper.half_clearance + sg * u, sg * rate, bound) for sg in (-1, 1)]

        noise = mp.mpf(10) ** (5 - mp.dps) * (1 + abs(z.x1) + abs(z.x2) + damper.half_clearance)
        found = first_root(samples, t, exact(t_max), noise)
        if found is None:
            return None
        time, which = found
        _, slope, bound = samples(time)[which]
        before = flight(damper, z, time)
    return Contact(+time, STOPS[which], before, slope**2 <= 16 * bound * noise)


def _first_stride(damper: Damper, z: State, motion: Motion, stop: Stop | None, order: int) -> Real:
    """The stretch at the start that (2) of `striding` proves free of contacts."""
    other = [name for name in STOPS if name != stop]
    if any(gap(damper, z, name) <= 0 for name in other):
        raise ValueError("the start is on or beyond a stop it was not said to be on")
    if stop is None:
        return mp.mpf(0)
    leading = gap_rate(z, stop) if order == 1 else -SIGN[stop] * motion.derivative(order)
    if leading <= 0:
        raise ValueError("the start does not leave its stop")
    t = leading / (2 * motion.bound(order + 1))
    span = gap(damper, z, other[0])  # the other stop is out of reach for at least this long
    reach = span / (2 * (abs(z.v2 - z.v1) + mp.sqrt(span * motion.bound(2))))
    return min(t, reach)


def impact(damper: Damper, before: State) -> State:
    """The state after an impact: (2) solved for the velocities."""
    mu = damper.mass_ratio
    mean = (before.v1 + mu * before.v2) / (1 + mu)
    u = -damper.restitution * (before.v2 - before.v1)
    v1, v2 = mean - mu * u / (1 + mu), mean + u / (1 + mu)
    return State(before.x1, v1, before.x2, v2, before.s, before.c)


@dataclass(frozen=True)
class Event:
    """What happened, when (since the start), at which stop, and the states around it."""

    kind: Literal["impact", "grazing", "chatter", "release"]
    time: Real
    stop: Stop
    before: State
    after: State


def chatter_end(damper: Damper, z: State, stop: Stop) -> tuple[Real, State] | None:
    """Complete a chatter by (4): time it takes and stuck state, or None where not yet allowed."""
    w, mu, R = gap_rate(z, stop), damper.mass_ratio, damper.restitution
    mean = (z.v1 + mu * z.v2) / (1 + mu)
    stuck = start(damper.together, z.x1, mean, z.s, z.c)
    a = (1 + mu) * stuck.derivative(2) * SIGN[stop]
    if a <= 0 or w > mp.mpf(CHATTER_SPEED):
        return None
    rate = (1 + mu) * stuck.derivative(3) * SIGN[stop]
    b = 2 * damper.zeta * damper.omega_n * mu / (1 + mu)
    term = (b * w / a + 2 * rate * w / a**2) / (3 * (1 - R)) if R < 1 else mp.inf
    if abs(term) > mp.mpf(CHATTER_TERM):
        return None
    T = 2 * w / (a * (1 - R)) * (1 - term)
    merged = State(z.x1, mean, z.x2, mean, z.s, z.c)
    return T, sticking(damper, on_stop(damper, merged, stop), T)


def release(damper: Damper, z: State, stop: Stop, *, t_max: Real) -> tuple[Real, State] | None:
    """Find when the contact force of a stuck pair changes sign: the first root of x1''."""
    motion = start(damper.together, z.x1, z.v1, z.s, z.c)
    sg = SIGN[stop]

    def samples(t: Real) -> list[tuple[Real, Real, Real]]:
        m = motion.at(t)
        return [(sg * m.derivative(2), sg * m.derivative(3), m.bound(4))]

    noise = mp.mpf(10) ** (5 - mp.dps) * motion.bound(2)
    found = first_root(samples, mp.mpf(0), exact(t_max), noise)
    return (found[0], sticking(damper, z, found[0])) if found else None


def simulate(
    damper: Damper, z: State, impacts: int, *, t_max: Real = 10**6, from_stop: Stop | None = None
) -> list[Event]:
    """Follow a motion through impacts, completed chatter, sticking and release."""
    events: list[Event] = []
    now, order, count = mp.mpf(0), 1, 0
    while count < impacts and now < t_max:
        ended = chatter_end(damper, z, from_stop) if from_stop and order < 3 else None
        if ended and from_stop:
            now += ended[0]
            events.append(Event("chatter", now, from_stop, z, ended[1]))
            freed = release(damper, ended[1], from_stop, t_max=t_max)
            if freed is None:
                break
            now, z, order = now + freed[0], freed[1], 3
            events.append(Event("release", now, from_stop, z, z))
            continue
        contact = first_contact(damper, z, t_max=t_max - now, from_stop=from_stop, order=order)
        if contact is None:
            break
        now, from_stop, count = now + contact.time, contact.stop, count + 1
        z = on_stop(damper, impact(damper, contact.before), from_stop)
        order = 1 if gap_rate(z, from_stop) > 0 else 2
        kind: Literal["impact", "grazing"] = "grazing" if contact.grazing else "impact"
        events.append(Event(kind, now, from_stop, contact.before, z))
        if contact.grazing:
            break
    return events
