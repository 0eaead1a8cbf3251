"""Residuals of the paper's formulas (8) to (30) against the equations they are meant to solve.

Residuals are absolute and nondimensional; a correct formula leaves rounding error. This file states
the paper's own algebra, and only the table in `misprints` uses it: orbits come from
`vibroimpact.symmetric_orbits` and trajectories from `vibroimpact.simulate`. The corrected formulas
are derived in docs/theory.md, where they carry the numbers (T1), (T2), ...

Letters are the paper's: A, psi, tau_0, q, d, e_1, s, c, m, n, h; X stands for delta + A sin(tau_0).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

import vibroimpact as vi
from vibroimpact._core.types import Floats
from vibroimpact_papers.impact_damper.symmetric_bifurcations import orbits_by_sign


@dataclass(frozen=True, slots=True)
class Case:
    """A damper with one of its symmetric 1-1-1 orbits: where a formula is evaluated."""

    damper: vi.ImpactDamper
    sign: int
    orbit: vi.Orbit

    @classmethod
    def of(cls, damper: vi.ImpactDamper, sign: int = 1) -> Case:
        """Take the orbit with the given sign in (14)."""
        return cls(damper, sign, orbits_by_sign(damper)[sign])

    def at_omega(self, omega: float) -> Case:
        """Return the orbit with the same sign at another frequency."""
        return Case.of(dataclasses.replace(self.damper, omega=omega), self.sign)

    def other_sign(self) -> Case:
        """Return the other orbit of the same damper."""
        return Case.of(self.damper, -self.sign)


@dataclass(frozen=True, slots=True)
class Letters:
    """The paper's letters for one case, with the force scaled to 1 as in (3)."""

    mu: float
    R: float
    zeta: float
    wn: float
    w: float
    delta: float
    x1: float
    v1: float
    v2: float
    theta: float

    @classmethod
    def of(cls, case: Case) -> Letters:
        """Read the parameters, and the state just after the impact on stop A."""
        damper, state = case.damper, case.orbit.state
        return cls(
            mu=damper.mass_ratio,
            R=damper.restitution,
            zeta=damper.zeta,
            wn=damper.omega_n,
            w=damper.omega,
            delta=damper.half_clearance / damper.force,
            x1=float(state.position[0]) / damper.force,
            v1=float(state.velocity[0]) / damper.force,
            v2=float(state.velocity[1]) / damper.force,
            theta=float(state.phase),
        )

    @property
    def eta(self) -> float:
        """Return the ratio of the damped to the undamped natural frequency."""
        return math.sqrt(1 - self.zeta**2)

    @property
    def A(self) -> float:
        """Return the amplitude of the forced response."""
        return 1 / math.hypot(self.wn**2 - self.w**2, 2 * self.zeta * self.wn * self.w)

    @property
    def psi(self) -> float:
        """Return the phase lag of the forced response."""
        return math.atan2(2 * self.zeta * self.wn * self.w, self.wn**2 - self.w**2)

    @property
    def tau(self) -> float:
        """Return tau_0 = theta - psi."""
        return self.theta - self.psi

    @property
    def X(self) -> float:
        """Return delta + A sin(tau_0)."""
        return self.delta + self.A * math.sin(self.tau)

    @property
    def q(self) -> float:
        """Return delta / A."""
        return self.delta / self.A

    @property
    def d(self) -> float:
        """Return 2 omega / pi."""
        return 2 * self.w / math.pi

    @property
    def e1(self) -> float:
        """Return the decay of the main mass over half a period."""
        return math.exp(-math.pi * self.zeta * self.wn / self.w)

    @property
    def s(self) -> float:
        """Return sin(eta pi / gamma)."""
        return math.sin(self.eta * math.pi * self.wn / self.w)

    @property
    def c(self) -> float:
        """Return cos(eta pi / gamma)."""
        return math.cos(self.eta * math.pi * self.wn / self.w)

    @property
    def bracket(self) -> float:
        """Return (e1^2 + 2 c e1 + 1) eta omega_n, the first term of the denominator of m."""
        return (self.e1**2 + 2 * self.c * self.e1 + 1) * self.eta * self.wn

    @property
    def m(self) -> float:
        """Return the corrected m of (15)."""
        coupling = 2 * self.s * self.mu * self.d * self.e1
        return coupling / (self.bracket + coupling)

    @property
    def mn(self) -> float:
        """Return the corrected product m n, regular where s = 0."""
        coupling = 2 * self.mu * self.d
        return coupling * (1 + self.c * self.e1) / (self.bracket + coupling * self.s * self.e1)

    @property
    def h(self) -> float:
        """Return the corrected h of (15)."""
        free = self.d * (1 - self.m) * (1 - self.R * (1 + 2 * self.mu)) / (1 + self.R)
        return -(free + self.zeta * self.wn * self.m + self.eta * self.wn * self.mn) / self.w

    def cos_tau(self, sign: int) -> float:
        """Return the argument of arccos in (14)."""
        root = math.sqrt(self.h**2 * (1 - self.q**2) + 1)
        return self.h * (self.q + sign * root) / (1 + self.h**2)

    def free_velocities(self, a11: float, b11: float) -> tuple[float, float]:
        """Return the free part of x1' of (8a) at 0 and at pi/omega."""
        start = -self.zeta * self.wn * a11 + self.eta * self.wn * b11
        turned = -self.zeta * self.wn * b11 - self.eta * self.wn * a11
        return start, self.e1 * (self.c * start + self.s * turned)


