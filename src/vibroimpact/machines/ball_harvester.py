"""The ball harvester: a ball in an inclined, shaken capsule, whose ends are membranes that harvest energy.

    m x'' = m amplitude omega^2 cos(theta) - m g sin(incline),  theta' = omega,  |x| <= half_length   (1)

x is the place of the ball in the capsule, which moves along its axis as amplitude cos(theta). Stop B is the
lower end. Each impact takes the energy (1 - restitution^2) m v^2 / 2, of which a membrane harvests a part.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np

from vibroimpact._core.checks import fraction, nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine()
class BallHarvester(Machine):
    """Vibro-impact energy harvester: a ball in an inclined capsule that is shaken along its axis.

    Parameters
    ----------
    mass
        m of the ball, > 0.
    half_length
        Half the free length of the capsule, > 0.
    gravity
        g >= 0.
    incline
        Angle of the capsule with the horizontal, radians.
    amplitude
        Amplitude of the capsule, > 0.
    omega
        Frequency of the capsule, > 0.
    restitution
        Coefficient of restitution in [0, 1], of both ends.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "L. Serdukova, R. Kuske, D. Yurchenko, Post-grazing dynamics of a vibro-impacting energy generator, "
        "arXiv:2003.02167. Numbers of equations: not to be had; it scales time by half the period and lengths by "
        "the forcing, which here are free."
    )
    known_for = KnownFor(
        "Speed after impacts at the lower end over the length: impacts in turn, then irregular ones.",
        "diagram", over=("half_length", 0.1, 1.5), at="B",
    )  # fmt: skip
    to_try = (
        (
            "diagram ball-harvester --over half_length=0.1:1.5:200 --at B --out diagram.png",
            "alternating impacts, then two below",
        ),
        (
            "sweep ball-harvester --over half_length=0.1:1.5:100 --observe dissipation --out power.nc",
            "power",
        ),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    half_length: float = parameter(positive, "length", "half length", default=0.3)
    gravity: float = parameter(nonnegative, "acceleration", "gravity $g$", default=0.2)
    incline: float = parameter(real, "", r"incline $\beta$", default=0.5)
    amplitude: float = parameter(positive, "length", "capsule amplitude", default=0.1)
    omega: float = parameter(positive, "frequency", default=3.0)
    restitution: float = parameter(fraction, default=0.5)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A free mass between two stops, relative to the capsule."""
        m, b = self.mass, self.half_length
        return Mechanism(
            mass=[[m]],
            damping=[[0.0]],
            stiffness=[[0.0]],
            constant_force=(-m * self.gravity * np.sin(self.incline),),
            forces=(Harmonic(self.omega, (0.0,), (m * self.amplitude * self.omega**2,)),),
            elements=(RigidStop((1.0,), -b, b, self.restitution),),
        )
