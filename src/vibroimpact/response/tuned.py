"""Tuned mass dampers in closed form, for comparison with impact dampers of equal mass.

Method      A mass mu on a spring and a dashpot, of frequency nu and damping ratio zeta of its own, on
            a machine of frequency 1 and damping ratio z under a force of unit static deflection:
                X = (nu^2 - g^2 + 2 i zeta nu g) / D(g),
                D = (1 - g^2 + 2 i z g) (nu^2 - g^2 + 2 i zeta nu g)
                    - mu g^2 (nu^2 + 2 i zeta nu g),                                            (1)
            g the forcing frequency. Without z Den Hartog's optimum makes both points that all zeta
            share equally high and, on the average, level:
                nu = 1 / (1 + mu),  zeta^2 = 3 mu / (8 (1 + mu)),  height^2 = 1 + 2 / mu          (2)
            With z there is no closed form: nu and zeta minimise the largest |X|, whose places are
            the real zeros of the derivative of the rational function |X|^2, by SciPy's Nelder-Mead
            method from (2). Without z it is that of [nishihara2002], slightly better than (2).
Accuracy    the largest |X| to 1e-8; nu to 1e-4 and zeta to 1e-3, of which it depends little
Reference   [denhartog1956] section 3.3, [nishihara2002]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from vibroimpact._core.checks import check_choice, nonnegative, numbers, positive, refusal
from vibroimpact._core.types import Amount, Floats, Positive
from vibroimpact.results.result import Result

LARGEST_RATIO = 1e6  # mass ratios, and damping ratios of the machine, enter polynomials of degree 8

REAL_ROOT_RELATIVE = 1e-6  # the imaginary part of a double root that is real is smaller


@dataclass(frozen=True)
class TunedDamper(Result):
    """Tuned mass damper on a machine, all in terms of the machine's own frequency and stiffness.

    Parameters
    ----------
    mass_ratio
        Its mass over that of the machine, mu > 0.
    frequency_ratio
        Its own frequency over that of the machine, nu > 0.
    damping_ratio
        Its own damping ratio, >= 0, relative to its own frequency.
    zeta
        Damping ratio of the machine, >= 0.
    """

    mass_ratio: Positive
    frequency_ratio: Positive
    damping_ratio: Amount
    zeta: Amount = 0.0

    def __post_init__(self) -> None:
        for name in ("mass_ratio", "frequency_ratio"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        for name in ("damping_ratio", "zeta"):
            object.__setattr__(self, name, nonnegative(name, getattr(self, name)))

    def amplification(self, ratio: ArrayLike) -> Floats:
        """Amplitude of the machine over its static deflection, (1), at forcing frequencies.

        Parameters
        ----------
        ratio
            Forcing frequency over the machine's own.
        """
        g = np.asarray(numbers("ratio", ratio), dtype=float)
        top, bottom = self._polynomials()
        with np.errstate(divide="ignore"):
            return np.asarray(np.abs(top(1j * g)) / np.abs(bottom(1j * g)))

    @property
    def peak(self) -> float:
        """Largest amplification over all frequencies."""
        return self.peak_at[1]

    @property
    def peak_at(self) -> tuple[float, float]:
        """(frequency over the machine's own, amplification) at the largest."""
        top, bottom = (_squared(part) for part in self._polynomials())
        slope = top.deriv() * bottom - top * bottom.deriv()
        roots = slope.roots()
        real = roots.real[
            (np.abs(roots.imag) <= REAL_ROOT_RELATIVE * np.abs(roots)) & (roots.real > 0.0)
        ]
        places = np.sqrt(np.append(real, 0.0))
        heights = self.amplification(places)
        best = int(np.argmax(heights))
        return float(places[best]), float(heights[best])

    def _polynomials(self) -> tuple[Any, Any]:
        """Numerator and denominator of (1) in s = i g."""
        nu, mu = self.frequency_ratio, self.mass_ratio
        own = Polynomial([nu * nu, 2.0 * self.damping_ratio * nu, 1.0])
        machine = Polynomial([1.0, 2.0 * self.zeta, 1.0])
        coupling = Polynomial([0.0, 0.0, mu * nu * nu, 2.0 * mu * self.damping_ratio * nu])
        return own, machine * own + coupling


def _squared(part: Any) -> Any:
    """|p(i g)|^2 as a polynomial in g^2."""
    c = part.coef
    even, odd = Polynomial(c[0::2]), Polynomial(c[1::2])
    swap = Polynomial([0.0, -1.0])  # s^2 = -g^2
    return even(swap) ** 2 + Polynomial([0.0, 1.0]) * odd(swap) ** 2


def tuned_damper(mass_ratio: float, zeta: float = 0.0, *, optimum: str = "minimax") -> TunedDamper:
    """Return the tuned mass damper that makes the largest response over all frequencies least.

    Parameters
    ----------
    mass_ratio
        Its mass over that of the machine, > 0, at most 1e6.
    zeta
        Damping ratio of the machine, >= 0, at most 1e6.
    optimum
        "minimax": numerically, by SciPy; "den hartog": in closed form, that of an undamped machine,
        whatever ``zeta`` is.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> tuned = vi.tuned_damper(0.05, optimum="den hartog")
    >>> round(tuned.frequency_ratio, 6), round(tuned.damping_ratio, 6)
    (0.952381, 0.133631)
    """
    mu, z = positive("mass_ratio", mass_ratio), nonnegative("zeta", zeta)
    check_choice("optimum", optimum, ["minimax", "den hartog"])
    if max(mu, z) > LARGEST_RATIO:
        raise refusal("mass_ratio, zeta", (mu, z), f"at most {LARGEST_RATIO:g}")
    start = TunedDamper(mu, 1.0 / (1.0 + mu), math.sqrt(3.0 * mu / (8.0 * (1.0 + mu))), z)
    if optimum == "den hartog":
        return start
    from scipy.optimize import minimize

    def damper(logs: Floats) -> TunedDamper:
        nu, own = map(float, np.exp(logs))
        return TunedDamper(mu, nu, own, z)

    def height(logs: Floats) -> float:
        return damper(logs).peak

    begin = np.log([start.frequency_ratio, start.damping_ratio])
    options = {"xatol": 1e-12, "fatol": 1e-14, "maxiter": 2000, "maxfev": 4000}
    found = minimize(height, begin, method="Nelder-Mead", options=options)
    return damper(found.x)