# --- scaling, and the constants of (8) ----------------------------------------------------------


def stiffness(p: Letters, reference: float) -> float:
    """Return the stiffness of (1) scaled with w0 = reference sqrt(K/M1), minus omega_n^2."""
    return abs(1 / reference**2 - p.wn**2)


def forced_response(p: Letters, amplitude: float, lag: float) -> float:
    """Return how far amplitude sin(omega t - lag) is from solving (3)."""
    stiffness = complex(p.wn**2 - p.w**2, 2 * p.zeta * p.wn * p.w)
    return float(abs(amplitude * np.exp(-1j * lag) * stiffness - 1))


def psi_printed(p: Letters) -> float:
    """Return the arctan of the quotient."""
    gamma = p.w / p.wn
    return math.atan(2 * p.zeta * gamma / (1 - gamma**2))


# --- the symmetric orbit: (11) to (15) ----------------------------------------------------------


def half_period_position(p: Letters, b11: float) -> float:
    """Return x1(pi/omega) + x1(0) for a given b11."""
    forced = p.A * math.sin(p.tau)
    free = p.e1 * (p.c * (p.x1 - forced) + p.s * b11)
    return abs(free - forced + p.x1)


def momentum(p: Letters, m: float) -> float:
    """Return x1'(0) + x1'(pi/omega) + 2 mu x2'(0), (5) with (11); the forced parts cancel."""
    mn = m * (1 + p.c * p.e1) / (p.s * p.e1)
    start, end = p.free_velocities(-m * p.X, mn * p.X)
    return abs(start + end - 2 * p.mu * p.d * (1 - m) * p.X)


def momentum_at_s_zero(case: Case) -> float:
    """Return the momentum condition per unit X where s = 0 and c = -1, by the regular m n."""
    p = Letters.of(case)
    w = p.eta * p.wn  # (15): s = sin(pi) = 0
    decay = 1 - math.exp(-math.pi * p.zeta * p.wn / w)
    coupling = 4 * p.mu * w / math.pi
    mn = coupling * decay / (decay**2 * p.eta * p.wn)
    return abs(p.eta * p.wn * mn * decay - coupling)


def restitution(p: Letters, h: float) -> float:
    """Return the residual of (6) when A cos(tau_0) = h X is put in."""
    start, end = p.free_velocities(-p.m * p.X, p.mn * p.X)
    after, before = start + p.w * h * p.X, -(end - p.w * h * p.X)
    x2_after = -p.d * (1 - p.m) * p.X
    return abs((x2_after - after) - p.R * (before + x2_after))


def m_printed(p: Letters) -> float:
    """Return m of (15) as printed."""
    denominator = p.bracket - (p.s * p.e1 * p.d + p.c * p.e1 + 1) * p.mu
    return p.s * p.mu * p.d * p.e1 / denominator


def h_printed(p: Letters) -> float:
    """Return h of (15) as printed, with the corrected m and m n."""
    pi, m, mn = math.pi, p.m, p.mn
    first = (p.mu - p.R) * (p.w * (1 + 2 * m) + pi * m * (1 + 2 * p.c * p.e1))
    first = (first + pi * mn * (1 + p.mu)) / (pi * p.w * (1 + p.R))
    second = 2 * m * p.e1 * (p.s * p.eta - p.c * p.zeta)
    second -= p.d * p.e1 * mn * (p.s * p.zeta + p.c * p.eta)
    return first + second * p.wn / (p.d * p.w)


def contact(p: Letters, cos_tau: float, sin_tau: float) -> float:
    """Return A cos(tau_0) / h - A sin(tau_0) - delta: contact at t = 0."""
    return abs(p.A * (cos_tau / p.h - sin_tau) - p.delta)


def contact_printed(case: Case) -> float:
    """Contact with tau_0 = arccos of (14)."""
    p = Letters.of(case)
    cos_tau = p.cos_tau(case.sign)
    return contact(p, cos_tau, math.sin(math.acos(cos_tau)))


def contact_corrected(case: Case) -> float:
    """Return the distance between the orbit's phase and tau_0 by atan2, on the circle."""
    p = Letters.of(case)
    cos_tau = p.cos_tau(case.sign)
    tau = math.atan2(cos_tau / p.h - p.q, cos_tau)
    return abs(math.remainder(tau - p.tau, 2 * math.pi))


