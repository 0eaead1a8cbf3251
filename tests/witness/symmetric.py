"""The symmetric 1-1-1 orbits of the impact damper, derived afresh.

At t = 0 the orbit leaves stop A; at T = pi / omega it reaches B in the mirrored state. With
y = x1(0) + delta the free mass has v2+ = -2 y / T. The impact law at A, where v2- = -v2+, gives

    v1- = kappa- y,  v1+ = kappa+ y                                                   (1)

and antisymmetry of the free part, h(T) = -h(0), h'(T) = -h'(0) + v1+ - v1-, gives the linear system

    (I + E(T)) (h(0), h'(0)) = (0, kappa+ - kappa-) y,   E the flow of the free part   (2)

regular unless E has the eigenvalue -1. So h(0) = a y, h'(0) = b y, and the forced part
A sin(theta + lag) of x1 must supply the rest:

    A sin tau = (1 - a) y - delta,   A omega cos tau = (kappa+ - b) y                  (3)
    (1 + r^2) w^2 - 2 q w + q^2 - 1 = 0,  w = (1 - a) y / A,  q = delta / A            (4)
    r = (kappa+ - b) / (omega (1 - a)),  the paper's h
    w = (q +- sqrt(1 + r^2 - r^2 q^2)) / (1 + r^2)

The half map H goes from stop A to stop B and back by (x, v, theta) -> (-x, -v, theta + pi).
Its derivative in (v1+, x1, v2+, theta), with the flight time from the gap g at the far stop:

    dz(T) = Phi dz(0) + z' dt,  dt = -(grad g . Phi dz(0)) / g'                       (5)
    det DH = R^2 e^(-2 pi zeta omega_n / omega),  P = H^2,  lambda = nu^2             (6)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .damper import Damper, State, first_contact, flight, gap_rate, impact
from .oscillator import Motion, start
from .precision import Real, mp

Matrix = Any  # an mpmath matrix


@dataclass(frozen=True)
class Orbit:
    """A symmetric 1-1-1 orbit: its state after the impact at stop A, and the sign in (4)."""

    damper: Damper
    sign: int
    state: State

    @property
    def half_period(self) -> Real:
        """Time from stop to stop."""
        return mp.pi / self.damper.omega


def free_flow(damper: Damper, t: Real) -> Matrix:
    """E(t) of (2): the flow of the free part of x1."""
    columns = [
        Motion(damper.apart, (0, 0), (0, 1), h).at(t).free
        for h in ((mp.mpf(1), mp.mpf(0)), (mp.mpf(0), mp.mpf(1)))
    ]
    return mp.matrix([[columns[0][0], columns[1][0]], [columns[0][1], columns[1][1]]])


@dataclass(frozen=True)
class Coefficients:
    """The quantities of (1) to (4) that do not depend on the sign."""

    a: Real
    b: Real
    kappa_before: Real
    kappa_after: Real
    amplitude: Real
    q: Real
    r: Real

    @property
    def discriminant(self) -> Real:
        """1 + r^2 - r^2 q^2: orbits exist where it is not negative; zero at a fold."""
        return 1 + self.r**2 * (1 - self.q**2)


def coefficients(damper: Damper) -> Coefficients:
    """Solve (1) and (2)."""
    mu, R, omega = damper.mass_ratio, damper.restitution, damper.omega
    T = mp.pi / omega
    v2 = -2 / T  # per y
    before = v2 * (1 + mu + mu - R) / (1 + R)  # from v2+ of the impact law with v2- = -v2+
    after = before - 2 * mu * v2  # momentum: v1+ + mu v2+ = v1- - mu v2+
    system = free_flow(damper, T) + mp.eye(2)
    det = system[0, 0] * system[1, 1] - system[0, 1] * system[1, 0]
    step = after - before
    a, b = -system[0, 1] * step / det, system[0, 0] * step / det
    amplitude = mp.hypot(*damper.apart.forced())
    q = damper.half_clearance / amplitude
    return Coefficients(a, b, before, after, amplitude, q, (after - b) / (omega * (1 - a)))


def orbit(damper: Damper, sign: int) -> Orbit | None:
    """Solve (3) and (4) for one sign; None where no orbit exists."""
    k = coefficients(damper)
    if k.discriminant < 0:
        return None
    w = (k.q + sign * mp.sqrt(k.discriminant)) / (1 + k.r**2)
    sin_tau, cos_tau = w - k.q, k.r * w
    y = k.amplitude * w / (1 - k.a)
    P, Q = damper.apart.forced()
    cos_lag, sin_lag = P / k.amplitude, Q / k.amplitude  # tau = theta + lag
    s = sin_tau * cos_lag - cos_tau * sin_lag
    c = cos_tau * cos_lag + sin_tau * sin_lag
    x1 = y - damper.half_clearance
    return Orbit(damper, sign, State(x1, k.kappa_after * y, y, -2 * y * damper.omega / mp.pi, s, c))


def half_map(damper: Damper, point: list[Real]) -> list[Real]:
    """H itself, by the certified first contact: (v1+, x1, v2+, theta) to the same."""
    v1, x1, v2, theta = point
    cos, sin = mp.cos_sin(theta)
    z = State(x1, v1, x1 + damper.half_clearance, v2, sin, cos)
    contact = first_contact(damper, z, t_max=10**6, from_stop="A")
    if contact is None or contact.stop != "B":
        raise ValueError("the motion does not go from stop A to stop B")
    after = impact(damper, contact.before)
    return [-after.v1, -after.x1, -after.v2, theta + damper.omega * contact.time - mp.pi]


def half_jacobian(o: Orbit) -> Matrix:
    """DH by (5), in (v1+, x1, v2+, theta)."""
    d, z, T = o.damper, o.state, o.half_period
    before = flight(d, z, T)
    motion = start(d.apart, before.x1, before.v1, before.s, before.c)
    E = free_flow(d, T)
    P, Q = d.apart.forced()
    # x = x_forced + E (x(0) - x_forced(0)): theta moves the forced part at both ends
    ends = [
        (P * c - Q * s, -d.omega * (P * s + Q * c)) for s, c in ((z.s, z.c), (before.s, before.c))
    ]
    dx1 = [E[0, 1], E[0, 0], 0, ends[1][0] - E[0, 0] * ends[0][0] - E[0, 1] * ends[0][1]]
    dv1 = [E[1, 1], E[1, 0], 0, ends[1][1] - E[1, 0] * ends[0][0] - E[1, 1] * ends[0][1]]
    dx2, dv2, dtheta = [0, 1, T, 0], [0, 0, 1, 0], [0, 0, 0, 1]
    closing = gap_rate(before, "B")
    dt = [(p - q) / closing for p, q in zip(dx1, dx2, strict=True)]
    dx1 = [p + before.v1 * t for p, t in zip(dx1, dt, strict=True)]
    dv1 = [p + motion.derivative(2) * t for p, t in zip(dv1, dt, strict=True)]
    dtheta = [p + d.omega * t for p, t in zip(dtheta, dt, strict=True)]
    mu, R = d.mass_ratio, d.restitution
    dv1, dv2 = (
        [((1 - mu * R) * p + mu * (1 + R) * q) / (1 + mu) for p, q in zip(dv1, dv2, strict=True)],
        [((1 + R) * p + (mu - R) * q) / (1 + mu) for p, q in zip(dv1, dv2, strict=True)],
    )
    return mp.matrix([[-p for p in dv1], [-p for p in dx1], [-p for p in dv2], dtheta])


def characteristic(matrix: Matrix) -> list[Real]:
    """Coefficients of det(nu I - matrix), highest first (Faddeev and LeVerrier)."""
    n = matrix.rows
    result, power = [mp.mpf(1)], mp.eye(n)
    for k in range(1, n + 1):
        product = matrix * power
        result.append(-sum(product[i, i] for i in range(n)) / k)
        power = product + result[-1] * mp.eye(n)
    return result


def half_multipliers(o: Orbit) -> list[Real]:
    """The multipliers nu of H, largest modulus first, upper half plane before lower."""
    with mp.extradps(10):
        roots = mp.eig(half_jacobian(o), left=False, right=False)
    roots = [mp.chop(nu, tol=mp.mpf(10) ** (5 - mp.dps)) for nu in roots]
    return sorted(map(mp.mpc, roots), key=lambda nu: (-round(float(abs(nu)), 12), -nu.imag))


def determinant(damper: Damper) -> Real:
    """The exact determinant (6) of DH."""
    return damper.restitution**2 * mp.exp(-2 * mp.pi * damper.zeta * damper.omega_n / damper.omega)


def inadmissible(o: Orbit) -> str | None:
    """Why the orbit is not a motion, or None: it must leave A and first touch B, at time T."""
    T = o.half_period
    if gap_rate(o.state, "A") <= 0:
        return "does not leave stop A"
    contact = first_contact(o.damper, o.state, t_max=2 * T, from_stop="A")
    if contact is None or contact.stop == "A" or abs(contact.time - T) > mp.mpf(10) ** -30:
        return f"touches stop {contact.stop if contact else '?'} earlier"
    return None
