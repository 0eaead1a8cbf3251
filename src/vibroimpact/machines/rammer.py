"""The rammer: a machine with an unbalance that drops on plastic soil and compacts it.

    m x1'' + c x1' = m g + F sin(theta) - s k (x1 - x2),  theta' = omega                     (1)
    k (x1 - x2) s <= resistance; where it is equal the soil x2 yields, x2' >= 0              (2)

x1 points downwards, s is 1 where the machine presses the soil, x1 > x2, and 0 in the air. k is the elastic
stiffness of the soil; x2, its surface, is a coordinate without mass that friction holds, and only advances.
The set of one blow from the height h on soil at rest is, with the elastic deflection d = resistance / k,

    set = (m g (h + d) - resistance d / 2) / (resistance - m g)                              (3)
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
from vibroimpact.model.state import State


@machine()
class Rammer(Machine):
    """Rammer or vibratory compactor on plastic soil: its coordinates advance.

    Parameters
    ----------
    mass
        m of the machine, > 0.
    damping
        c of its guide, >= 0.
    soil_stiffness, soil_damping
        Elastic part of the soil: k > 0, and a dashpot beside it, >= 0.
    resistance
        Force at which the soil yields, > 0.
    gravity
        g >= 0.
    force
        Amplitude F of the force of the unbalance.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "Elastic-plastic soil under a ram: G. W. Luo et al. on vibro-impact drivers; A. M. Krivtsov, M. Wiercigroch "
        "on percussive drilling with dry friction (1999). Numbers of equations: not to be had; (3) is derived in "
        "the file of the machine."
    )
    known_for = KnownFor("Blow by blow the soil settles; between blows it rests.")
    to_try = (
        ("simulate rammer --t-max 60 --out rammer.svg", "the settlement, blow by blow"),
        (
            "sweep rammer --over omega=0.3:2:100 --observe progress --out speed.nc",
            "the best frequency",
        ),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.05)
    soil_stiffness: float = parameter(positive, "stiffness", "soil stiffness $k$", default=40.0)
    soil_damping: float = parameter(nonnegative, "damping", "soil damping", default=0.4)
    resistance: float = parameter(positive, "force", "resistance $f$", default=1.0)
    gravity: float = parameter(nonnegative, "acceleration", "gravity $g$", default=0.2)
    force: float = parameter(real, "force", default=0.6)
    omega: float = parameter(positive, "frequency", default=1.0)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """The machine, and the surface of the soil as a slider."""
        soil = SoftStop(
            (1.0, -1.0), upper=0.0, stiffness=self.soil_stiffness, damping=self.soil_damping
        )
        return Mechanism(
            mass=[[self.mass, 0.0], [0.0, 0.0]],
            damping=[[self.damping, 0.0], [0.0, 0.0]],
            stiffness=[[0.0, 0.0], [0.0, 0.0]],
            constant_force=(self.mass * self.gravity, 0.0),
            forces=(Harmonic(self.omega, (self.force, 0.0)),),
            elements=(soil, Friction((0.0, 1.0), self.resistance)),
        )

    def free_start(self) -> State:
        """State with the machine at rest on soil without pressure."""
        return State((0.0, 0.0), (0.0, 0.0))
