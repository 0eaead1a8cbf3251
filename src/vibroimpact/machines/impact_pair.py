"""The impact pair: a free mass between two walls of a body that is shaken.

    x'' = 0,   |x - a sin(theta)| <= half_clearance,  theta' = omega                         (1)

Where it meets the walls in turn, half a period apart, it flies with the speed v at the phase theta of the
upper wall: it comes with v and leaves with -v, relative to the wall, so that with R the restitution

    v (1 - R) / (1 + R) = -a omega cos(theta),   v pi / (2 omega) = half_clearance + a sin(theta)   (2)
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


@machine(half_length="Give half_clearance.")
class ImpactPair(Machine):
    """Free mass between two walls that move together: loose parts, hinges, joints with play.

    Parameters
    ----------
    half_clearance
        Half the play, > 0.
    amplitude
        Amplitude a of the walls, > 0.
    omega
        Frequency of the walls, > 0.
    restitution
        Coefficient of restitution in [0, 1], of both walls.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "M. S. Heiman, P. J. Sherman, A. K. Bajaj, On the dynamics and stability of an inclined impact pair, J. "
        "Sound Vib. 114 (1987) 535-547. Numbers of equations: not to be had; (2) is derived in the file of the "
        "machine."
    )
    known_for = KnownFor(
        "Velocity after impacts at one wall over the clearance: chaos of the narrow slot, then impacts in turn.",
        "diagram", over=("half_clearance", 0.3, 3.0),
    )  # fmt: skip
    to_try = (
        (
            "diagram impact-pair --over half_clearance=0.2:3:200 --out diagram.png",
            "impacts in turn, then period doubling",
        ),
        (
            "basins impact-pair --half-clearance 2 --over x1=-2:2:100 --over v1=-3:3:100 --out basins.png",
            "several attractors",
        ),
    )

    half_clearance: float = parameter(positive, "length", default=1.0)
    amplitude: float = parameter(positive, "length", "wall amplitude $a$", default=1.0)
    omega: float = parameter(positive, "frequency", default=1.0)
    restitution: float = parameter(fraction, default=0.6)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A free mass between two stops that move."""
        b, walls = self.half_clearance, Harmonic(self.omega, (self.amplitude,))
        return Mechanism(
            mass=[[1.0]],
            damping=[[0.0]],
            stiffness=[[0.0]],
            elements=(RigidStop((1.0,), -b, b, self.restitution, motion=(walls,)),),
        )

    def free_start(self) -> State:
        """State in the middle, with the largest speed of the walls."""
        return State((0.0,), (self.amplitude * self.omega,))
