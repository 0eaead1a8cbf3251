"""The bilinear oscillator: a forced mass whose spring is stiffer beyond a gap.

    m x'' + c x' + k x + K max(x - gap, 0) = F cos(theta),  theta' = omega                   (1)

Without gap, damping and force it has for all amplitudes the period

    pi / sqrt(k / m) + pi / sqrt((k + K) / m)                                                (2)
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.soft_stop import SoftStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine(restitution="The limiting case of an infinite second stiffness is ImpactOscillator.")
class BilinearOscillator(Machine):
    """Piecewise linear oscillator: mooring lines, cracked beams, suspension bridge hangers.

    Parameters
    ----------
    mass
        m, > 0.
    damping
        c >= 0.
    stiffness
        k >= 0 of the spring that always acts.
    second_stiffness
        K > 0 that is added beyond the gap.
    gap
        Where the second spring begins; below 0 it is preloaded.
    force
        Amplitude F.
    omega
        Forcing frequency > 0.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) "
        "129-155; J. M. T. Thompson, R. Ghaffari (1982). Numbers of equations: not to be had."
    )
    known_for = KnownFor(
        "Place once a period over the frequency: subharmonic motions of order two and three.",
        "diagram", over=("omega", 2.2, 6.5), at="phase", variable="x1",
    )  # fmt: skip
    to_try = (
        (
            "diagram bilinear-oscillator --over omega=1:6:300 --out diagram.png",
            "subharmonic resonances",
        ),
        ("simulate bilinear-oscillator --omega 3 --out swing.svg", "swings on either spring"),
    )

    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    damping: float = parameter(nonnegative, "damping", "damping $c$", default=0.1)
    stiffness: float = parameter(nonnegative, "stiffness", "stiffness $k$", default=1.0)
    second_stiffness: float = parameter(positive, "stiffness", "second stiffness $K$", default=8.0)
    gap: float = parameter(real, "length", "gap", default=0.0)
    force: float = parameter(real, "force", default=1.0)
    omega: float = parameter(positive, "frequency", default=1.5)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A mass on a spring, and a second spring behind a gap."""
        return Mechanism(
            mass=[[self.mass]],
            damping=[[self.damping]],
            stiffness=[[self.stiffness]],
            forces=(Harmonic(self.omega, (0.0,), (self.force,)),),
            elements=(SoftStop((1.0,), upper=self.gap, stiffness=self.second_stiffness),),
        )
