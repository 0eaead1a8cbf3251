"""Den Hartog's friction oscillator: a forced mass on a spring that rubs on the ground.

    m x'' + c x' + k x + friction sign(x') = F cos(theta),  theta' = omega;  |force| <= static at rest   (1)

Without dashpot and without stops in its motion it has the amplitude, with beta = omega / sqrt(k / m),

    X = (F / k) sqrt(V^2 - (friction / F)^2 U^2),                                            (2)
    V = 1 / (1 - beta^2),   U = sin(pi / beta) / (beta (1 + cos(pi / beta)))
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.friction import Friction
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine()
class FrictionOscillator(Machine):
    """Oscillator with Coulomb friction and a harmonic force: it slides, or sticks once or more a period.

    Parameters
    ----------
    mass
        m, > 0.
    damping
        c >= 0.
    stiffness
        k > 0.
    friction
        Friction force while it slides, >= 0.
    static
        Largest friction force while it sticks, >= friction; equal to it where left out.
    force
        Amplitude F.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "J. P. Den Hartog, Forced vibrations with combined viscous and Coulomb damping, Phil. Mag. (7) 9 (1930) "
        "801-817, "
        "and Trans. ASME 53 (1931) 107-115. Numbers of equations: not to be had; (2) follows from (1), and is checked "
        "in the tests."
    )

    known_for = KnownFor(
        "At omega = 0.3 the mass stands still on its way: two stops in half a period.",
        parameters={"omega": 0.3}, settled=20, shown=2,
    )  # fmt: skip
    to_try = (
        (
            "simulate friction-oscillator --omega 0.3 --t-max 90 --out stops.svg",
            "two stops per half period",
        ),
        (
            "sweep friction-oscillator --over omega=0.2:2:100 --observe extremes --out amplitude.nc",
            "his figure",
        ),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.0)
    stiffness: float = parameter(positive, "stiffness", "stiffness $k$", default=1.0)
    friction: float = parameter(nonnegative, "force", "friction force $F_f$", default=0.5)
    static: float | None = parameter(nonnegative, "force", "static friction force", default=None)
    force: float = parameter(real, "force", default=1.0)
    omega: float = parameter(positive, "frequency", default=0.6)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A mass on a spring that rubs on the ground."""
        return Mechanism(
            mass=[[self.mass]],
            damping=[[self.damping]],
            stiffness=[[self.stiffness]],
            forces=(Harmonic(self.omega, (0.0,), (self.force,)),),
            elements=(Friction((1.0,), self.friction, self.static),),
        )
