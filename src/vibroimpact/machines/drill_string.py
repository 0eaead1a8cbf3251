"""The drill string: a bit on a long torsional spring whose upper end turns at a constant rate.

    J x'' + c x' + k x = -T(rate + x'),   T = kinetic sign(rate + x'), or at most static at rest   (1)

x is the angle of the bit less that of the rotary table: -x is the twist. While the bit stands still the twist
grows by the rate; without dashpot it stands still for

    t_stick = 2 (static - kinetic) / (k rate)                                                (2)
"""

from __future__ import annotations

from vibroimpact._core.checks import nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.friction import Friction
from vibroimpact.model.mechanism import Mechanism


@machine(omega="Nothing forces the string; its period is its own. The rate of the table is rate.")
class DrillString(Machine):
    """Torsional stick-slip of a drill string: the bit stands still while the string winds up.

    Parameters
    ----------
    inertia
        Moment of inertia J of the bit and its collar, > 0.
    damping
        Torsional damping c >= 0, relative to the table.
    stiffness
        Torsional stiffness k of the string, > 0.
    kinetic, static
        Torque of the rock on a bit that turns, >= 0, and at most on one that stands still, >= kinetic.
    rate
        Angular speed of the rotary table, > 0.
    """

    source = (
        "J. D. Jansen, L. van den Steen, Active damping of self-excited torsional vibrations in oil well "
        "drillstrings, J. Sound Vib. 179 (1995) 647-668. Numbers of equations: not to be had; (2) follows from (1)."
    )
    known_for = KnownFor(
        "The bit stands still while the string winds up, then races.", settled=0.0, shown=60.0
    )
    to_try = (
        ("simulate drill-string --t-max 100 --out bit.svg", "the bit stands still and races"),
        ("section drill-string --at change=0:stick --points 20", "the twist at which it stops"),
    )

    inertia: float = parameter(positive, "", "moment of inertia $J$", default=1.0)
    damping: float = parameter(nonnegative, "", "torsional damping $c$", default=0.0)
    stiffness: float = parameter(positive, "", "torsional stiffness $k$", default=1.0)
    kinetic: float = parameter(nonnegative, "", "kinetic torque", default=0.6)
    static: float = parameter(nonnegative, "", "static torque", default=1.0)
    rate: float = parameter(positive, "", "rate of the table", default=0.4)

    @property
    def mechanism(self) -> Mechanism:
        """The bit relative to the table; the rock moves backwards."""
        return Mechanism(
            mass=[[self.inertia]],
            damping=[[self.damping]],
            stiffness=[[self.stiffness]],
            elements=(Friction((1.0,), self.kinetic, self.static, belt_speed=-self.rate),),
        )
