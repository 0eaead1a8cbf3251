"""Gear rattle: a lightly loaded gear between the rigid flanks of an eccentric one.

With the displacements y0 = V t + e cos(theta) of the driving and y of the driven flank along the line
of action, theta' = omega, and m y'' = -c y' between the flanks, x = y0 - y has

    m x'' + c x' = c V - m e omega^2 cos(theta) - c e omega sin(theta),  |x| <= half_clearance   (1)

Stop A is the flank that drives, x = half_clearance; stop B is the back flank.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine(stiffness="Flanks are rigid here; GearBacklash has a mesh stiffness.")
class GearRattle(Machine):
    """Gear pair with rigid teeth, backlash, drag and an eccentric driver, along the line of action.

    Parameters
    ----------
    mass
        Inertia of the driven gear over the square of its base radius, > 0.
    drag
        Viscous drag c on the driven gear, >= 0.
    speed
        Mean speed V of the flanks along the line of action, >= 0.
    eccentricity
        Amplitude e of the displacement of the driving flank, >= 0.
    omega
        Frequency of the eccentricity, > 0: once a revolution.
    half_clearance
        Half the backlash, > 0.
    restitution
        Coefficient of restitution in [0, 1], of both flanks.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "J. F. Mason, P. T. Piiroinen, The effect of codimension-two bifurcations on the global dynamics of a gear "
        "model, SIAM J. Appl. Dyn. Syst. 8 (2009) 1694-1711; J. Mason, M. Homer, R. E. Wilson, Mathematical models of "
        "gear rattle in Roots blower vacuum pumps, J. Sound Vib. 308 (2007). Numbers of equations: not to be "
        "had; (1) is "
        "derived in the file of the machine."
    )

    known_for = KnownFor(
        "Speed after impacts on the driving flank over the eccentricity: chaos, one impact in a turn, two.",
        "diagram", over=("eccentricity", 0.05, 0.6),
    )  # fmt: skip
    to_try = (
        (
            "diagram gear-rattle --over eccentricity=0.05:0.6:200 --out diagram.png",
            "silent, one flank, both flanks",
        ),
        (
            "basins gear-rattle --over x1=-0.6:0.6:100 --over v1=-4:4:100 --out basins.png",
            "several attractors",
        ),
    )

    mass: float = parameter(positive, "mass", "reduced inertia $m$", default=1.0)
    drag: float = parameter(nonnegative, "damping", "drag $c$", default=0.6)
    speed: float = parameter(nonnegative, "velocity", "mean speed $V$", default=2.0)
    eccentricity: float = parameter(nonnegative, "length", "eccentricity $e$", default=0.3)
    omega: float = parameter(positive, "frequency", default=6.0)
    half_clearance: float = parameter(positive, "length", default=0.6)
    restitution: float = parameter(fraction, default=0.9)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """The play of the flanks as one coordinate."""
        m, c, w, e = self.mass, self.drag, self.omega, self.eccentricity
        b = self.half_clearance
        return Mechanism(
            mass=[[m]],
            damping=[[c]],
            stiffness=[[0.0]],
            constant_force=(c * self.speed,),
            forces=(Harmonic(w, (-c * e * w,), (-m * e * w * w,)),),
            elements=(RigidStop((1.0,), -b, b, self.restitution),),
        )
