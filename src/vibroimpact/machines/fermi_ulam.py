"""The Fermi-Ulam accelerator: a free ball between a wall at rest and one that moves harmonically.

    x'' = 0,   0 <= x <= length + a sin(theta),  theta' = omega                              (1)

A ball that meets the moving wall where that stands still, at its outermost place, keeps its speed; it comes
back after n periods where

    speed = (length + a) omega / (n pi)                                                      (2)

The moving wall is stop A of contact 0, the wall at rest stop B of contact 1.
"""

from __future__ import annotations

from dataclasses import field

from vibroimpact._core.checks import fraction, positive
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, machine, parameter
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State


@machine()
class FermiUlam(Machine):
    """Fermi-Ulam accelerator: a ball between two walls, one of which moves.

    Parameters
    ----------
    length
        Mean distance of the walls, above the amplitude.
    amplitude
        Amplitude a of the wall that moves, > 0.
    omega
        Its frequency > 0.
    restitution
        Coefficient of restitution in [0, 1], of both walls; 1 in the classical model.
    si
        Whether the numbers are in SI units.
    """

    source = (
        "E. Fermi (1949); S. M. Ulam (1961); A. J. Lichtenberg, M. A. Lieberman, Regular and Chaotic Dynamics, "
        "section 3.4; (2) is derived in the file of the machine. Walls move exactly, not in the simplified map."
    )
    known_for = KnownFor(
        "Phase and velocity at impacts on the moving wall, from twenty starts: islands in a chaotic sea.",
        "section", speeds=tuple(0.1 + 0.08 * k for k in range(20)), settled=0,
    )  # fmt: skip
    to_try = (
        ("section fermi-ulam --points 5000 --out section.svg", "islands in a chaotic sea"),
        (
            "basins fermi-ulam --restitution 0.9 --over x1=0:0.9:100 --over v1=-1:1:100 --out basins.png",
            "what is left of it with losses",
        ),
    )

    length: float = parameter(positive, "length", "distance of the walls", default=1.0)
    amplitude: float = parameter(positive, "length", "wall amplitude $a$", default=0.05)
    omega: float = parameter(positive, "frequency", default=1.0)
    restitution: float = parameter(fraction, default=1.0)
    si: bool = field(default=False, compare=False)

    def _check_together(self) -> None:
        """Refuse a wall that would meet the other one."""
        if not self.amplitude < self.length:
            raise InvalidParameterError(
                f"amplitude = {self.amplitude}: must be below length = {self.length}. The walls must not meet."
            )

    @property
    def mechanism(self) -> Mechanism:
        """A free mass between two stops, one of which moves."""
        moving, r = Harmonic(self.omega, (self.amplitude,)), self.restitution
        return Mechanism(
            mass=[[1.0]],
            damping=[[0.0]],
            stiffness=[[0.0]],
            elements=(
                RigidStop((1.0,), upper=self.length, restitution=r, motion=(moving,)),
                RigidStop((1.0,), lower=0.0, restitution=r),
            ),
        )

    def free_start(self) -> State:
        """State in the middle, with the speed that crosses the length in half a period."""
        return State((self.length / 2.0,), (self.length * self.omega / 3.141592653589793,))
