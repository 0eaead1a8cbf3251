"""The vibration hammer: a shaken housing, and in it a ram on a spring that strikes the anvil plate.

    M x1'' + c1 x1' + k1 x1 + c2 (x1' - x2') + k2 (x1 - x2) = F sin(theta),  theta' = omega   (1)
    m x2'' + c2 (x2' - x1') + k2 (x2 - x1) = 0,   x2 - x1 <= clearance                        (2)

Both coordinates are zero at static equilibrium. Stop A is x2 - x1 = clearance.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine()
class VibrationHammer(Machine):
    """Vibration hammer: a ram on a spring in a shaken housing, which it strikes.

    Parameters
    ----------
    mass
        M of the housing, > 0.
    stiffness, damping
        k1 >= 0 and c1 >= 0 between housing and ground.
    ram_mass
        m of the ram, > 0.
    ram_stiffness, ram_damping
        k2 >= 0 and c2 >= 0 between ram and housing.
    clearance
        Distance between ram and anvil plate at static equilibrium; below 0 the spring presses.
    restitution
        Coefficient of restitution in [0, 1].
    force
        Amplitude F of the force on the housing.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "V. I. Babitsky, Theory of Vibro-Impact Systems and Applications, Springer 1998; named as an application in "
        "the paper on the impact damper. Numbers of equations: not to be had."
    )
    known_for = KnownFor(
        "Velocity of the housing after the blows over the frequency: ranges of one blow in a period, and others.",
        "diagram", over=("omega", 0.5, 2.5),
    )  # fmt: skip
    to_try = (
        (
            "diagram vibration-hammer --over omega=0.5:2.5:200 --out diagram.png",
            "ranges of one blow per period",
        ),
        ("simulate vibration-hammer --out blows.svg", "housing and ram, blow by blow"),
    )

    mass: float = parameter(positive, "mass", "mass of the housing $M$", default=1.0)
    stiffness: float = parameter(nonnegative, "stiffness", "stiffness $k_1$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c_1$", default=0.1)
    ram_mass: float = parameter(positive, "mass", "mass of the ram $m$", default=0.5)
    ram_stiffness: float = parameter(nonnegative, "stiffness", "stiffness $k_2$", default=0.5)
    ram_damping: float = parameter(nonnegative, "damping", "damping $c_2$", default=0.05)
    clearance: float = parameter(real, "length", "clearance $d$", default=0.1)
    restitution: float = parameter(fraction, default=0.6)
    force: float = parameter(real, "force", default=1.0)
    omega: float = parameter(positive, "frequency", default=1.5)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """Two masses in a row with a stop between them."""
        c, k = self.ram_damping, self.ram_stiffness
        return Mechanism(
            mass=[[self.mass, 0.0], [0.0, self.ram_mass]],
            damping=[[self.damping + c, -c], [-c, c]],
            stiffness=[[self.stiffness + k, -k], [-k, k]],
            forces=(Harmonic(self.omega, (self.force, 0.0)),),
            elements=(RigidStop((-1.0, 1.0), upper=self.clearance, restitution=self.restitution),),
        )
