"""The impact damper: a free mass in a slot of a vibrating main mass.

    mass (x1'' + 2 zeta omega_n x1' + omega_n^2 x1) = force sin(omega t)      (3) of the paper
    mass_ratio mass x2'' = 0  while  |x2 - x1| < half_clearance               (4)

Stop A is x2 - x1 = +half_clearance (the paper's section), stop B is x2 - x1 = -half_clearance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from vibroimpact._core.checks import (
    check_stop_name,
    fraction,
    nonnegative,
    positive,
    real,
)
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import FRICTIONLESS, RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop


@machine(
    M1="Give SI values to ImpactDamper.from_physical.",
    friction=FRICTIONLESS,
    stiffness="Give omega_n. Stops are rigid.",
)
class ImpactDamper(Machine):
    """Two-degree-of-freedom impact damper, in any consistent units.

    Parameters
    ----------
    mass_ratio
        mu = M2 / M1 > 0.
    omega_n
        Natural frequency of the main mass, >= 0 (0: no spring).
    zeta
        Damping ratio of the main mass, >= 0; above 1 it is overdamped.
    restitution
        Coefficient of restitution R in [0, 1].
    half_clearance
        delta > 0, half the play of the free mass.
    omega
        Forcing frequency > 0.
    force
        Force amplitude, > 0; only ``half_clearance mass / force`` matters for the motion.
    mass
        Main mass M1 > 0; 1 where all else is nondimensional.
    si
        Whether the numbers are in SI units, which labels and reports then name.

    Raises
    ------
    InvalidParameterError
        A value outside its range; the message names value, range and remedy.

    Notes
    -----
    Exact scaling: (omega_n, omega, half_clearance, t) -> (s omega_n, s omega,
    half_clearance / s^2, t / s) maps motions to motions, x -> x / s^2 (theory.md, "Model").

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> round(damper.period, 6)
    5.235988
    """

    source = "The paper on the impact damper, equations (1) to (4): docs/references.bib, paper."
    known_for = KnownFor(
        "Points at stop A of a motion at omega = 0.9958: a closed curve, so a torus.",
        "section", parameters={"omega": 0.9958}, settled=2000,
    )  # fmt: skip
    to_try = (
        (
            "branch impact-damper/A --bounds omega=0.5:1.5 --out branch.svg",
            "stability and bifurcations",
        ),
        ("simulate impact-damper/2a --impacts 4000 --out history.svg", "a figure of the paper"),
    )
    example: ClassVar[Mapping[str, float]] = {
        "mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, "restitution": 0.8, "half_clearance": 5.0, "omega": 1.2,
    }  # fmt: skip

    mass_ratio: float = parameter(positive, advice="It is M2 / M1.")
    omega_n: float = parameter(nonnegative, "frequency")
    zeta: float = parameter(nonnegative)
    restitution: float = parameter(fraction)
    half_clearance: float = parameter(positive, "length", advice="Without play there is no impact.")
    omega: float = parameter(positive, "frequency", advice="The force must be periodic.")
    force: float = parameter(positive, "force", default=1.0)
    mass: float = parameter(positive, "mass", "main mass $M_1$", default=1.0)
    si: bool = field(default=False, compare=False)

    physical: ClassVar[Mapping[str, str]] = {
        "M1": "mass", "M2": "mass", "K": "stiffness", "C": "damping", "F0": "force",
        "Omega": "frequency", "D": "length", "restitution": "",
    }  # fmt: skip
    letters: ClassVar[Mapping[str, tuple[str, float]]] = {
        "D": ("half_clearance", 0.5), "Omega": ("omega", 1.0), "F0": ("force", 1.0),
    }  # fmt: skip

    @classmethod
    def from_physical(  # type: ignore[override]
        cls,
        *,
        M1: float,
        M2: float,
        K: float,
        C: float,
        F0: float,
        Omega: float,
        D: float,
        restitution: float,
    ) -> ImpactDamper:
        """Make a damper in SI units.

        Parameters
        ----------
        M1, M2
            Main and free mass [kg], > 0.
        K, C
            Stiffness [N/m], > 0, and damping [N s/m], >= 0, of the main mass.
        F0, Omega
            Force amplitude [N], > 0, and angular frequency [rad/s], > 0.
        D
            Whole play of the free mass [m], > 0.
        restitution
            Coefficient of restitution in [0, 1].

        Notes
        -----
        omega_n = sqrt(K / M1), zeta = C / (2 sqrt(K M1)), half_clearance = D / 2, force = F0.
        """
        given = {"M1": M1, "M2": M2, "K": K, "F0": F0, "Omega": Omega, "D": D}
        m1, m2, k, f0, big_omega, d = (positive(name, x) for name, x in given.items())
        c = nonnegative("C", C)
        return cls(
            mass_ratio=m2 / m1,
            omega_n=(k / m1) ** 0.5,
            zeta=c / (2.0 * (k * m1) ** 0.5),
            restitution=restitution,
            half_clearance=d / 2.0,
            omega=big_omega,
            force=f0,
            mass=m1,
            si=True,
        )

    @property
    def period(self) -> float:
        """Forcing period 2 pi / omega."""
        return 2.0 * 3.141592653589793 / self.omega

    @property
    def mechanism(self) -> Mechanism:
        """The damper as masses, springs and a two-sided contact."""
        m, w = self.mass, self.omega_n
        return Mechanism(
            mass=[[m, 0.0], [0.0, self.mass_ratio * m]],
            damping=[[2.0 * self.zeta * w * m, 0.0], [0.0, 0.0]],
            stiffness=[[w * w * m, 0.0], [0.0, 0.0]],
            forces=(Harmonic(self.omega, (self.force, 0.0)),),
            elements=(
                RigidStop((-1.0, 1.0), -self.half_clearance, self.half_clearance, self.restitution),
            ),
        )

    def free_start(self) -> State:
        """State with both masses in the middle, the free one with velocity force / (mass omega)."""
        return State((0.0, 0.0), (0.0, self.force / (self.mass * self.omega)))

    def on_stop(self, stop: str, *, x1: float, v1: float, v2: float, phase: float) -> State:
        """A state in which the free mass stands on stop "A" or "B".

        Parameters
        ----------
        stop
            "A" (x2 = x1 + half_clearance) or "B" (x2 = x1 - half_clearance).
        x1, v1, v2
            Place and velocity of the main mass, velocity of the free mass.
        phase
            Phase theta of the force F sin(theta) at this instant, radians.
        """
        check_stop_name(stop)
        place = real("x1", x1)
        speeds = real("v1", v1), real("v2", v2)
        side = float(Stop.at(stop).side)
        return State((place, place + side * self.half_clearance), speeds, phase)
