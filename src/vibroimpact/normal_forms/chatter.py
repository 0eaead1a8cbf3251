"""End of completed chatter: what is on either side of it, and by which powers of the distance.

Method      Near the release the gap of a contact that chatters has y'' = -c tau, tau the time left until the force on
            the stop vanishes. A flight that begins with the speed w c tau^2 takes the time sigma tau, and the next one
            begins with w', R the coefficient of restitution:
                w = sigma / 2 - sigma^2 / 6,    w' = R (sigma / 2 - sigma^2 / 3) / (1 - sigma)^2        (1)
            At its only fixed point flights shrink by q = 1 - sigma, so that impacts accumulate just at the release:
                q^3 + 2 q^2 - 2 R q - R = 0,    0 < q < 1                                               (2)
            Next to it w leaves by the factor
                lambda = R^2 / q^5 > 1                                                                  (3)
            an impact. On one side of the parameter, w below the fixed point, chatter is completed before the
            release, and the rest after it takes the time
                t ~ d^kappa,    kappa = log(1 / q) / log(lambda),                                       (4)
            d the distance of the parameter, times a periodic function of log(d). On the other side impacts go on until
            the release: sequences with an impact more begin at
                d_k ~ C lambda^-k                                                                       (5)
Assumes     0 < R < 1; the force that is released vanishes at a rate c != 0
Accuracy    the next term of (5) is smaller by a factor that falls as q^k at least
Fails       never
Reference   theory.md, (T84) to (T86)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class ChatterEnd:
    """Place at which completed chatter ends to be completed, and sequences of ever more impacts accumulate.

    Attributes
    ----------
    kind
        Label of the point.
    parameter, at
        Name of the parameter, and its value there.
    stop
        The stop at which it chatters, in words.
    restitution
        Its coefficient of restitution, in (0, 1).
    """

    kind: str
    parameter: str
    at: float
    stop: str
    restitution: float

    @cached_property
    def shrinking(self) -> float:
        """Ratio q (2) of two flights one after the other, where impacts accumulate at the release."""
        r = self.restitution
        roots = np.roots([1.0, 2.0, -2.0 * r, -r])
        return float(roots.real.max())  # the only positive one, by the rule of signs

    @property
    def ratio(self) -> float:
        """Ratio 1 / lambda (3) of the distances at which sequences with an impact more begin."""
        return self.shrinking**5 / self.restitution**2

    @property
    def power(self) -> float:
        """Power kappa (4) of the distance, of the time of the rest after chatter."""
        return math.log(self.shrinking) / math.log(self.ratio)

    @property
    def meaning(self) -> str:
        """What is on either side of the point."""
        return (
            "chatter is completed on one side, with a rest after it that takes a time as the distance to the power "
            f"{self.power:.4g}; on the other sequences of ever more impacts accumulate, one with an impact more is "
            f"{self.ratio:.6g} times as far away"
        )

    def __repr__(self) -> str:
        return f"{self.kind} at {self.parameter} = {self.at:.9g}, {self.stop}: {self.meaning}"
