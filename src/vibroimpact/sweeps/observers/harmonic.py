"""Harmonic: the part of a coordinate at a multiple of the forcing frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables, need_forcing
from vibroimpact.sweeps.observers.rows import row_variables


@dataclass(frozen=True, kw_only=True)
class Harmonic(Observer):
    """Amplitude of the part of a coordinate at a multiple of the forcing frequency.

    Over a window of length T that is 2 |integral of u exp(-i k omega t) dt| / T, integrated to rounding.
    Where the window holds whole turns of k omega t it is the amplitude of that part alone: for a third,
    observe 51 periods, not 50.

    Parameters
    ----------
    row, label
        As in :class:`Extremes`; the variable is ``<label>_harmonic``. Several of one row need labels.
    harmonic
        The multiple k of the frequency of the first forcing line, from 2^-10 to 2^10; fractions are
        subharmonics.
    """

    name: ClassVar[str] = "harmonic"
    row: tuple[float, ...] = ()
    label: str = "x"
    harmonic: float = 1.0

    def variables(self, mechanism: Mechanism) -> Variables:
        """One variable; with dim ``coordinate`` without a row."""
        need_forcing(self, mechanism, "there is no frequency to be a multiple of.")
        kinds = {"harmonic": f"amplitude at {self.harmonic:g} of the forcing frequency"}
        return row_variables("amplitudes", kinds, self.row, self.label, mechanism)
