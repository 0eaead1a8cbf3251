"""Symbol: n-p-q of a periodic motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import CONTACT, Observer, Variables, whole


@dataclass(frozen=True, kw_only=True)
class Symbol(Observer):
    """The symbol n-p-q of a periodic motion: forcing periods, impacts at stops A and B.

    With several contacts p and q have a dimension of them; soft stops follow, counted where they are
    met, and friction, which counts nothing.

    Parameters
    ----------
    tolerance
        The motion is back where x, v / omega, and sine and cosine of the phase differ by at most
        ``tolerance`` times the largest |x| and |v| / omega, before the impact or after it, and
        1; in (0, 1). Without forcing omega is the inverse of the kernel's step.
    returns
        It is periodic if it returns at every multiple of its period to the end of the window, and
        at least so often, 1 to 10^6.

    Notes
    -----
    Zeros: not periodic within tolerance and window, or without impacts ("impacts" tells them
    apart). Completed chatter is one impact; without forcing n = 0. Of a window with more than 4096
    impacts the first ones decide.
    """

    name: ClassVar[str] = "symbol"
    tolerance: float = 1e-6
    returns: int = 2

    def variables(self, mechanism: Mechanism) -> Variables:
        """``n``, ``p``, ``q``: (...) with one contact, p and q (..., contact) with several."""
        count = len(mechanism.elements)
        more = ((CONTACT,), (count,)) if count > 1 else ((), ())
        text = "until the motion repeats itself"
        return {"n": whole("numbers", f"forcing periods {text}", 0, "int16")} | {
            name: whole("numbers", f"impacts at stop {stop} {text}", 1 + i * count, "int16", *more)
            for i, (name, stop) in enumerate(zip("pq", "AB", strict=True))
        }
