"""The soft impact oscillator: a mass on a shaken base that meets a spring and a dashpot behind a gap.

    x'' + 2 zeta x' + x + (beta (x - gap) + 2 zeta_stop x') [x > gap] = a omega^2 sin(theta),  theta' = omega   (1)

Time is scaled by the natural frequency without the stop, beta is the ratio of the stiffnesses, a the amplitude
of the base in units of a length. The motion without impacts grazes the stop where

    a omega^2 / hypot(1 - omega^2, 2 zeta omega) = gap                                       (2)
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import nonnegative, positive, real
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.soft_stop import SoftStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism


@machine(restitution="The stop is a spring here; ImpactOscillator has a rigid one.")
class SoftImpactOscillator(Machine):
    """Oscillator with a soft stop: the model of an experiment on grazing, stiffness ratio 29.

    Parameters
    ----------
    zeta
        Damping ratio >= 0 without the stop.
    stiffness_ratio
        beta, stiffness of the stop over that of the oscillator, > 0.
    stop_zeta
        Damping 2 zeta_stop beside that spring, as a ratio, >= 0.
    gap
        Distance to the stop.
    amplitude
        Amplitude a of the base, >= 0.
    omega
        Frequency of the base, > 0.
    omega_n
        Natural frequency without the stop, > 0; 1 where times are scaled by it.
    mass
        Mass > 0; 1 where all else is nondimensional.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "J. Ing, E. Pavlovskaia, M. Wiercigroch, S. Banerjee, Experimental study of impact oscillator with "
        "one-sided elastic constraint, Phil. Trans. R. Soc. A 366 (2008) 679-704. Numbers of equations: not to be "
        "had; of its parameters only the ratio 29 is taken from it."
    )
    known_for = KnownFor(
        "Place once a period over the frequency: the touch of the stop, a narrow band, period two, chaos.",
        "diagram", over=("omega", 0.7, 0.95), at="phase", variable="x1",
    )  # fmt: skip
    to_try = (
        (
            "diagram soft-impact-oscillator --over omega=0.6:1:300 --out diagram.png",
            "a narrow band of chaos at grazing",
        ),
        (
            "section soft-impact-oscillator --omega 0.8 --at phase=0",
            "a strange attractor near grazing",
        ),
    )

    zeta: float = parameter(nonnegative, default=0.01)
    stiffness_ratio: float = parameter(positive, "", r"stiffness ratio $\beta$", default=29.0)
    stop_zeta: float = parameter(nonnegative, "", "damping ratio of the stop", default=0.0)
    gap: float = parameter(real, "length", "gap $e$", default=1.26)
    amplitude: float = parameter(nonnegative, "length", "base amplitude $a$", default=0.7)
    omega: float = parameter(positive, "frequency", default=0.8)
    omega_n: float = parameter(positive, "frequency", default=1.0)
    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    si: bool = field(default=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """A mass relative to its base, with a soft stop."""
        m, w = self.mass, self.omega_n
        stop = SoftStop(
            (1.0,),
            upper=self.gap,
            stiffness=self.stiffness_ratio * m * w * w,
            damping=2.0 * self.stop_zeta * m * w,
        )
        return Mechanism(
            mass=[[m]],
            damping=[[2.0 * self.zeta * w * m]],
            stiffness=[[m * w * w]],
            forces=(Harmonic(self.omega, (m * self.amplitude * self.omega**2,)),),
            elements=(stop,),
        )
