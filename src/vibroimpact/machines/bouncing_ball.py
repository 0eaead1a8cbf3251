"""The bouncing ball: a ball under gravity on a table that moves as a sin(theta), theta' = omega.

    x'' = -g,   x >= a sin(theta);   x' - a omega cos(theta) is reversed by -restitution   (1)

Once in n periods the ball comes and leaves with the speed n pi g / omega, at the phases

    cos(theta) = (n pi g / (a omega^2)) (1 - restitution) / (1 + restitution)              (2)

No approximation of a high ball is made: the flight ends where the table is. x is the height above the middle
of the table, stop B is the table.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


@machine()
class BouncingBall(Machine):
    """Ball that bounces, chatters and rests on a table that moves harmonically.

    Parameters
    ----------
    gravity
        g > 0.
    amplitude
        Amplitude a of the table, > 0.
    omega
        Frequency of the table, > 0.
    restitution
        Coefficient of restitution in [0, 1].
    si
        Whether the numbers are in SI units.
    """

    source = (
        "P. J. Holmes, The dynamics of repeated impacts with a sinusoidally vibrating table, J. Sound Vib. 84 "
        "(1982) 173-189; (2) is derived in the file of the machine."
    )
    known_for = KnownFor(
        "Speed after the impacts over the amplitude of the table: the route by period doubling to chaos.",
        "diagram", over=("amplitude", 1.25, 1.75), at="B", start=((1.1406,), (3.1416,), 0.5785),
    )  # fmt: skip
    to_try = (
        (
            "diagram bouncing-ball --over amplitude=0.4:1.8:200 --at B --out diagram.png",
            "rest, then period doubling",
        ),
        (
            "simulate bouncing-ball --amplitude 0.9 --t-max 40 --out ball.svg",
            "chatter, and rest on the table",
        ),
    )

    gravity: float = parameter(positive, "acceleration", "gravity $g$", default=1.0)
    amplitude: float = parameter(positive, "length", "table amplitude $a$", default=1.1)
    omega: float = parameter(positive, "frequency", default=1.0)
    restitution: float = parameter(fraction, default=0.5)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A free mass above a stop that moves."""
        table = Harmonic(self.omega, (self.amplitude,))
        return Mechanism(
            mass=[[1.0]],
            damping=[[0.0]],
            stiffness=[[0.0]],
            constant_force=(-self.gravity,),
            elements=(RigidStop((1.0,), 0.0, restitution=self.restitution, motion=(table,)),),
        )

    def free_start(self) -> State:
        """State at rest at the height to which the fastest table throws a ball."""
        fastest = self.amplitude * self.omega
        return State((self.amplitude + fastest * fastest / (2.0 * self.gravity),), (0.0,))
