"""The electromagnetic harvester with stops: a magnet on a spring, a coil with a load, and end stops.

    m x1'' + c x1' + k x1 + coupling i = m amplitude omega^2 sin(theta),  theta' = omega     (1)
    inductance i' + resistance i = coupling x1',  i = x2',   |x1| <= clearance               (2)

x1 is the magnet relative to its base, which moves as amplitude sin(theta), x2 the charge that has flown. The
coupling is a skew part of the damping matrix and does no work; the power of the load is resistance i^2.
"""

from __future__ import annotations

from vibroimpact._core.checks import fraction, nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine()
class ElectromagneticHarvester(Machine):
    """Electromagnetic energy harvester between end stops; v2 is the current.

    Parameters
    ----------
    mass
        m of the magnet, > 0.
    stiffness, damping
        k > 0 and c >= 0 of its suspension.
    coupling
        Force per current, > 0.
    inductance, resistance
        Of the coil with its load, > 0.
    clearance
        Distance of the stops from the middle, > 0.
    restitution
        Coefficient of restitution in [0, 1].
    amplitude
        Amplitude of the base, > 0.
    omega
        Frequency of the base, > 0.
    """

    source = (
        "M. S. M. Soliman et al., A wideband vibration-based energy harvester, J. Micromech. Microeng. 18 (2008). "
        "Numbers of equations: not to be had; (1), (2) are the usual ones of a moving magnet, with rigid stops."
    )
    known_for = KnownFor(
        "Place once a period over the frequency: where the stops are reached, chaos, then an impact at each.",
        "diagram", over=("omega", 0.8, 1.6), way="both", at="phase", variable="x1",
    )  # fmt: skip
    to_try = (
        ("sweep electromagnetic-harvester --over omega=0.8:1.6:100 --observe rms --out power.nc",
         "stops widen the resonance"),
        ("diagram electromagnetic-harvester --over omega=0.8:1.6:200 --way both --out diagram.png", "its hysteresis"),
    )  # fmt: skip

    mass: float = parameter(positive, "", "mass $m$", default=1.0)
    stiffness: float = parameter(positive, "", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "", "damping $c$", default=0.02)
    coupling: float = parameter(positive, "", "coupling", default=0.2)
    inductance: float = parameter(positive, "", "inductance $L$", default=0.2)
    resistance: float = parameter(positive, "", "resistance $R_L$", default=1.0)
    clearance: float = parameter(positive, "", "clearance", default=1.0)
    restitution: float = parameter(fraction, default=0.7)
    amplitude: float = parameter(positive, "", "base amplitude", default=0.2)
    omega: float = parameter(positive, default=1.1)

    @property
    def mechanism(self) -> Mechanism:
        """Magnet and charge; the coil is a mass on a dashpot, coupled by a skew damping matrix."""
        p, s = self.coupling, self.clearance
        drive = self.mass * self.amplitude * self.omega**2
        return Mechanism(
            mass=[[self.mass, 0.0], [0.0, self.inductance]],
            damping=[[self.damping, p], [-p, self.resistance]],
            stiffness=[[self.stiffness, 0.0], [0.0, 0.0]],
            forces=(Harmonic(self.omega, (drive, 0.0)),),
            elements=(RigidStop((1.0, 0.0), -s, s, self.restitution),),
        )
