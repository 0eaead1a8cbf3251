"""The founding paper: its parameter sets, panels and claims as data.

`sets.toml` and `claims.toml` hold what is printed; this module only reads them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from vibroimpact.damper import ImpactDamper

TITLE = "Nonlinear dynamic characteristics of a vibro-impact system under harmonic excitation"
"""Of the paper. The copy at hand names neither authors nor journal."""

Printed = float | int | str | bool | list[float] | list[str]
"""A printed value in `claims.toml`."""


@dataclass(frozen=True, slots=True)
class Parameters:
    """Parameters of `ImpactDamper` that a set fixes; the paper varies omega."""

    mass_ratio: float
    omega_n: float
    zeta: float
    restitution: float
    half_clearance: float


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """One parameter set, the range of omega the paper studies, and the figures that use it."""

    name: str
    parameters: Parameters
    omega_range: tuple[float, float]
    figures: tuple[str, ...]

    def damper(self, omega: float) -> ImpactDamper:
        """Return the damper of this set at one frequency."""
        return ImpactDamper(omega=omega, **asdict(self.parameters))


@dataclass(frozen=True, slots=True)
class Panel:
    """One panel of Figs. 2 to 5; `omega` is one frequency or a range."""

    figure: str
    letter: str
    set: str
    shows: str
    omega: float | tuple[float, float]

    @property
    def name(self) -> str:
        """Return the name of the panel, as in 2a."""
        return self.figure + self.letter


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim of the paper; `printed` holds its numbers and types, keyed as in `claims.toml`."""

    id: str
    section: str
    set: str
    kind: str
    quote: str
    printed: Mapping[str, Printed]
    panels: tuple[str, ...] = ()
    omega: float | None = None
    start: str = ""
    contradicts: tuple[str, ...] = ()
    notes: str = field(default="", repr=False)


def parameter_sets() -> Mapping[str, ParameterSet]:
    """Return the parameter sets A, B, C."""
    return MappingProxyType(
        {
            name: ParameterSet(
                name=name,
                parameters=Parameters(**{key: row[key] for key in Parameters.__slots__}),
                omega_range=(row["omega_range"][0], row["omega_range"][1]),
                figures=tuple(row["figures"]),
            )
            for name, row in _read("sets.toml")["sets"].items()
        }
    )


def panels() -> tuple[Panel, ...]:
    """Return the 29 panels of Figs. 2 to 5, in the paper's order."""
    return tuple(_panel(row) for row in _read("sets.toml")["panels"])


def claims() -> tuple[Claim, ...]:
    """Return every claim of sections 3 to 5 and of captions 2 to 5 that has a number or a type."""
    return tuple(_claim(row) for row in _read("claims.toml")["claims"])


def _read(name: str) -> dict[str, Any]:
    return tomllib.loads(files(__package__).joinpath(name).read_text(encoding="utf-8"))


def _panel(row: dict[str, Any]) -> Panel:
    row = dict(row)
    if "omega_range" in row:
        low, high = row.pop("omega_range")
        row["omega"] = (low, high)
    return Panel(**row)


def _claim(row: dict[str, Any]) -> Claim:
    row = dict(row)
    row["printed"] = MappingProxyType(row.get("printed", {}))
    for key in ("panels", "contradicts"):
        row[key] = tuple(row.get(key, ()))
    return Claim(**row)
