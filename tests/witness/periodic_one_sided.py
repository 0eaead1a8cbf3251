"""One impact per n forcing periods of x'' + x = cos(omega t), x <= s: closed form.

With g = 1 / (1 - omega^2), T = 2 pi n / omega and the free part y = x - g cos(omega t), an
orbit that arrives with speed V at the phase phi = omega t has y(T) = y(0) and
y'(T) = y'(0) + (1 + r) V, so

    y(0) = a V,  a = (1 + r) sin T / (2 (cos T - 1)),   y'(0) = -(1 + r) V / 2               (1)
    -r V = y'(0) - g omega sin phi:   sin phi = (r - (1 + r)/2) V / (g omega) = k V          (2)
    s = a V +- g sqrt(1 - k^2 V^2)                                                           (3)
    fold (SN): ds/dV = 0,  V^2 = a^2 / (k^2 (g^2 k^2 + a^2))                                 (4)
    det M = r^2,  tr M = -2 r cos T + (1 + r) (cos phi - s) sin T / V                        (5)
    period doubling (PD): 1 + tr M + r^2 = 0                                                 (6)

(5): M = S Phi with S = [[-r, 0], [(1 + r) f / V, -r]], f = cos phi - s the free acceleration
at the wall, S from the saltation formula; Phi the rotation by T.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .precision import Real, exact, mp

if TYPE_CHECKING:
    from .multilinear import Vector


@dataclass(frozen=True)
class Family:
    """The orbits of one omega, restitution and n; `sign` is that of cos phi."""

    omega: Real
    restitution: Real
    periods: int
    sign: int = 1

    @property
    def _constants(self) -> tuple[Real, Real, Real, Real, Real]:
        w, r = exact(self.omega), exact(self.restitution)
        T, g = 2 * mp.pi * self.periods / w, 1 / (1 - w**2)
        a = (1 + r) * mp.sin(T) / (2 * (mp.cos(T) - 1))
        return w, r, T, a, (r - 1) / (2 * g * w)

    def wall(self, V: Real) -> Real:
        """(3)."""
        w, _, _, a, k = self._constants
        return a * V + self.sign * mp.sqrt(1 - (k * V) ** 2) / (1 - w**2)

    def phase(self, V: Real) -> Real:
        """phi in [0, 2 pi), from (2)."""
        k = self._constants[4]
        return mp.atan2(k * V, self.sign * mp.sqrt(1 - (k * V) ** 2)) % (2 * mp.pi)

    def trace(self, V: Real) -> Real:
        """(5)."""
        _, r, T, _, _ = self._constants
        push = mp.cos(self.phase(V)) - self.wall(V)
        return -2 * r * mp.cos(T) + (1 + r) * push * mp.sin(T) / V

    def multipliers(self, V: Real) -> Vector:
        """Roots of x^2 - tr M x + r^2, largest first."""
        half, r = self.trace(V) / 2, exact(self.restitution)
        root = mp.sqrt(half**2 - r**2)
        pair = [mp.mpc(half + root), mp.mpc(half - root)]
        return sorted(pair, key=lambda x: (-round(float(abs(x)), 12), -x.imag))

    def fold(self) -> tuple[int, Real]:
        """The sign on which the two slopes of (3) cancel, and V of (4)."""
        w, _, _, a, k = self._constants
        g = 1 / (1 - w**2)
        return int(mp.sign(a * g)), abs(a / k) / mp.sqrt((g * k) ** 2 + a**2)

    def doubling_speed(self, guess: Real) -> Real:
        """V of (6)."""
        r = exact(self.restitution)
        return mp.findroot(lambda V: 1 + self.trace(V) + r**2, exact(guess))

    def speed(self, wall: Real, guess: Real) -> Real:
        """V at a wall."""
        return mp.findroot(lambda V: self.wall(V) - exact(wall), exact(guess))
