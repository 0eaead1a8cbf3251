"""The piezoelectric harvester with an end stop: a mass on a bimorph that meets a soft stop.

    m x1'' + c x1' + k x1 + coupling V + f = m amplitude omega^2 sin(theta),  theta' = omega   (1)
    capacity V' + V / resistance = coupling x1',  V = x2';   f = k1 (x1 - gap) beyond the gap, else 0   (2)

x2 is the integral of the voltage V: the capacity is its mass, the load its dashpot. The coupling is a skew part
of the damping matrix and does no work; the power of the load is V^2 / resistance.
"""

from __future__ import annotations

from vibroimpact._core.checks import nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.soft_stop import SoftStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine()
class PiezoHarvester(Machine):
    """Piezoelectric energy harvester with a soft end stop; v2 is the voltage.

    Parameters
    ----------
    mass
        m, > 0.
    stiffness, damping
        k > 0 and c >= 0 of the bimorph.
    coupling
        Force per voltage, > 0.
    capacity, resistance
        Of the layer and of the load, > 0.
    gap
        Distance to the stop.
    stop_stiffness, stop_damping
        k1 > 0 of the stop, and a dashpot beside it, >= 0.
    amplitude
        Amplitude of the base, > 0.
    omega
        Frequency of the base, > 0.
    """

    source = (
        "Ai et al. (2019), a piezoelectric harvester with an end stop. Title and numbers of equations: not to be "
        "had; (1), (2) are the usual ones of one mode."
    )
    known_for = KnownFor(
        "Place once a period over the frequency, up and down: the stop bends the resonance over.",
        "diagram", over=("omega", 0.8, 1.6), way="both", at="phase", variable="x1",
    )  # fmt: skip
    to_try = (
        ("sweep piezo-harvester --over omega=0.8:1.6:100 --observe rms --out power.nc",
         "the stop widens the resonance"),
        ("diagram piezo-harvester --over omega=0.8:1.6:200 --way both --at phase=0 --out d.png", "its hysteresis"),
    )  # fmt: skip

    mass: float = parameter(positive, "", "mass $m$", default=1.0)
    stiffness: float = parameter(positive, "", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "", "damping $c$", default=0.02)
    coupling: float = parameter(positive, "", "coupling", default=0.2)
    capacity: float = parameter(positive, "", "capacity", default=1.0)
    resistance: float = parameter(positive, "", "resistance $R_L$", default=1.0)
    gap: float = parameter(real, "", "gap", default=0.5)
    stop_stiffness: float = parameter(positive, "", "stiffness of the stop $k_1$", default=4.0)
    stop_damping: float = parameter(nonnegative, "", "damping of the stop", default=0.05)
    amplitude: float = parameter(positive, "", "base amplitude", default=0.1)
    omega: float = parameter(positive, default=1.1)

    @property
    def mechanism(self) -> Mechanism:
        """The mass and the integral of the voltage, coupled by a skew damping matrix."""
        p = self.coupling
        stop = SoftStop(
            (1.0, 0.0), upper=self.gap, stiffness=self.stop_stiffness, damping=self.stop_damping
        )
        drive = self.mass * self.amplitude * self.omega**2
        return Mechanism(
            mass=[[self.mass, 0.0], [0.0, self.capacity]],
            damping=[[self.damping, p], [-p, 1.0 / self.resistance]],
            stiffness=[[self.stiffness, 0.0], [0.0, 0.0]],
            forces=(Harmonic(self.omega, (drive, 0.0)),),
            elements=(stop,),
        )
