"""The multi-unit impact damper: several free masses, each in a slot of its own, on one vibrating mass.

    mass x'' + damping x' + stiffness x = force sin(theta),  theta' = omega                 (1)
    (mass_ratio mass / units) xi'' = 0,   |xi - x| <= half_clearance,  i = 1 ... units       (2)

Units that move alike act as one of their whole mass; units out of step share the work and the noise.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import check_count, fraction, nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State

MOST_UNITS = 16  # elements of a mechanism


def _units(name: str, value: int) -> int:
    check_count(name, value, 1, MOST_UNITS)
    return int(value)


@machine(omega_n="Give stiffness and mass.", zeta="Give damping.")
class MultiUnitDamper(Machine):
    """Impact damper with several equal free masses in parallel.

    Parameters
    ----------
    units
        Number of free masses, 1 to 16.
    mass
        Main mass, > 0.
    mass_ratio
        All free masses together over the main mass, > 0.
    stiffness, damping
        Of the main mass, >= 0.
    half_clearance
        Half the play of each free mass, > 0.
    restitution
        Coefficient of restitution in [0, 1].
    force
        Force amplitude on the main mass.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "S. F. Masri, Analytical and experimental studies of multiple-unit impact dampers, J. Acoust. Soc. Am. 45 "
        "(1969) 1111-1117. Numbers of equations: not to be had."
    )
    known_for = KnownFor("Four units in their cavities: they need not move alike.")
    to_try = (
        ("diagram multi-unit-damper --over omega=0.7:1.3:100 --out d.png", "beside --units 1"),
        ("simulate multi-unit-damper --out units.svg", "units in step and out of step"),
    )

    units: int = parameter(_units, "", "number of units", default=3)
    mass: float = parameter(positive, "mass", "main mass $M_1$", default=1.0)
    mass_ratio: float = parameter(positive, default=0.1)
    stiffness: float = parameter(nonnegative, "stiffness", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.02)
    half_clearance: float = parameter(positive, "length", default=2.0)
    restitution: float = parameter(fraction, default=0.6)
    force: float = parameter(real, "force", default=0.1)
    omega: float = parameter(positive, "frequency", default=1.0)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """The main mass, and a two-sided stop for each free one."""
        n, b, m = self.units, self.half_clearance, self.mass
        each = self.mass_ratio * m / n
        rows = range(n + 1)

        def only_main(value: float) -> list[list[float]]:
            return [[value if i == j == 0 else 0.0 for j in rows] for i in rows]

        slots = [tuple(-1.0 if j == 0 else float(j == i) for j in rows) for i in rows if i]
        return Mechanism(
            mass=[[(each if i else m) if i == j else 0.0 for j in rows] for i in rows],
            damping=only_main(self.damping),
            stiffness=only_main(self.stiffness),
            forces=(Harmonic(self.omega, (self.force, *[0.0] * n)),),
            elements=tuple(RigidStop(row, -b, b, self.restitution) for row in slots),
        )

    def free_start(self) -> State:
        """State with all masses in the middle of their play, the free ones with speeds of their own."""
        speed, n = self.half_clearance * self.omega / 3.141592653589793, self.units
        speeds = [speed * (i + 1.0) / n for i in range(n)]
        return State((0.0,) * (n + 1), (0.0, *speeds))
