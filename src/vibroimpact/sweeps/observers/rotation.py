"""Rotation: the rotation number of the section points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import StopName
from vibroimpact.simulation.places import AtStop, check_stop
from vibroimpact.sweeps.observers.observer import Observer, Variables, labelled, reals


@dataclass(frozen=True, kw_only=True)
class Rotation(Observer):
    """Rotation number: turns about a centre from one section point to the next, in [0, 1/2].

    Parameters
    ----------
    stride
        Every stride-th impact at the stop is a section point, 1 to 10^6.
    contact, stop
        As in :class:`~vibroimpact.AtStop`.
    tolerance
        Where the impact speeds of three points in a row differ by at most this share of the largest
        of them, the motion is at a fixed point, which does not turn; in (0, 1).
    label
        Name of another rotation number, as in :class:`Section`: ``rotation_<label>``.

    Notes
    -----
    The number of :attr:`Attractor.rotation` where the points lie on one closed curve of one turn; rho and
    1 - rho are the same. The fraction p/q where they repeat themselves: 1/2 after a period
    doubling. Points at k impacts per turn, or on k curves in turn, have the fraction of their
    order; stride k looks at one of them.

    The weighted average converges faster than any power of the number of points (some 10^-4 for
    100, 10^-9 for 2000 in smooth motion); ``rotation_error``, an estimate, is its larger change to
    that of either half of the window: large in weak chaos and near locking. A motion that has not
    settled turns by the angle of its multiplier.

    NaN: at a fixed point ("symbol" says so), without impacts, with fewer than 8 turns in a half of
    the window, and where turns are so uneven that they cannot be counted, as in strong chaos.

    References
    ----------
    das2017, hopf1935
    """

    name: ClassVar[str] = "rotation"
    stride: int = 1
    contact: int = 0
    stop: StopName = "A"
    tolerance: float = 1e-6
    label: str = ""

    def variables(self, mechanism: Mechanism) -> Variables:
        """``rotation``, ``rotation_error``."""
        check_stop(mechanism, AtStop(self.stop, self.contact))
        name, where = labelled(self.name, self.label), f"stop {self.stop} of contact {self.contact}"
        texts = {
            name: f"rotation number per section point at {where}",
            f"{name}_error": "change of the rotation number between parts of the window",
        }
        return reals("number", texts)
