"""Pounding: two neighbouring structures on one ground that shakes strike each other.

    mi xi'' + ci xi' + ki xi = mi y omega^2 sin(theta),  i = 1, 2,  theta' = omega           (1)
    x1 - x2 <= clearance                                                                     (2)

Both coordinates are relative to the ground, which moves as y sin(theta). Stop A is the joint.
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
class PoundingStructures(Machine):
    """Two structures beside each other on a ground that shakes, with a joint between them.

    Parameters
    ----------
    mass1, mass2
        m1, m2 > 0.
    stiffness1, stiffness2
        k1, k2 > 0.
    damping1, damping2
        c1, c2 >= 0.
    clearance
        Width of the joint.
    restitution
        Coefficient of restitution in [0, 1].
    amplitude
        Amplitude y of the ground, > 0.
    omega
        Frequency of the ground, > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "S. A. Anagnostopoulos, Pounding of buildings in series during earthquakes, Earthquake Eng. Struct. Dyn. 16 "
        "(1988) 443-456, here with two structures and a rigid joint. Numbers of equations: not to be had."
    )
    known_for = KnownFor("Two structures sway, and strike each other where they meet.")
    to_try = (
        ("simulate pounding --out blows.svg", "both structures, and where they strike"),
        (
            "diagram pounding --over clearance=0:1:200 --out diagram.png",
            "how wide the joint must be",
        ),
    )

    mass1: float = parameter(positive, "mass", "mass $m_1$", default=1.0)
    mass2: float = parameter(positive, "mass", "mass $m_2$", default=1.0)
    stiffness1: float = parameter(positive, "stiffness", "stiffness $k_1$", default=1.0)
    stiffness2: float = parameter(positive, "stiffness", "stiffness $k_2$", default=3.0)
    damping1: float = parameter(nonnegative, "damping", "damping $c_1$", default=0.1)
    damping2: float = parameter(nonnegative, "damping", "damping $c_2$", default=0.1)
    clearance: float = parameter(real, "length", "width of the joint", default=0.1)
    restitution: float = parameter(fraction, default=0.65)
    amplitude: float = parameter(positive, "length", "ground amplitude $y$", default=0.1)
    omega: float = parameter(positive, "frequency", default=1.2)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """Two masses on springs with a stop between them, on a base that moves."""
        joint = RigidStop((1.0, -1.0), upper=self.clearance, restitution=self.restitution)
        still = Mechanism(
            mass=[[self.mass1, 0.0], [0.0, self.mass2]],
            damping=[[self.damping1, 0.0], [0.0, self.damping2]],
            stiffness=[[self.stiffness1, 0.0], [0.0, self.stiffness2]],
            elements=(joint,),
        )
        return still.on_moving_base(Harmonic(self.omega, (self.amplitude,)))
