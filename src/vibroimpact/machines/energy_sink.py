"""The vibro-impact energy sink: a ball in a cavity of a structure on a shaken base.

    m x1'' + c x1' + k x1 = m y omega^2 sin(theta),  theta' = omega                          (1)
    mass_ratio m x2'' = mass_ratio m y omega^2 sin(theta),  |x2 - x1| <= half_clearance      (2)

x1 and x2 are relative to the base, which moves as y sin(theta). It is the impact damper driven by its base.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine(force="The base is shaken: give amplitude. ImpactDamper has a force.")
class EnergySink(Machine):
    """Vibro-impact nonlinear energy sink in a structure on a base that shakes.

    Parameters
    ----------
    mass
        m of the structure, > 0.
    mass_ratio
        Mass of the ball over m, > 0.
    stiffness, damping
        k > 0 and c >= 0 of the structure.
    half_clearance
        Half the play of the ball, > 0.
    restitution
        Coefficient of restitution in [0, 1].
    amplitude
        Amplitude y of the base, > 0.
    omega
        Frequency of the base, > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "O. V. Gendelman, Analytic treatment of a system with a vibro-impact nonlinear energy sink, J. Sound Vib. "
        "331 (2012) 4599-4608. Numbers of equations: not to be had."
    )
    known_for = KnownFor("The ball takes energy with two impacts in a period of the structure.")
    to_try = (
        (
            "diagram energy-sink --over omega=0.9:1.1:100 --out diagram.png",
            "two impacts per period, or chaos",
        ),
        (
            "simulate energy-sink --t-max 1000 --out beats.svg",
            "two impacts per period, or bursts of them",
        ),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    mass_ratio: float = parameter(positive, default=0.02)
    stiffness: float = parameter(positive, "stiffness", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.02)
    half_clearance: float = parameter(positive, "length", default=0.2)
    restitution: float = parameter(fraction, default=0.6)
    amplitude: float = parameter(positive, "length", "base amplitude $y$", default=0.02)
    omega: float = parameter(positive, "frequency", default=1.0)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """The structure and the ball, relative to the base."""
        m, b = self.mass, self.half_clearance
        still = Mechanism(
            mass=[[m, 0.0], [0.0, self.mass_ratio * m]],
            damping=[[self.damping, 0.0], [0.0, 0.0]],
            stiffness=[[self.stiffness, 0.0], [0.0, 0.0]],
            elements=(RigidStop((-1.0, 1.0), -b, b, self.restitution),),
        )
        return still.on_moving_base(Harmonic(self.omega, (self.amplitude,)))
