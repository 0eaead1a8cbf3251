"""The mole: a mass with a static and a harmonic force that drives a visco-elastic frictional slider.

    m x1'' = b + a cos(theta) - p,  theta' = omega                                           (1)
    p = k (x1 - x2 - gap) + c (x1' - x2') in contact, where that presses, else 0             (2)
    p <= resistance; where it is equal the slider advances, x2' >= 0                         (3)

x2 is the bottom of the slider, without mass; x1 - x2 = gap where the mass meets its top. The set of one blow
with the speed v, without forces and dashpot, is (m v^2 / 2 - resistance^2 / (2 k)) / resistance.
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


@machine()
class Mole(Machine):
    """Ground moling: an impact oscillator with drift, on a visco-elastic slider in dry soil.

    Parameters
    ----------
    mass
        m, > 0.
    stiffness, damping
        k > 0 and c >= 0 of the slider.
    gap
        Distance of the mass from the top of the slider.
    resistance
        Friction force that the soil holds, > 0.
    static_force
        Constant force b.
    force
        Amplitude a of the harmonic force.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.

    Notes
    -----
    In the model of the source the top of the slider, which has no mass, recovers by itself with the time c / k
    after it has lost the mass; here it recovers at once where the mass leaves, and meets it again at the gap.
    """

    source = (
        "E. Pavlovskaia, M. Wiercigroch, C. Grebogi, Modeling of an impact system with a drift, Phys. Rev. E 64 "
        "(2001) 056224; E. Pavlovskaia, M. Wiercigroch, Analytical drift reconstruction for visco-elastic impact "
        "oscillators operating in "
        "periodic and chaotic regimes, Chaos, Solitons and Fractals (2003), doi 10.1016/S0960-0779(03)00128-0, Fig. 3: "
        "a = 0.3, b = 0.1, damping ratio 0.01, omega = 0.1. Numbers of equations: not to be had."
    )
    known_for = KnownFor("Each blow drives the slider into the soil: two blows of different size.")
    to_try = (
        ("simulate mole --t-max 300 --out mole.svg", "progress, blow by blow"),
        (
            "sweep mole --over static_force=0.02:0.3:100 --observe progress --out rate.nc",
            "the best static force",
        ),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    stiffness: float = parameter(positive, "stiffness", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.02)
    gap: float = parameter(real, "length", "gap", default=0.02)
    resistance: float = parameter(positive, "force", "resistance", default=1.0)
    static_force: float = parameter(real, "force", "static force $b$", default=0.1)
    force: float = parameter(real, "force", "force amplitude $a$", default=0.3)
    omega: float = parameter(positive, "frequency", default=0.1)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """The mass, and the bottom of the slider as a coordinate without mass."""
        slider = SoftStop(
            (1.0, -1.0), upper=self.gap, stiffness=self.stiffness, damping=self.damping
        )
        nothing = [[0.0, 0.0], [0.0, 0.0]]
        return Mechanism(
            mass=[[self.mass, 0.0], [0.0, 0.0]],
            damping=nothing,
            stiffness=nothing,
            constant_force=(self.static_force, 0.0),
            forces=(Harmonic(self.omega, (0.0, 0.0), (self.force, 0.0)),),
            elements=(slider, Friction((0.0, 1.0), self.resistance)),
        )
