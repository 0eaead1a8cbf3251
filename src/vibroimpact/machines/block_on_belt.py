"""The block on a belt: stick-slip of a mass on a spring that a belt drags.

    m x'' + c x' + k x = -kinetic sign(x' - speed) while it slips; |force| <= static while it sticks   (1)

Without dashpot it sticks and slips for the times, with w = sqrt(k / m) and J = static - kinetic,

    t_stick = 2 J / (k speed),   t_slip = (2 / w) (pi - atan(J w / (k speed)))               (2)
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.friction import Friction
from vibroimpact.model.mechanism import Mechanism


@machine(omega="Nothing forces the block; its period is its own.")
class BlockOnBelt(Machine):
    """Block on a spring that sticks to a moving belt and slips back: brakes, bows, chatter of tools.

    Parameters
    ----------
    mass
        m, > 0.
    damping
        c >= 0.
    stiffness
        k > 0.
    kinetic, static
        Friction forces: while it slips, >= 0, and at most while it sticks, >= kinetic.
    speed
        Speed of the belt, > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "J. P. Den Hartog, Mechanical Vibrations (1956); (2) is derived in the file of the machine."
    )
    known_for = KnownFor(
        "Velocity over place: it rides on the belt (straight), slips back, and is caught again.",
        "portrait", settled=20.0, shown=60.0,
    )  # fmt: skip
    to_try = (
        ("simulate block-on-belt --t-max 60 --out belt.svg", "the saw-tooth of stick and slip"),
        ("section block-on-belt --at change=0:stick --points 20", "where it is caught"),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.0)
    stiffness: float = parameter(positive, "stiffness", "stiffness $k$", default=1.0)
    kinetic: float = parameter(nonnegative, "force", "kinetic friction", default=0.1)
    static: float = parameter(nonnegative, "force", "static friction", default=0.2)
    speed: float = parameter(positive, "velocity", "belt speed", default=0.05)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A mass on a spring that rubs on a belt."""
        return Mechanism(
            mass=[[self.mass]],
            damping=[[self.damping]],
            stiffness=[[self.stiffness]],
            elements=(Friction((1.0,), self.kinetic, self.static, belt_speed=self.speed),),
        )
