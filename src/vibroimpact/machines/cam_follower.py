"""The cam follower: a mass that a preloaded spring presses on a harmonic cam, y = a sin(theta).

    m x'' + c x' + k x = -preload,   x >= a sin(theta),  theta' = omega                      (1)

While it follows the cam the contact force is, without dashpot, preload + (k - m omega^2) a sin(theta): the
follower lifts off where omega^2 > (k + preload / a) / m, first at the phase

    sin(theta) = preload / ((m omega^2 - k) a)                                               (2)
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, nonnegative, positive
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


@machine(gravity="The weight of the follower is a part of preload.")
class CamFollower(Machine):
    """Cam and follower: at high speed the follower lifts off, and hammers on the cam.

    Parameters
    ----------
    mass
        m of the follower, > 0.
    stiffness, damping
        k >= 0 and c >= 0 of its spring.
    preload
        Force of the spring at the middle of the lift, with the weight, > 0.
    amplitude
        Half the lift a of the cam, > 0.
    omega
        Angular speed of the cam, > 0.
    restitution
        Coefficient of restitution in [0, 1].
    si
        Whether the numbers are in SI units.
    """

    source = (
        "G. Osorio, M. di Bernardo, S. Santini, Corner-impact bifurcations in cam-follower systems, "
        "arXiv:0711.1008, here with a harmonic cam, without corners. Numbers of equations: not to be had; (2) is "
        "derived in the file of the machine."
    )
    known_for = KnownFor(
        "The follower leaves the cam, lands with a few bounces, and rests on it again."
    )
    to_try = (
        (
            "diagram cam-follower --over omega=1.4:3:200 --at B --out diagram.png",
            "lift-off, then one impact per turn and more",
        ),
        ("simulate cam-follower --out follower.svg", "how it leaves the cam and lands"),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    stiffness: float = parameter(nonnegative, "stiffness", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.0)
    preload: float = parameter(positive, "force", "preload", default=1.5)
    amplitude: float = parameter(positive, "length", "half lift $a$", default=1.0)
    omega: float = parameter(positive, "frequency", default=2.0)
    restitution: float = parameter(fraction, default=0.3)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A mass on a spring above a stop that moves."""
        cam = Harmonic(self.omega, (self.amplitude,))
        return Mechanism(
            mass=[[self.mass]],
            damping=[[self.damping]],
            stiffness=[[self.stiffness]],
            constant_force=(-self.preload,),
            elements=(RigidStop((1.0,), 0.0, restitution=self.restitution, motion=(cam,)),),
        )

    def free_start(self) -> State:
        """State at rest above the cam, by a tenth of its lift."""
        return State((1.2 * self.amplitude,), (0.0,))
