"""The impact oscillator: a forced mass on a spring and a dashpot that meets one stop, or two.

    mass (x'' + 2 zeta omega_n x' + omega_n^2 x) = force cos(theta),  theta' = omega   (1)
    x <= clearance,  and with two stops  -lower_clearance <= x                         (2)
    x' -> -restitution x'  where (2) holds with equality                               (3)

With mass, omega_n and force 1 lengths are scaled by the deflection under a static force of that
amplitude, time by the natural frequency. Stop A is x = clearance, stop B is x = -lower_clearance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from vibroimpact._core.checks import (
    check_stop_name,
    fraction,
    nonnegative,
    positive,
    real,
    real_or_infinite,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import AnyFloat
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import FRICTIONLESS, RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


def _distance(name: str, value: float | None) -> float | None:
    """Distance to a stop; None where there is no stop, which infinity means, too."""
    if value is None:
        return None
    number = real_or_infinite(name, value, "a finite number, or left out where there is no stop")
    if is_infinite(number) and number > 0.0:
        return None
    return real(name, number, "a finite number, or left out where there is no stop")


@machine(
    stiffness="Give omega_n, or K to ImpactOscillator.from_physical.",
    half_clearance="Give clearance, and the same as lower_clearance for stops on both sides.",
    friction=FRICTIONLESS,
)
class ImpactOscillator(Machine):
    """Forced linear oscillator with one stop or two, in any consistent units.

    Parameters
    ----------
    zeta
        Damping ratio, >= 0; above 1 the oscillator is overdamped.
    omega
        Forcing frequency > 0.
    restitution
        Coefficient of restitution in [0, 1], of every stop.
    clearance
        Distance from the unforced rest position x = 0 up to stop A: any finite number. With 0 the
        mass just touches the stop, below 0 the spring presses it against the stop.
    lower_clearance
        Distance from x = 0 down to stop B, above -clearance; without it there is no stop B.
    force
        Force amplitude, > 0; only the clearances over ``force / mass`` matter for the motion.
    omega_n
        Natural frequency > 0; 1 where times are scaled by it.
    mass
        Mass > 0; 1 where all else is nondimensional.
    si
        Whether the numbers are in SI units, which labels and reports then name.

    Raises
    ------
    InvalidParameterError
        A value outside its range; the message names value, range and remedy.

    Notes
    -----
    Phases of states are theta of force cos(theta). With ``lower_clearance = clearance`` the
    oscillator is symmetric under (x, v, theta) -> (-x, -v, theta + pi); to vary both clearances at
    once, vary ``force``: motions scale as x -> s x with (clearances, force) -> (s, s).

    An orbit with one impact of speed V per n forcing periods T = 2 pi n / omega has multipliers
    with the product restitution^2 exp(-2 zeta omega_n T).

    Examples
    --------
    >>> import vibroimpact as vi
    >>> oscillator = vi.ImpactOscillator(zeta=0.02, omega=2.0, restitution=0.8, clearance=0.0)
    >>> orbit = vi.find_orbit(oscillator, vi.State((-1.0,), (0.0,)))
    >>> orbit.symbol, orbit.stable
    ('1-1-0', True)
    """

    source = (
        "S. W. Shaw, P. J. Holmes, J. Sound Vib. 90 (1983) 129-155; A. B. Nordmark, Non-periodic motion caused by "
        "grazing incidence in an impact oscillator, J. Sound Vib. 145 (1991) 279-297; undamped, C. Budd, F. Dux, "
        "Chattering and related behaviour in impact oscillators, Phil. Trans. R. Soc. A 347 (1994) 365-389."
    )
    known_for = KnownFor(
        "Speed after the impacts over the frequency: an impact in one period, in two, in three, with chaos between.",
        "diagram", over=("omega", 2.4, 6.5),
    )  # fmt: skip
    to_try = (
        ("diagram impact-oscillator --zeta 0.02 --restitution 0.8 --clearance 0 --over omega=2:6:300 --out d.png",
         "one impact per period, per two, ..., chaos between"),
        ("simulate impact-oscillator --zeta 0 --restitution 0.5 --clearance 0.2 --omega 0.7 --out chatter.svg",
         "chatter and rest on the stop"),
    )  # fmt: skip
    example: ClassVar[Mapping[str, float]] = {
        "zeta": 0.02, "omega": 2.0, "restitution": 0.8, "clearance": 0.0,
    }  # fmt: skip

    zeta: float = parameter(nonnegative)
    omega: float = parameter(positive, "frequency", advice="The force must be periodic.")
    restitution: float = parameter(fraction)
    clearance: AnyFloat = parameter(real, "length", "clearance $s$")
    lower_clearance: float | None = parameter(
        _distance, "length", "lower clearance $s_B$", default=None
    )
    force: float = parameter(positive, "force", default=1.0)
    omega_n: float = parameter(positive, "frequency", default=1.0)
    mass: float = parameter(positive, "mass", "mass $m$", default=1.0)
    si: bool = field(default=False, compare=False)

    physical: ClassVar[Mapping[str, str]] = {
        "M": "mass", "K": "stiffness", "C": "damping", "F0": "force", "Omega": "frequency",
        "D": "length", "D_lower": "length", "restitution": "",
    }  # fmt: skip
    letters: ClassVar[Mapping[str, tuple[str, float]]] = {
        "D": ("clearance", 1.0), "D_lower": ("lower_clearance", 1.0), "Omega": ("omega", 1.0),
        "F0": ("force", 1.0),
    }  # fmt: skip

    def _check_together(self) -> None:
        """Refuse stops without a gap between them."""
        if not -self._below < self.clearance:
            raise InvalidParameterError(
                f"clearance = {self.clearance}, lower_clearance = {self.lower_clearance}: their sum "
                "must be > 0. The mass moves between the stops."
            )

    @classmethod
    def from_physical(  # type: ignore[override]
        cls,
        *,
        M: float,
        K: float,
        C: float,
        F0: float,
        Omega: float,
        D: float,
        restitution: float,
        D_lower: float | None = None,
    ) -> ImpactOscillator:
        """Make an oscillator in SI units.

        Parameters
        ----------
        M
            Mass [kg], > 0.
        K, C
            Stiffness [N/m], > 0, and damping [N s/m], >= 0.
        F0, Omega
            Force amplitude [N], > 0, and angular frequency [rad/s], > 0.
        D
            Distance from the unforced rest position up to stop A [m], any finite number.
        restitution
            Coefficient of restitution in [0, 1].
        D_lower
            Distance down to stop B [m], above -D; without it there is no stop B.

        Notes
        -----
        omega_n = sqrt(K / M), zeta = C / (2 sqrt(K M)), clearance = D, force = F0.

        A base that moves as Y cos(Omega T), and the stops with it, acts as F0 = M Omega^2 Y on the
        coordinate relative to the base.
        """
        given = {"M": M, "K": K, "F0": F0, "Omega": Omega}
        m, k, f0, big_omega = (positive(name, x) for name, x in given.items())
        c, d, below = nonnegative("C", C), real("D", D), _distance("D_lower", D_lower)
        return cls(
            zeta=c / (2.0 * (k * m) ** 0.5),
            omega=big_omega,
            restitution=restitution,
            clearance=d,
            lower_clearance=below,
            force=f0,
            omega_n=(k / m) ** 0.5,
            mass=m,
            si=True,
        )

    @property
    def _below(self) -> float:
        """Distance down to stop B, infinite without one."""
        return math.inf if self.lower_clearance is None else self.lower_clearance

    @property
    def period(self) -> float:
        """Forcing period 2 pi / omega."""
        return 2.0 * math.pi / self.omega

    @property
    def mechanism(self) -> Mechanism:
        """The oscillator as a mass, a spring, a dashpot and a contact."""
        m, w = self.mass, self.omega_n
        stops = RigidStop((1.0,), -self._below, self.clearance, self.restitution)
        return Mechanism(
            mass=[[m]],
            damping=[[2.0 * self.zeta * w * m]],
            stiffness=[[w * w * m]],
            forces=(Harmonic(self.omega, (0.0,), (self.force,)),),
            elements=(stops,),
        )

    def free_start(self) -> State:
        """State at rest midway between two stops; at one stop, off it by the static deflection at least."""
        if self.lower_clearance is None:
            deflection = self.force / (self.mass * self.omega_n**2)
            return State((min(0.0, self.clearance - deflection),), (0.0,))
        return State(((self.clearance - self.lower_clearance) / 2.0,), (0.0,))

    def on_stop(self, stop: str, *, v1: float, phase: float) -> State:
        """A state in which the mass stands on stop "A" or "B".

        Parameters
        ----------
        stop
            "A" (x = clearance) or "B" (x = -lower_clearance).
        v1
            Velocity of the mass.
        phase
            Phase theta of the force cos(theta) at this instant, radians.

        Raises
        ------
        InvalidParameterError
            Stop "B" of an oscillator without ``lower_clearance``.
        """
        check_stop_name(stop)
        speed, theta = real("v1", v1), real("phase", phase)
        if stop == "A":
            return State((self.clearance,), (speed,), theta)
        if self.lower_clearance is None:
            raise InvalidParameterError('stop = "B": does not exist. Give lower_clearance.')
        return State((-self.lower_clearance,), (speed,), theta)
