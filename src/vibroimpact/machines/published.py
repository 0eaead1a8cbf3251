"""Published parameter sets: A, B, C of the founding paper, and the panels of its figures.

``impact_damper_sets.toml`` holds the printed values; this module only reads it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from vibroimpact.machines.impact_damper import ImpactDamper


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
            for name, row in _read()["sets"].items()
        }
    )


def panels() -> tuple[Panel, ...]:
    """Return the 29 panels of Figs. 2 to 5, in the paper's order."""
    return tuple(_panel(row) for row in _read()["panels"])


def cases() -> dict[str, dict[str, float]]:
    """Return parameters by name: the sets without omega, and the panels at one omega."""
    sets = {name: asdict(each.parameters) for name, each in parameter_sets().items()}
    return sets | {
        panel.name: sets[panel.set] | {"omega": panel.omega}
        for panel in panels()
        if isinstance(panel.omega, float)
    }


def _read() -> dict[str, Any]:
    text = files(__package__).joinpath("impact_damper_sets.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def _panel(row: dict[str, Any]) -> Panel:
    row = dict(row)
    if "omega_range" in row:
        low, high = row.pop("omega_range")
        row["omega"] = (low, high)
    return Panel(**row)
