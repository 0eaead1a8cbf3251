"""The wheelset: lateral hunting of two conical wheels on an axle, with linear creep and rigid flanges.

With the lateral displacement y, the yaw angle psi, half the gauge a and u = a psi,

    m y'' + (2 f / V) y' + k y - (2 f / a) u = 0                                             (1)
    I u'' / a^2 + (2 f / V) u' + k_u u + (2 f conicity / r) y = 0,   |y| <= half_clearance   (2)

f is the coefficient of creep, the same along and across the rail, r the radius of the wheels, and k_u the
stiffness in yaw over a^2. The matrix of the stiffness is not symmetric: creep feeds energy in. Where both
springs have one natural frequency w0 and I = m a^2, the wheelset at rest loses its stability at the speed

    V = w0 sqrt(r a / conicity)                                                              (3)

at which Klingel's kinematic frequency V sqrt(conicity / (r a)) is w0.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


@machine()
class Wheelset(Machine):
    """Railway wheelset with linear creep that hunts between rigid flanges; x1 is lateral, x2 = a psi yaw.

    Parameters
    ----------
    mass
        m, > 0.
    yaw_mass
        I / a^2, moment of inertia in yaw over the square of half the gauge, > 0.
    stiffness, yaw_stiffness
        k >= 0 of the lateral suspension, and k_u >= 0 of that in yaw over the square of half the gauge.
    creep
        Coefficient of creep f > 0.
    half_gauge
        a > 0.
    radius
        Radius r of the wheels, > 0.
    conicity
        Slope of the treads, > 0.
    speed
        Running speed V > 0.
    half_clearance
        Lateral distance of either flange from its rail, > 0.
    restitution
        Coefficient of restitution in [0, 1], of the flanges.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "J. P. Meijaard, A. D. de Pater, Railway vehicle systems dynamics and chaotic vibrations (1989); A. H. "
        "Wickens, Fundamentals of Rail Vehicle Dynamics (2003). Numbers of equations: not to be had; (3) is derived "
        "in the file of the machine. Creep that saturates is no linear force, and is left out."
    )
    known_for = KnownFor(
        "It begins to hunt, and strikes the flanges in turn.", settled=0.0, shown=60.0
    )
    to_try = (
        ("simulate wheelset --speed 1.2 --out hunting.svg", "hunting from flange to flange"),
        (
            "sweep wheelset --over speed=0.8:2:100 --observe impacts --out hunting.nc",
            "the critical speed",
        ),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    yaw_mass: float = parameter(positive, "mass", "yaw inertia $I/a^2$", default=1.0)
    stiffness: float = parameter(nonnegative, "stiffness", "stiffness $k$", default=1.0)
    yaw_stiffness: float = parameter(nonnegative, "stiffness", "yaw stiffness $k_u$", default=1.0)
    creep: float = parameter(positive, "force", "coefficient of creep $f$", default=1.0)
    half_gauge: float = parameter(positive, "length", "half gauge $a$", default=1.0)
    radius: float = parameter(positive, "length", "wheel radius $r$", default=0.6)
    conicity: float = parameter(positive, "", r"conicity $\lambda$", default=0.6)
    speed: float = parameter(positive, "velocity", "speed $V$", default=1.2)
    half_clearance: float = parameter(positive, "length", default=1.0)
    restitution: float = parameter(fraction, default=0.5)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """Lateral and yaw displacement with creep, and stops on the first."""
        drag, across = 2.0 * self.creep / self.speed, 2.0 * self.creep / self.half_gauge
        steering = 2.0 * self.creep * self.conicity / self.radius
        b = self.half_clearance
        return Mechanism(
            mass=[[self.mass, 0.0], [0.0, self.yaw_mass]],
            damping=[[drag, 0.0], [0.0, drag]],
            stiffness=[[self.stiffness, -across], [steering, self.yaw_stiffness]],
            elements=(RigidStop((1.0, 0.0), -b, b, self.restitution),),
        )

    def free_start(self) -> State:
        """State displaced by half the way to a flange."""
        return State((self.half_clearance / 2.0, 0.0), (0.0, 0.0))
