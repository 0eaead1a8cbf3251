"""The shaker: a table on springs, shaken by an unbalance, and a part that hops on it.

    M x1'' + c x1' + k x1 = u omega^2 sin(theta),  theta' = omega          (1)
    m x2'' = -m g,   x2 - x1 >= 0                                          (2)

u is the unbalance, rotating mass times its radius; x1 is zero at the equilibrium of the empty table, both
coordinates point upwards. Stop B is x2 = x1, at which the part lands.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


@machine()
class Shaker(Machine):
    """Inertial shaker: a part that hops on a table on springs, which an unbalance shakes.

    Parameters
    ----------
    mass
        M of the table with the unbalance, > 0.
    stiffness, damping
        k > 0 and c >= 0 below the table.
    part_mass
        m of the part, > 0.
    unbalance
        u, rotating mass times radius, > 0.
    gravity
        g > 0.
    restitution
        Coefficient of restitution in [0, 1].
    omega
        Angular speed of the unbalance, > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "V. I. Babitsky, Theory of Vibro-Impact Systems and Applications, Springer 1998; G. W. Luo et al., on "
        "inertial shakers (2008). Numbers of equations: not to be had."
    )
    known_for = KnownFor(
        "Velocity of the table after the impacts over the frequency: rest of the part, hops, chaos.",
        "diagram", over=("omega", 1.5, 6.0),
        at="B",
    )  # fmt: skip
    to_try = (
        (
            "diagram shaker --over omega=2:6:200 --out diagram.png",
            "when the part lifts off, one hop per period, then more",
        ),
        ("simulate shaker --out hops.svg", "the hops"),
    )

    mass: float = parameter(positive, "mass", "mass of the table $M$", default=1.0)
    stiffness: float = parameter(positive, "stiffness", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.1)
    part_mass: float = parameter(positive, "mass", "mass of the part $m$", default=0.2)
    unbalance: float = parameter(positive, "unbalance", "unbalance $u$", default=1.0)
    gravity: float = parameter(positive, "acceleration", "gravity $g$", default=4.0)
    restitution: float = parameter(fraction, default=0.5)
    omega: float = parameter(positive, "frequency", default=4.0)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """Table and part, with a stop between them."""
        m, w = self.part_mass, self.omega
        return Mechanism(
            mass=[[self.mass, 0.0], [0.0, m]],
            damping=[[self.damping, 0.0], [0.0, 0.0]],
            stiffness=[[self.stiffness, 0.0], [0.0, 0.0]],
            constant_force=(0.0, -m * self.gravity),
            forces=(Harmonic(w, (self.unbalance * w * w, 0.0)),),
            elements=(RigidStop((-1.0, 1.0), lower=0.0, restitution=self.restitution),),
        )

    def free_start(self) -> State:
        """State with the table at its middle and the part above it, by what it falls in the time 1 / omega."""
        return State((0.0, self.gravity / self.omega**2), (0.0, 0.0))
