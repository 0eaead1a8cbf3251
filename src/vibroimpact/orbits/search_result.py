"""Result of a search for periodic orbits: the orbits, and the ends of motions and guesses."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Count
from vibroimpact.machines.units import units_of
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.find import unfolded
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import impacting
from vibroimpact.orbits.stability import Stability, in_words
from vibroimpact.results.result import Result, complex_columns, meanings, sized


class MotionEnd(StrEnum):
    """End of a motion of the search."""

    IMPACTS = "kept impacting"
    CHANGING = "kept changing states without impact"
    UNPRESCRIBED = "had several events at once, or an open one"
    SILENT = "stopped impacting"
    DIVERGED = "diverged"
    BROKEN = "could not be followed"


class GuessEnd(StrEnum):
    """Result of Newton's method from a guess."""

    NEW = "to a new orbit"
    INADMISSIBLE = "to a new orbit that is not admissible"
    KNOWN = "to a known orbit"
    SPEEDLESS = "to a touch without impact"
    NOWHERE = "without convergence"


@dataclass(frozen=True, eq=False)
class OrbitSearch(Result):
    """Orbits of a search, without repetition, with statistics of the search.

    Attributes
    ----------
    system, most_cycles, most_impacts, starts, seed
        The arguments of the search.
    orbits
        Sorted by cycles, number of impacts, symbol; symmetric and admissible ones first.
    mirror_of
        For each orbit, the index of the one whose mirror image it is; None for those found first.
    motions
        Numbers of motions by their end, :class:`MotionEnd`.
    guesses
        Numbers of guesses by their result, :class:`GuessEnd`.
    repeated
        Number of nearly closed parts that resembled an earlier guess or orbit, and were skipped.
    unresolved
        Numbers of motions whose ends lead to no orbit within the bounds, by the sentence with which
        :func:`find_orbit` refuses them; parts before may have led to orbits.
    """

    system: System
    most_cycles: Count
    most_impacts: Count
    starts: Count
    seed: Count
    orbits: tuple[Orbit, ...] = field(metadata=sized("orbit"), repr=False)
    mirror_of: tuple[Count | None, ...] = field(metadata=sized("orbit"), repr=False)
    motions: Mapping[MotionEnd, Count]
    guesses: Mapping[GuessEnd, Count]
    repeated: Count
    unresolved: Mapping[str, Count] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.orbits)

    def __repr__(self) -> str:
        stable = sum(orbit.stable for orbit in self.orbits)
        admissible = sum(orbit.admissible for orbit in self.orbits)
        return (
            f"OrbitSearch: {len(self)} orbits, {admissible} admissible, {stable} stable, with at "
            f"most {self.most_impacts} impacts in at most {self.most_cycles} cycles\n"
            f"  {self.starts} motions (seed {self.seed}): {_shares(self.motions)}\n"
            f"  {sum(self.guesses.values())} guesses led {_shares(self.guesses)}; "
            f"{self.repeated} more were like these"
            + "".join(f"\n  {n} ended on none of them: {why}" for why, n in self.unresolved.items())
        )

    def __str__(self) -> str:
        return f"{self!r}\n{self.table()}" if self.orbits else repr(self)

    def table(self) -> str:
        """Table of the orbits."""
        heads = ("orbit", "impacts", "symmetric", "stability", "|multiplier|", "clearance", "")
        rows = [heads, *(self._row(k) for k in range(len(self)))]
        sizes = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return "\n".join(
            "  ".join(word.ljust(size) for word, size in zip(row, sizes, strict=True)).rstrip()
            for row in rows
        )

    def _row(self, k: int) -> tuple[str, ...]:
        orbit, image = self.orbits[k], self.mirror_of[k]
        remark = f"mirror image of {image}" if image is not None else ""
        return (
            f"{k}  {orbit.symbol}",
            sequence_of(orbit),
            "yes" if orbit.symmetric else "no",
            in_words(orbit.stability, orbit.family_dimension),
            f"{abs(orbit.multipliers[0]):.6g}",
            units_of(self.system).text(orbit.clearance_to_grazing, quantity="length", digits=4),
            "; ".join(filter(None, [remark, orbit.inadmissible_reason])),
        )

    def to_dataset(self) -> xr.Dataset:
        """Convert the orbits to an xarray dataset, with ``row_size`` impacts for each orbit.

        With elements every change of state counts among them; ``mode`` and ``watch`` are those of
        the :class:`Flight` after each, ``struck`` whether it is an impact.
        """
        guesses = [unfolded(orbit) for orbit in self.orbits]
        signatures = [orbit.signature.impacts for orbit in self.orbits]
        stops = np.array([stop for impacts in signatures for stop in impacts]).reshape(-1, 2)
        n = mechanism_of(self.system).degrees
        states = np.vstack([np.zeros((0, 2 * n + 1)), *(guess.states for guess in guesses)])
        both = ("impact", "coordinate")
        known = {
            "position": "length", "velocity": "velocity", "duration": "time", "clearance_to_grazing": "length",
            "least_impact_speed": "velocity",
        }  # fmt: skip
        return units_of(self.system).of_variables(
            super()
            .to_dataset()
            .assign(
                self._by_orbit()
                | self._by_flight()
                | {
                    "row_size": ("orbit", [len(impacts) for impacts in signatures]),
                    "contact": ("impact", stops[:, 0].astype(np.int32)),
                    "side": ("impact", stops[:, 1].astype(np.int32)),
                    "position": (both, states[:, :n]),
                    "velocity": (both, states[:, n : 2 * n]),
                    "phase": ("impact", states[:, 2 * n], {"units": "rad"}),
                    "duration": ("impact", np.concatenate([[], *(g.durations for g in guesses)])),
                },
            )
            .assign_attrs(
                motions=_counts(self.motions),
                guesses=_counts(self.guesses),
                unresolved="; ".join(f"{n} {why}" for why, n in self.unresolved.items()),
            ),
            known,
        )

    def _by_flight(self) -> dict[str, tuple[str, object]]:
        """Modes and guards of flights, and which changes are impacts; nothing without elements."""
        m = mechanism_of(self.system)
        if not m.switching:
            return {}
        every = [orbit.signature for orbit in self.orbits]
        flights = np.array([f for s in every for f in s.flights]).reshape(-1, 2).astype(np.int32)
        struck = [x for s in every for x in impacting(m, s)]
        return {
            "mode": ("impact", flights[:, 0]),
            "watch": ("impact", flights[:, 1]),
            "struck": ("impact", _numbers(struck)),
        }

    def _by_orbit(self) -> dict[str, tuple[Any, ...]]:
        """Variables with one entry or row per orbit."""
        every, place = self.orbits, ("orbit", "multiplier")
        count = len(every[0].multipliers) if every else 0
        values = np.array([o.multipliers for o in every]).reshape(len(every), count)
        return {
            "symbol": ("orbit", [o.symbol for o in every]),
            "cycles": ("orbit", [o.signature.cycles for o in every]),
            "symmetric": ("orbit", _numbers([o.symmetric for o in every])),
            "stability": (
                "orbit",
                np.array([o.stability for o in every], dtype=np.int8),
                meanings(Stability),
            ),
            "inadmissible_reason": ("orbit", [o.inadmissible_reason for o in every]),
            "mirror_of": ("orbit", _numbers([-1 if k is None else k for k in self.mirror_of])),
            **complex_columns("multipliers", place, values),
            "determinant_error": ("orbit", [o.determinant_error for o in every]),
            "clearance_to_grazing": ("orbit", [o.clearance_to_grazing for o in every]),
            "least_impact_speed": ("orbit", [o.least_impact_speed for o in every]),
        }


def sequence_of(orbit: Orbit) -> str:
    """Impacts in order: A and B for contact 0, A1 and B1 for contact 1, and so on; "-" without any.

    Soft stops that are met are among them, other changes of state are not.
    """
    struck = impacting(orbit.mechanism, orbit.signature)
    impacts = itertools.compress(orbit.signature.impacts, struck)
    return "".join(stop.label for stop in impacts) or "-"


def _numbers(values: list[int] | list[bool]) -> NDArray[np.int32]:
    return np.array(values, dtype=np.int32)


def _shares(counts: Mapping[MotionEnd, Count] | Mapping[GuessEnd, Count]) -> str:
    whole = max(sum(counts.values()), 1)
    return ", ".join(f"{100.0 * n / whole:.3g}% {end}" for end, n in counts.items() if n) or "-"


def _counts(counts: Mapping[MotionEnd, Count] | Mapping[GuessEnd, Count]) -> str:
    return ", ".join(f"{n} {end}" for end, n in counts.items())
