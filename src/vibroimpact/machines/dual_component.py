"""The dual-component system: two forced masses on springs of their own that strike each other.

mi xi'' + ci xi' + ki xi = Fi sin(theta + lagi),  lag1 = 0,  theta' = omega              (1)
x1 - x2 <= clearance                                                                     (2)
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
class DualComponent(Machine):
    """Dual-component system: two oscillators with a clearance, each with a force of one frequency.

    Parameters
    ----------
    mass1, mass2
        m1, m2 > 0.
    stiffness1, stiffness2
        k1, k2 >= 0.
    damping1, damping2
        c1, c2 >= 0.
    force1, force2
        Amplitudes F1, F2.
    lag
        Phase by which the second force leads, radians.
    clearance
        Distance of the masses at rest.
    restitution
        Coefficient of restitution in [0, 1].
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "G. W. Luo, J. H. Xie, Codimension two bifurcation of periodic vibro-impact and chaos of a dual component "
        "system, Phys. Lett. A 313 (2003) 267-273. Numbers of equations: not to be had."
    )
    known_for = KnownFor(
        "Velocity of the first mass after the impacts over the frequency: one impact in a period, or several.",
        "diagram", over=("omega", 0.6, 2.6),
    )  # fmt: skip
    to_try = (
        (
            "diagram dual-component --over omega=0.6:2.4:200 --out diagram.png",
            "one impact per period, or several, and a band of chaos",
        ),
        (
            "section dual-component --omega 1.2 --points 2000 --out section.svg",
            "a strange attractor",
        ),
    )

    mass1: float = parameter(positive, "mass", "mass $m_1$", default=1.0)
    mass2: float = parameter(positive, "mass", "mass $m_2$", default=2.0)
    stiffness1: float = parameter(nonnegative, "stiffness", "stiffness $k_1$", default=1.0)
    stiffness2: float = parameter(nonnegative, "stiffness", "stiffness $k_2$", default=4.0)
    damping1: float = parameter(nonnegative, "damping", "damping $c_1$", default=0.1)
    damping2: float = parameter(nonnegative, "damping", "damping $c_2$", default=0.2)
    force1: float = parameter(real, "force", "force amplitude $F_1$", default=1.0)
    force2: float = parameter(real, "force", "force amplitude $F_2$", default=0.5)
    lag: float = parameter(real, "", "phase of the second force", default=0.0)
    clearance: float = parameter(real, "length", "clearance", default=0.2)
    restitution: float = parameter(fraction, default=0.7)
    omega: float = parameter(positive, "frequency", default=1.6)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """Two masses on springs with a stop between them."""
        f1, f2 = self.force1, self.force2
        lines = Harmonic(self.omega, (f1, f2 * np.cos(self.lag)), (0.0, f2 * np.sin(self.lag)))
        stop = RigidStop((1.0, -1.0), upper=self.clearance, restitution=self.restitution)
        return Mechanism(
            mass=[[self.mass1, 0.0], [0.0, self.mass2]],
            damping=[[self.damping1, 0.0], [0.0, self.damping2]],
            stiffness=[[self.stiffness1, 0.0], [0.0, self.stiffness2]],
            forces=(lines,),
            elements=(stop,),
        )
