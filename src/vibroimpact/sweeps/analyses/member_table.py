"""Table of the last windows and final states of members, for matching attractors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Flags, Floats, Integers, Rows
from vibroimpact.attractors.classify import rest_on_stops
from vibroimpact.attractors.matching import observed_section, scale_of, strobe_symbols
from vibroimpact.attractors.point_sets import Kind
from vibroimpact.model.state import STATE
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.sections import Scale
from vibroimpact.sweeps.analyses.motion_codes import NO_IMPACTS, motions, symbol, symbols_of
from vibroimpact.sweeps.starts import States

Numbers = NDArray[Any]

# Continues members, so many times as long; True: observed all the time.
ExtendRun = Callable[[States, int, bool], "xr.Dataset"]


@dataclass(frozen=True)
class Table:
    """Data for matching, one row per member: its last window, and its final state.

    ``strobed``: points are at a phase of the force, as the chosen contact has no stop.
    """

    system: System
    scale: Scale
    codes: Integers
    points: Floats
    symbols: Integers
    ends: States
    strobed: bool

    @classmethod
    def of(
        cls, system: System, members: xr.Dataset, codes: xr.DataArray, begun: Floats,
        scale: Scale | None = None,
    ) -> Table:  # fmt: skip
        """Columns of an ensemble, in the order of ``end``; in its own units if none are given.

        ``codes``: those of motion_codes.py. ``begun``: phases at the start. Final phases are taken
        modulo the first forcing line, and so do not determine the phases of others.
        """
        dims = members["end"].dims

        def column(name: str) -> Floats:
            array = members[name].transpose(*dims, ...).values
            return np.asarray(array).reshape(-1, *array.shape[len(dims) :])

        scale = scale or scale_of(members, system)
        name = observed_section(members)
        section = (column(f"{name}_{kind}") for kind in STATE)
        position, velocity, phase = (column(f"final_{kind}") for kind in STATE)
        if len(mechanism_of(system).forces) > 1:
            phase = begun + mechanism_of(system).omega * column("time")
        points = scale.points(*section)
        strobed = name != "section"
        symbols = strobe_symbols(points) if strobed else symbols_of(members)
        symbols = symbols.reshape(-1, symbols.shape[-1])
        flat = codes.values.ravel().astype(np.int64)
        ends = States(position, velocity, phase)
        return cls(system, scale, flat, points, symbols, ends, strobed)

    def extended(self, rows: Rows, extend: ExtendRun, times: int, *, whole: bool = False) -> Table:
        """Table after some members are continued, for those that reach the end of the extension."""
        if not rows.size:
            return self
        states = self.ends.of(rows)
        members = extend(states, times, whole)
        scale = self.scale if self.on_section.any() else None
        more = Table.of(self.system, members, motions(members), states.phase, scale)
        through = more.codes >= NO_IMPACTS

        def renewed(old: Numbers, new: Numbers) -> Numbers:
            column = old.copy()
            column[rows[through]] = new[through]
            return column

        return replace(
            self,
            scale=more.scale,
            codes=renewed(self.codes, more.codes),
            points=renewed(self.points, more.points),
            symbols=renewed(self.symbols, more.symbols),
            ends=States(*map(renewed, self.ends, more.ends)),
        )

    @property
    def on_section(self) -> Flags:
        """Mask of members with a point on the section."""
        return np.asarray(np.isfinite(self.points[:, 0]).all(axis=-1))

    @property
    def full(self) -> Flags:
        """Mask of members with the full number of kept section points."""
        return np.asarray(np.isfinite(self.points[:, -1]).all(axis=-1))

    @property
    def settled(self) -> Flags:
        """Mask of members that are periodic within the tolerance of the symbol."""
        return np.asarray(self.symbols[:, 1:].any(axis=1))

    @property
    def silent(self) -> Flags:
        """Mask of members without impact in their last window; none of machines without stops."""
        return np.asarray((self.codes == NO_IMPACTS) & (not self.strobed))

    def symbol_words(self, members: Rows) -> list[str]:
        """Symbol of each member, or "not periodic"."""
        found, place = np.unique(self.symbols[members], axis=0, return_inverse=True)
        words = [symbol(row) if row[1:].any() else "not periodic" for row in found]
        return [words[i] for i in place]

    def without_impacts(self, members: Rows) -> list[str]:
        """Name of the motion of each member without impacts: rest on stops, or flight."""
        rests = rest_on_stops(self.system, self.ends.position[members])
        return [rest or str(Kind.SILENT) for rest in rests]
