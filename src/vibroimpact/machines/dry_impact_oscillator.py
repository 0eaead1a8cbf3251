"""The impact oscillator with dry friction: a forced mass that rubs on the ground and meets a stop.

    m x'' + c x' + k x + friction sign(x') = F cos(theta),  theta' = omega,   x <= clearance   (1)

Free swings of a mass without dashpot lose 2 friction / k of their size in each half period.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.friction import Friction
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


@machine()
class DryImpactOscillator(Machine):
    """Impact oscillator with Coulomb friction on the ground.

    Parameters
    ----------
    mass
        m, > 0.
    stiffness, damping
        k > 0 and c >= 0.
    friction
        Friction force, >= 0.
    clearance
        Distance of the stop from the place where the spring is without force.
    restitution
        Coefficient of restitution in [0, 1].
    force
        Amplitude F.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "K. M. Cone, R. I. Zadoks, A numerical study of an impact oscillator with the addition of dry friction, J. "
        "Sound Vib. 188 (1995) 659-683. Numbers of equations: not to be had."
    )
    known_for = KnownFor(
        "Speed after the impacts over the frequency, with friction.",
        "diagram", over=("omega", 0.5, 5.0),
    )  # fmt: skip
    to_try = (
        (
            "diagram dry-impact-oscillator --over omega=0.5:3:200 --out diagram.png",
            "beside --friction 0",
        ),
        ("simulate dry-impact-oscillator --out dry.svg", "where it sticks between impacts"),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    stiffness: float = parameter(positive, "stiffness", "stiffness $k$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.0)
    friction: float = parameter(nonnegative, "force", "friction force", default=0.1)
    clearance: float = parameter(real, "length", "clearance $s$", default=0.2)
    restitution: float = parameter(fraction, default=0.8)
    force: float = parameter(real, "force", default=1.0)
    omega: float = parameter(positive, "frequency", default=2.0)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A mass on a spring that rubs on the ground, and a stop."""
        stop = RigidStop((1.0,), upper=self.clearance, restitution=self.restitution)
        return Mechanism(
            mass=[[self.mass]],
            damping=[[self.damping]],
            stiffness=[[self.stiffness]],
            forces=(Harmonic(self.omega, (0.0,), (self.force,)),),
            elements=(stop, Friction((1.0,), self.friction)),
        )

    def free_start(self) -> State:
        """State at rest, off the stop by the static deflection at least."""
        return State((min(0.0, self.clearance - abs(self.force) / self.stiffness),), (0.0,))
