"""The vibro-impact capsule: a driven mass inside strikes the front plate, and the capsule creeps on.

    m x1'' + c (x1' - x2') + k (x1 - x2) + p = F cos(theta),  theta' = omega                 (1)
    M x2'' - c (x1' - x2') - k (x1 - x2) - p = -reaction F cos(theta) - friction sign(x2')   (2)
    p = k1 (x1 - x2 - gap) where that is positive, else 0                                    (3)

x1 is the mass inside, x2 the capsule on dry ground; p is the force of the plate.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.friction import Friction
from vibroimpact.model.elements.soft_stop import SoftStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine()
class VibroImpactCapsule(Machine):
    """Capsule that moves by the impacts of a mass inside and by dry friction outside: it drifts.

    Parameters
    ----------
    inner_mass
        m of the driven mass, > 0.
    capsule_mass
        M of the capsule, > 0.
    stiffness, damping
        k >= 0 and c >= 0 between them.
    plate_stiffness
        k1 > 0 of the plate.
    gap
        Distance of the mass from the plate.
    friction
        Friction force on the capsule, >= 0: coefficient times weight.
    force
        Amplitude F.
    reaction
        Share of the force that acts back on the capsule: 1 for a motor inside, 0 for a field from outside.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "Y. Liu, M. Wiercigroch, E. Pavlovskaia, H. Yu, Modelling of a vibro-impact capsule system, Int. J. Mech. "
        "Sci. 66 (2013); Y. Liu, E. Pavlovskaia, D. Hendry, M. Wiercigroch, Vibro-impact responses of capsule "
        "system with various friction models, Int. J. Mech. Sci. (2013) 39-54. Numbers of equations: not to be had."
    )
    known_for = KnownFor("Each impact of the mass inside drags the capsule on; it rests between.")
    to_try = (
        ("simulate capsule --t-max 100 --out capsule.svg", "how it creeps"),
        (
            "sweep capsule --over omega=0.5:2:100 --observe progress --out drift.nc",
            "the fastest frequency",
        ),
    )

    inner_mass: float = parameter(positive, "mass", "mass inside $m$", default=1.0)
    capsule_mass: float = parameter(positive, "mass", "mass of the capsule $M$", default=4.0)
    stiffness: float = parameter(nonnegative, "stiffness", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.1)
    plate_stiffness: float = parameter(positive, "stiffness", "plate stiffness $k_1$", default=15.0)
    gap: float = parameter(real, "length", "gap", default=0.02)
    friction: float = parameter(nonnegative, "force", "friction force", default=1.0)
    force: float = parameter(real, "force", default=0.8)
    reaction: float = parameter(nonnegative, "", "reaction", default=1.0)
    omega: float = parameter(positive, "frequency", default=1.1)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """Two masses with a soft stop between them, the second on dry ground."""
        c, k = self.damping, self.stiffness
        plate = SoftStop((1.0, -1.0), upper=self.gap, stiffness=self.plate_stiffness)
        return Mechanism(
            mass=[[self.inner_mass, 0.0], [0.0, self.capsule_mass]],
            damping=[[c, -c], [-c, c]],
            stiffness=[[k, -k], [-k, k]],
            forces=(Harmonic(self.omega, (0.0, 0.0), (self.force, -self.reaction * self.force)),),
            elements=(plate, Friction((0.0, 1.0), self.friction)),
        )
