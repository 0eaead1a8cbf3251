"""Resonances p/q of a multiplier on the unit circle, and the effect of strong ones.

Method      distance to the resonance p/q of nu = exp(i theta):  |nu^q - 1|                  (1)
            Removing the terms that the normal form nu z (1 + d |z|^2) does not have divides by
                1 - nu and nu^2 - nu      (terms z zbar and z^2)     |nu - 1|                (2)
                nu - conj(nu)             (in <p, q> = 1)            |nu^2 - 1|              (3)
                nu^2 - conj(nu)           (term zbar^2)              |nu^3 - 1|              (4)
                nu - conj(nu)^3           (term zbar^3)              |nu^4 - 1|              (5)
            and by no smaller number for q >= 5: those are weak.
Assumes     |nu| = 1
Accuracy    rounding
Fails       never
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 4.7 and chapter 9
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from vibroimpact._core.types import Count

HIGHEST_DENOMINATOR = 12
"""Resonances p/q up to this q are listed, and located along curves of Neimark-Sacker bifurcations."""

STRONGEST = 4
"""Up to this q a resonance is strong: (2) to (5) divide by zero at it."""

STRONG_DISTANCE = 0.1
"""|nu^q - 1| below which a strong resonance is warned of.

Each divisor (2) to (5) is |nu^q - 1|, so below 0.1 a term that the leading-order prediction leaves
out is more than ten times as large as its own coefficient. In angle: 5.7 / q degrees.
"""

CONSEQUENCE = {
    1: "d divides by nu - 1, so it and the circle change fast with the parameter; at nu = 1 there "
    "is a fold as well",
    2: "the two critical eigenvectors are nearly parallel, which <p, q> = 1 divides by; at nu = -1 "
    "orbits of period two are born too",
    3: "the term conj(z)^2 is removed by dividing by nu^3 - 1; at 1:3 it decides, and a saddle "
    "orbit of period three lies next to the fixed point",
    4: "the term conj(z)^3 is removed by dividing by nu^4 - 1; at 1:4 it competes with d, and "
    "orbits of period four can replace the circle",
}


@dataclass(frozen=True, slots=True)
class Resonance:
    """A resonance p/q: nu^q = 1 with angle 2 pi p / q.

    Attributes
    ----------
    p, q
        The fraction in lowest terms, 0 <= p / q <= 1 / 2.
    distance
        |nu^q - 1|, in [0, 2].
    angle
        arg(nu) - 2 pi p / q, radians.
    """

    p: Count
    q: Count
    distance: float
    angle: float

    @property
    def strong(self) -> bool:
        """Whether q <= 4."""
        return self.q <= STRONGEST


def resonances(angle: float, highest: int = HIGHEST_DENOMINATOR) -> tuple[Resonance, ...]:
    """List the nearest p/q for each q.

    Parameters
    ----------
    angle
        arg(nu), radians, in [0, pi].
    highest
        Largest q listed, >= 1.

    Returns
    -------
    tuple of Resonance
        In order of q. A q whose nearest fraction is not in lowest terms is left out, since that is
        listed under a smaller q.

    Examples
    --------
    >>> [(r.p, r.q) for r in resonances(math.pi / 3) if r.distance < 1e-12]
    [(1, 6)]
    """
    turns = angle / (2.0 * math.pi)
    found = []
    for q in range(1, highest + 1):
        p = round(q * turns)
        if math.gcd(p, q) == 1:
            off = angle - 2.0 * math.pi * p / q
            found.append(Resonance(p, q, 2.0 * abs(math.sin(q * off / 2.0)), off))  # (1)
    return tuple(found)


def nearest_resonance(angle: float, highest: int = HIGHEST_DENOMINATOR) -> Resonance:
    """Return the fraction p/q with q <= highest nearest to arg(nu) / (2 pi)."""
    best = Fraction(angle / (2.0 * math.pi)).limit_denominator(highest)
    return next(r for r in resonances(angle, highest) if (r.p, r.q) == best.as_integer_ratio())


def strong_resonances(angle: float, within: float = STRONG_DISTANCE) -> tuple[Resonance, ...]:
    """Return the strong resonances with |nu^q - 1| < within (default: see ``STRONG_DISTANCE``)."""
    return tuple(r for r in resonances(angle, STRONGEST) if r.distance < within)


def warning(resonance: Resonance, radius: float) -> str:
    """Return the reason why a coefficient next to a strong resonance is unreliable.

    Parameters
    ----------
    resonance
        A strong resonance.
    radius
        |z| at which the removed resonant term is as large as z; infinite where there is none.
    """
    limit = f" Trust it only for |z| far below {radius:.2g}." if math.isfinite(radius) else ""
    return (
        f"|nu^{resonance.q} - 1| = {resonance.distance:.3g}, near the strong resonance "
        f"{resonance.p}:{resonance.q}: the coefficient d and the circle are unreliable, because "
        f"{CONSEQUENCE[resonance.q]}.{limit}"
    )