# --- the perturbed motion: (18) to (20) and (30) ------------------------------------------------


def period_change(case: Case, sign: int) -> float:
    """Return the phase advance of a perturbed motion minus omega (dt1 + sign dt2)."""
    state, w = case.orbit.state, case.damper.omega
    velocity = np.asarray(state.velocity) * np.array([1.0, 1.01])
    start = vi.State(position=state.position, velocity=velocity, phase=state.phase)
    run = vi.simulate(case.damper, start, impacts=2)
    dt1 = run.time[0] - math.pi / w
    dt2 = run.time[1] - run.time[0] - math.pi / w
    error = run.phase[1] - state.phase - w * (dt1 + sign * dt2)
    return abs(math.remainder(float(error), 2 * math.pi))


def b11(p: Letters, factor: float) -> float:
    """Return b11 of (19) with the given factor of zeta omega_n sin(tau)."""
    position = p.x1 + factor * math.sin(p.tau)
    return (p.v1 - p.A * p.w * math.cos(p.tau) + p.zeta * p.wn * position) / (p.eta * p.wn)


def initial_velocity(p: Letters, factor: float) -> float:
    """Return x1'(0) of (17a), with b11 as given, minus the velocity it was made from."""
    a11 = p.x1 - p.A * math.sin(p.tau)
    start, _ = p.free_velocities(a11, b11(p, factor))
    return abs(start + p.A * p.w * math.cos(p.tau) - p.v1)


def velocities_before(p: Letters) -> tuple[float, float]:
    """Return the velocities before the impact on A: minus those before stop B."""
    _, end = p.free_velocities(p.x1 - p.A * math.sin(p.tau), b11(p, -p.A))
    return p.A * p.w * math.cos(p.tau) - end, -p.v2


def impact(p: Letters, *, exchanged: bool) -> float:
    """Return the residual of (5) and (6) together when (7), or (20) as printed, is the law."""
    u1, u2 = velocities_before(p)
    first, second = (u2, u1) if exchanged else (u1, u2)
    y1 = ((1 - p.mu * p.R) * first + p.mu * (1 + p.R) * second) / (1 + p.mu)
    y2 = ((1 + p.R) * first + (p.mu - p.R) * second) / (1 + p.mu)
    return math.hypot(y1 + p.mu * y2 - u1 - p.mu * u2, y2 - y1 - p.R * (u1 - u2))


def _flight_jacobian(p: Letters) -> Floats:
    """Differentiate (x1', x1, x2', x2, tau) after pi/omega by (x1', x1, x2', tau) on stop A."""
    S = p.e1 * p.s / (p.eta * p.wn)
    C = p.e1 * p.c + p.zeta * p.wn * S
    free = np.array([[C - 2 * p.zeta * p.wn * S, -(p.wn**2) * S], [S, C]])
    forced = p.A * np.array([-p.w * math.sin(p.tau), math.cos(p.tau)])
    jacobian = np.zeros((5, 4))
    jacobian[:2, :2] = free
    jacobian[:2, 3] = -forced - free @ forced
    jacobian[2, 2] = jacobian[3, 1] = jacobian[4, 3] = 1
    jacobian[3, 2] = math.pi / p.w
    return jacobian


def period_jacobian(case: Case) -> Floats:
    """Df of (30), from (7), (19) and (31), as the square of the half map."""
    p = Letters.of(case)
    u1, u2 = -velocities_before(p)[0], -velocities_before(p)[1]
    force = -math.sin(p.theta)
    rate = np.array([force - 2 * p.zeta * p.wn * u1 + p.wn**2 * p.x1, u1, 0, u2, p.w])
    flight = _flight_jacobian(p)
    before = flight - np.outer(rate, flight[3] - flight[1]) / (u2 - u1)
    law = np.array([[1 - p.mu * p.R, p.mu * (1 + p.R)], [1 + p.R, p.mu - p.R]]) / (1 + p.mu)
    after = np.vstack([law @ before[[0, 2]], before[1], before[4]])[[0, 2, 1, 3]]
    half = np.diag([-1.0, -1.0, -1.0, 1.0]) @ after
    return np.asarray(half @ half)


def determinant(case: Case, *, as_printed: bool) -> float:
    """Return det Df minus R^4 exp(-4 pi zeta omega_n / omega)."""
    p, Df = Letters.of(case), period_jacobian(case)
    if as_printed:
        Df[1, 2:] = Df[2, 2], Df[3, 3]
    return float(abs(np.linalg.det(Df) - p.R**4 * p.e1**4))


def crossing(case: Case, direction: int) -> float:
    """Return by how much |lambda_1| fails to grow with direction * omega, from 1.005 to 1.011."""
    low, high = (float(max(abs(case.at_omega(w).orbit.multipliers))) for w in (1.005, 1.011))
    return max(0.0, direction * (low - high))
