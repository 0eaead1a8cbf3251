"""Gear pair with backlash: a mesh spring on either flank, a mean load and a transmission error.

    m x'' + c x' + k g(x) = F + A cos(theta),  theta' = omega                                (1)
    g(x) = x - b for x > b, 0 within the backlash |x| < b, x + b for x < -b                  (2)

x is the displacement of the flanks along the line of action, m the reduced inertia of both gears. With
law "linear" the dashpot of the mesh acts only in contact.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.soft_stop import SoftStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


@machine(restitution="Flanks are springs here; GearRattle has rigid ones.")
class GearBacklash(Machine):
    """Gear pair with backlash and a constant mesh stiffness, along the line of action.

    Parameters
    ----------
    mass
        Reduced inertia m of both gears, > 0.
    damping
        Damping c of the shafts, >= 0.
    mesh_stiffness, mesh_damping
        k > 0 of the mesh, and the dashpot beside it, >= 0.
    half_clearance
        Half the backlash b, > 0.
    load
        Mean force F that presses the driving flanks together.
    force
        Amplitude A of the force of the transmission error.
    omega
        Mesh frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "R. J. Comparin, R. Singh, Non-linear frequency response characteristics of an impact pair, J. Sound Vib. "
        "134 (1989). Numbers of equations: not to be had; (1), (2) are the usual form. A mesh stiffness that varies "
        "with the phase has periodic coefficients, which no mechanism has."
    )
    known_for = KnownFor(
        "Play once a period over the frequency, up and down: two motions between the jumps.",
        "diagram", over=("omega", 0.4, 1.4), way="both", at="phase", variable="x1",
    )  # fmt: skip
    to_try = (
        ("simulate gear-backlash --omega 0.6 --out teeth.svg", "flanks that part and meet"),
        (
            "diagram gear-backlash --over omega=0.4:1.2:200 --way both --out diagram.png",
            "its hysteresis",
        ),
    )

    mass: float = parameter(positive, "mass", "reduced inertia $m$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.1)
    mesh_stiffness: float = parameter(positive, "stiffness", "mesh stiffness $k$", default=1.0)
    mesh_damping: float = parameter(nonnegative, "damping", "mesh damping", default=0.0)
    half_clearance: float = parameter(positive, "length", "half backlash $b$", default=1.0)
    load: float = parameter(real, "force", "mean load $F$", default=0.1)
    force: float = parameter(real, "force", "force amplitude $A$", default=0.2)
    omega: float = parameter(positive, "frequency", default=0.7)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """The play of the flanks as one coordinate between two springs."""
        b, k, c = self.half_clearance, self.mesh_stiffness, self.mesh_damping
        return Mechanism(
            mass=[[self.mass]],
            damping=[[self.damping]],
            stiffness=[[0.0]],
            constant_force=(self.load,),
            forces=(Harmonic(self.omega, (0.0,), (self.force,)),),
            elements=(SoftStop((1.0,), -b, b, k, c, law="linear"),),
        )

    def free_start(self) -> State:
        """State at rest on the driving flank, under the mean load."""
        return State((self.half_clearance + self.load / self.mesh_stiffness,), (0.0,))
