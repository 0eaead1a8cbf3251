"""One forced oscillator in closed form.

    x'' + 2 sigma x' + k x = F sin(theta),  theta' = omega,  k > 0, sigma >= 0        (1)
    x = P s + Q c + h,   s = sin(theta), c = cos(theta)                               (2)
    P = F (k - omega^2) / D,  Q = -2 sigma omega F / D,  D = (k - omega^2)^2 + (2 sigma omega)^2
    h = e^(-sigma t) (h0 C + (h0' + sigma h0) S),  C = cos(w t), S = sin(w t) / w     (3)
    w^2 = k - sigma^2; cosh and sinh where it is negative, 1 and t where it is zero.

Every derivative y of h obeys y'' + 2 sigma y' + k y = 0, so k y^2 + y'^2 never grows and

    |y(t')| <= sqrt(y(t)^2 + y'(t)^2 / k)   for all t' >= t                           (4)

whatever the damping: a bound on any derivative of x over the rest of time.
"""

from __future__ import annotations

from dataclasses import dataclass

from .precision import Real, mp


@dataclass(frozen=True)
class Oscillator:
    """Coefficients of (1)."""

    sigma: Real
    k: Real
    force: Real
    omega: Real

    def forced(self) -> tuple[Real, Real]:
        """P and Q of (2)."""
        detuning = self.k - self.omega**2
        lag = 2 * self.sigma * self.omega
        square = detuning**2 + lag**2
        if square == 0:
            raise ZeroDivisionError("undamped forcing at resonance has no periodic response")
        return self.force * detuning / square, -self.force * lag / square


@dataclass(frozen=True)
class Motion:
    """A solution of (1), given at one instant; `at` moves that instant."""

    oscillator: Oscillator
    forced: tuple[Real, Real]  # P, Q
    phasor: tuple[Real, Real]  # s, c: any length, the equation is linear
    free: tuple[Real, Real]  # h, h'

    def at(self, t: Real) -> Motion:
        """Give the same solution at a time `t` later."""
        (s, c), (h, dh), o = self.phasor, self.free, self.oscillator
        cos, sin = mp.cos_sin(o.omega * t)
        phasor = (s * cos + c * sin, c * cos - s * sin)
        C, S = _damped_pair(o.k - o.sigma**2, t)
        decay = mp.exp(-o.sigma * t)
        free = (
            decay * (h * C + (dh + o.sigma * h) * S),
            decay * (dh * C - (o.k * h + o.sigma * dh) * S),
        )
        return Motion(o, self.forced, phasor, free)

    def derivative(self, order: int) -> Real:
        """The derivative of x of that order, at this instant."""
        return self._forced_derivative(order) + self._free_derivatives(order)[0]

    def bound(self, order: int) -> Real:
        """A bound on that derivative now and ever after, by (4)."""
        (P, Q), (s, c), o = self.forced, self.phasor, self.oscillator
        steady = mp.sqrt((P * P + Q * Q) * (s * s + c * c)) * o.omega**order
        y, dy = self._free_derivatives(order)
        return steady + mp.sqrt(y * y + dy * dy / o.k)

    def _forced_derivative(self, order: int) -> Real:
        (P, Q), (s, c) = self.forced, self.phasor
        turned = [(s, c), (c, -s), (-s, -c), (-c, s)][order % 4]
        return self.oscillator.omega**order * (P * turned[0] + Q * turned[1])

    def _free_derivatives(self, order: int) -> tuple[Real, Real]:
        y, dy = self.free
        for _ in range(order):
            y, dy = dy, -2 * self.oscillator.sigma * dy - self.oscillator.k * y
        return y, dy


def start(oscillator: Oscillator, x: Real, v: Real, s: Real, c: Real) -> Motion:
    """Begin a motion from position, velocity and forcing phasor."""
    P, Q = oscillator.forced()
    omega = oscillator.omega
    return Motion(oscillator, (P, Q), (s, c), (x - P * s - Q * c, v - omega * (P * c - Q * s)))


def _damped_pair(w2: Real, t: Real) -> tuple[Real, Real]:
    """C and S of (3)."""
    if w2 > 0:
        w = mp.sqrt(w2)
        cos, sin = mp.cos_sin(w * t)
        return cos, sin / w
    if w2 < 0:
        w = mp.sqrt(-w2)
        return mp.cosh(w * t), mp.sinh(w * t) / w
    return mp.mpf(1), t
